// When a video's frames were taken: on the grid of a rate where they stand on one, at their own times where they do
// not (a phone's variable rate). A frame that was dropped is a gap.
//
//   const VideoTimes times = ReadUsableTimes(path);
//   const VideoClock clock(times);
//   while (auto frame = reader.Next()) t.push_back(clock.TimeOf(frame->time_s));
#pragma once

#include <filesystem>
#include <vector>

#include "scene/files/video.h"

namespace lumi {

// The median step; 0 for fewer than two times.
double UsualStep(const std::vector<double>& times_s);

class VideoClock {
 public:
  VideoClock() = default;  // 30 a second
  explicit VideoClock(const VideoTimes& times);
  // Frames a second: the grid's, else one over the usual step.
  double fps() const { return fps_; }
  // Every frame is a whole number of steps after the first, up to what containers round away (a millisecond).
  bool on_grid() const { return on_grid_; }
  // On a grid without gaps: frame i at i / fps.
  bool constant() const { return on_grid_ && !gaps_; }
  // Of a frame whose container says `time_s`: without the rounding where there is a grid.
  double TimeOf(double time_s) const;

 private:
  double fps_ = 30;
  bool on_grid_ = true, gaps_ = false;
};

// ReadVideoTimes, for code that computes with the times. Throws InputError; DataError, with a way out, where more than
// a fiftieth of the times but not all are missing or do not increase (if all are, the file has no times and a constant
// rate is assumed), or where frames lie so far apart that the clock must have jumped.
VideoTimes ReadUsableTimes(const std::filesystem::path& video);
void RequireUsable(const VideoTimes& times, const std::filesystem::path& video);

// How long a film of these frames lasts: the last one is shown for the usual step.
double FilmLength_s(const std::vector<double>& times_s, double fps);

// How often each frame is shown in a film of constant rate that shows the frame nearest in time. The film lasts
// FilmLength_s and begins with the first frame. Times ascend.
std::vector<int> ShownAtRate(const std::vector<double>& times_s, double length_s, double fps);

// Whether the times are 0, 1 / fps, 2 / fps ... after the first, to a microsecond.
bool AreEven(const std::vector<double>& times_s, double fps);

}  // namespace lumi
