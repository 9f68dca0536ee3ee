// Video through OpenCV (FFmpeg): frames in order with their times, and H.264 out.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "scene/model/image.h"

namespace lumi {

bool HasVideoExtension(const std::filesystem::path& path);

struct VideoFrame {
  int index = 0;
  // The container's; index / fps (or a frame after the last one, where that is later) where it says none or one that
  // does not increase.
  double time_s = 0;
  Image8 rgb;
};

class VideoReader {
 public:
  explicit VideoReader(const std::filesystem::path& path);  // throws InputError
  ~VideoReader();
  double fps() const;
  long frame_count_hint() const;  // the container's claim; 0 where unknown
  int width() const;
  int height() const;
  std::optional<VideoFrame> Next();  // nullopt at the end (or where the file is cut off)
  bool Skip();                       // decodes without converting; false at the end
  int frames_read() const;
  // After the end: fewer frames than the container claims (a file cut off in the middle). MPEG streams (.mpg, .ts)
  // claim nothing: always false there.
  bool truncated() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// H.264 in an MP4 (through the ffmpeg program), yuv420p, crf 18; frames of one size, odd sizes are padded by a pixel.
// The file appears under its name when Finish was called. Throws MachineError when there is no ffmpeg. ffmpeg dies with
// the thread that added the first frame: add from one that lasts until Finish.
class VideoWriter {
 public:
  VideoWriter(const std::filesystem::path& path, double fps);
  ~VideoWriter();  // without Finish: nothing is left
  void Add(const Image8& rgb);
  void Finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
