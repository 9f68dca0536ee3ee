// A file's video stream: packets, and what the file says of it.
#pragma once

#include <filesystem>

#include "scene/files/ffmpeg/owners.h"
#include "scene/files/video_codecs.h"

namespace lumi::ffmpeg {

// How frames are turned to be shown: transposed first, then mirrored.
struct Turn {
  bool transpose = false, flip_x = false, flip_y = false;
  bool skew = false;  // the file asks for another angle than a quarter turn: the nearest quarter turn is taken
};
// From a display matrix of 9 numbers (ISO/IEC 14496-12, 6.2.2); none: no turn.
Turn TurnOf(const std::int32_t* matrix);

class Input {
 public:
  // The file is read by a descriptor, whatever its name would mean to FFmpeg, and no other file is opened. Throws
  // InputError.
  explicit Input(const std::filesystem::path& path);
  ~Input();
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;
  const std::filesystem::path& path() const { return path_; }
  AVStream& video() const { return *video_; }
  double Seconds(std::int64_t time_stamp) const;  // NaN where there is none
  bool Read(AVPacket& packet);  // the next packet of the video; false at the end, also where the file is cut off
  Turn StatedTurn() const;
  double PixelAspect(AVFrame& frame) const;  // width of a pixel over its height; 1 where neither file nor frame says it
  std::string Comment() const;               // the file's own; empty: none
  VideoClaims Claims() const;                // all but size and remarks

 private:
  void Close();
  std::filesystem::path path_;
  int file_ = -1;
  AVIOContext* io_ = nullptr;
  AVFormatContext* format_ = nullptr;
  AVStream* video_ = nullptr;
};

}  // namespace lumi::ffmpeg
