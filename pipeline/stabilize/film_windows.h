// A video decoded once, as windows of frames on disk.
#pragma once

#include <filesystem>
#include <memory>

#include "scene/program/progress.h"

namespace lumi {

struct FilmFacts {
  double fps = 0;
  int width_px = 0, height_px = 0;
  long frames_hint = 0;
  bool sound = false;
};
// Throws InputError where there is no video stream in it.
FilmFacts LookAtFilm(const std::filesystem::path& video);

// "frame_000123.jpg"
std::string FilmFrameName(int index);

// Frames in order, each written once. Not thread-safe.
class FilmFrames {
 public:
  explicit FilmFrames(const std::filesystem::path& video);
  ~FilmFrames();
  // Frames first ... first + count - 1 as files in `folder`; fewer at the film's end: how many are there. `first` may
  // go back into what the last call wrote (these are linked), never beyond the frame after them. Files that are there
  // stay untouched: they are an earlier run's, of the same film, and what was made of them is recognised by them.
  int Write(int first, int count, const std::filesystem::path& folder, ProgressSink& progress);
  int decoded() const;  // frames so far
  bool AtEnd();         // no frame follows: looks one ahead
  // Of the frames decoded so far: the shortest and the longest time from one to the next, seconds; 0, 0 before the
  // second.
  std::pair<double, double> Steps() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi
