// Decoded frames become 8-bit RGB as they are shown.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/files/ffmpeg/input.h"

namespace lumi::ffmpeg {

// What the colours of a frame are: its own words, or the standard's default.
struct Colours {
  int width = 0, height = 0;
  AVPixelFormat format = AV_PIX_FMT_NONE;
  AVColorSpace matrix = AVCOL_SPC_UNSPECIFIED;
  AVColorTransferCharacteristic transfer = AVCOL_TRC_UNSPECIFIED;
  AVColorPrimaries primaries = AVCOL_PRI_UNSPECIFIED;
  AVChromaLocation chroma = AVCHROMA_LOC_UNSPECIFIED;
  bool full_range = false;
  bool Hdr() const { return transfer == AVCOL_TRC_SMPTE2084 || transfer == AVCOL_TRC_ARIB_STD_B67; }
  bool operator==(const Colours&) const = default;
};
Colours ColoursOf(const AVFrame& frame);

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
  Colours colours_;  // what scaler_ or graph_ is made for
  ScalerPtr scaler_;
  FramePtr planes_{av_frame_alloc()};  // their output, kept: allocating it anew costs as much as converting
  GraphPtr graph_;
  AVFilterContext *source_ = nullptr, *sink_ = nullptr;
};

}  // namespace lumi::ffmpeg
