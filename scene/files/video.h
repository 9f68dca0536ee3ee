// Video: frames as they are shown, in order and with their times, and H.264 out.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

bool HasVideoExtension(const std::filesystem::path& path);

struct VideoFrame {
  int index = 0;      // among the frames that are shown
  double time_s = 0;  // when it is shown, from the first frame that is shown; strictly increasing
  Image8 rgb;         // turned as the file says
};

// The times of all frames, from the packets alone: nothing is decoded, which takes a small part of the time.
struct VideoTimes {
  std::vector<double> time_s;  // as VideoFrame::time_s; a damaged file may have fewer frames that can be decoded
  double fps = 0;              // the nominal rate: one over the step between most successive frames
  double average_fps = 0;      // frames a second from the first to the last, as VideoReader::fps
  bool constant = true;        // frame i is at i / fps, up to a tenth of a step or the container's rounding
  double largest_gap_s = 0;    // between two successive frames; 0 where there is one frame
  int times_made_up = 0;       // frames whose own time is missing or does not increase: a step of 1 / fps stands there
  bool has_sound = false;
};
VideoTimes ReadVideoTimes(const std::filesystem::path& path);  // throws InputError

// How many frames of that size are decoded before they are worked on side by side: 256 MB of them, at least one for
// each thread, at most `most`.
std::size_t FramesAtOnce(int width, int height, std::size_t most);

class VideoReader {
 public:
  explicit VideoReader(const std::filesystem::path& path);  // throws InputError
  ~VideoReader();
  double fps() const;             // the average rate that the container states, 30 where it states none
  long frame_count_hint() const;  // the container's claim; 0 where unknown
  int width() const;              // of the frames as they are shown
  int height() const;
  std::optional<VideoFrame> Next();  // nullopt at the end (or where the file is cut off)
  bool Skip();                       // decodes without converting; false at the end
  double time_s() const;             // of the frame that Next or Skip came to last; 0 before the first
  int frames_read() const;
  // After the end: fewer frames than the container claims (a file cut off in the middle). MPEG streams (.mpg, .ts)
  // claim nothing: always false there.
  bool truncated() const;
  int times_made_up() const;  // as VideoTimes::times_made_up, among the frames read so far
  // One line each, for ProgressSink::Message: what is done to the colours or cannot be (HDR, known once the video is
  // open), and times that were made up (known at the end).
  std::vector<std::string> remarks() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Before work of minutes: throws UsageError where a file of that name is there that VideoWriter has not written, or a
// folder; MachineError where none can be written.
void RequireOurFilm(const std::filesystem::path& file);

// H.264 in an MP4, yuv420p, crf 18; frames of one size, odd sizes are padded by a pixel. The file appears under its
// name when Finish was called. Frames have a constant rate (Add with the picture alone) or their own times (Add with
// seconds, which increase; the first frame's are the video's 0, fps is then what the last frame's duration follows
// from): one or the other, not both.
class VideoWriter {
 public:
  VideoWriter(const std::filesystem::path& path, double fps);
  ~VideoWriter();  // without Finish: nothing is left
  void Add(const Image8& rgb);
  void Add(const Image8& rgb, double time_s);
  void Finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
