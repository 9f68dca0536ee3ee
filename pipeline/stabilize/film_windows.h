// A video decoded once, as windows of frames on disk.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "scene/files/video_clock.h"
#include "scene/program/progress.h"

namespace lumi {

struct FilmFacts {
  double fps = 0;              // VideoClock::fps
  VideoClock clock;            // of its frames
  std::vector<double> time_s;  // of each frame; a damaged film may have fewer that can be decoded
  int width_px = 0, height_px = 0;
  bool sound = false;
};
// Throws InputError where there is no video stream in it, DataError where its frames' times are of no use
// (ReadUsableTimes).
FilmFacts LookAtFilm(const std::filesystem::path& video, ProgressSink& progress);

// "frame_000123.jpg"
std::string FilmFrameName(int index);

// How many of the frames up to `last` were taken in the last `seconds`, to half a step.
int FramesWithin(const std::vector<double>& time_s, int last, double seconds, double step_s);

// Frames in order, each written once. Not thread-safe.
class FilmFrames {
 public:
  FilmFrames(const std::filesystem::path& video, const VideoClock& clock);
  ~FilmFrames();
  // Frames first ... first + count - 1 as files in `folder`; fewer at the film's end: how many are there. `first` may
  // go back into what the last call wrote (these are linked), never beyond the frame after them. Files that are there
  // stay untouched: they are an earlier run's, of the same film, and what was made of them is recognised by them.
  int Write(int first, int count, const std::filesystem::path& folder, ProgressSink& progress);
  bool AtEnd();  // no frame follows: looks one ahead
  // Of the frames decoded so far, from the first one, ascending.
  const std::vector<double>& time_s() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
