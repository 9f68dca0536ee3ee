// Decoded frames become 8-bit RGB as they are shown.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/files/ffmpeg/colours.h"
#include "scene/files/ffmpeg/filter_graph.h"
#include "scene/files/ffmpeg/input.h"

namespace lumi::ffmpeg {

class ToRgb {
 public:
  // pixel_aspect: width of a pixel over its height; frames are widened or heightened so that pixels are square. Throws
  // InputError where there is no way from this frame to RGB, MachineError where this FFmpeg lacks one.
  ToRgb(std::filesystem::path path, const AVFrame& first, double pixel_aspect, const Turn& turn, int threads);
  ~ToRgb();
  int width() const { return turn_.transpose ? height_ : width_; }
  int height() const { return turn_.transpose ? width_ : height_; }
  std::vector<std::string> Remarks() const;
  // All frames come out in the first one's size.
  Image8 Convert(AVFrame& frame);

 private:
  void Prepare(const Colours& colours);
  void PrepareScaler();
  void PrepareToneMap();
  std::filesystem::path path_;
  Turn turn_;
  int width_ = 0, height_ = 0;  // before turning
  bool stretched_ = false;      // pixels were not square
  int threads_ = 1;
  double peak_ = 0;  // of HDR: cd/m2
  Colours colours_;  // what scaler_ or tone_map_ is made for
  ScalerPtr scaler_;
  FramePtr planes_{av_frame_alloc()};  // their output, kept: allocating it anew costs as much as converting
  FilterGraph tone_map_;
};

}  // namespace lumi::ffmpeg
