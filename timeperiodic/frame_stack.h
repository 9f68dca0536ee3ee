// A video as small frames in memory, with their times: what periods and moving parts are sought in.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/model/image.h"
#include "scene/program/progress.h"

namespace lumi {

struct FrameStack {
  int width = 0, height = 0;              // of the small frames, pixels
  int video_width = 0, video_height = 0;  // of the video's
  double fps = 30;                        // VideoClock::fps: of a variable rate one over the usual step
  std::vector<Image8> frames;             // RGB, averaged over the area that a small pixel covers
  // When each was taken, in frames of 1 / fps after the first: whole numbers on a constant rate, with gaps where frames
  // were dropped; any of a variable rate.
  std::vector<double> time;
  std::vector<double> time_s;  // as the container states them, seconds
  bool uneven = false;         // not 0, 1, 2 ...
  bool truncated = false;      // fewer frames than the container claims
  std::vector<int> repeated;   // frames whose pixels are those of the one before

  int count() const { return static_cast<int>(frames.size()); }
  double scale() const { return static_cast<double>(width) / video_width; }  // small pixels a video's pixel
};

struct FrameStackOptions {
  int max_width_px = 192;    // of the small frames, >= 16
  int max_frames = 100000;   // more: DataError, a period shows in fewer
  int first_frames = 0;      // no more are read; 0: all
  double max_bytes = 1.5e9;  // the frames are made smaller where they would take more
};

// Throws InputError (no such video, no frame in it), DataError (too long; times that are missing or fall, before a
// frame is decoded).
FrameStack ReadFrameStack(const std::filesystem::path& video, const FrameStackOptions& options, ProgressSink& progress);

// From frames that are there already, all of one size, RGB. time: in frames, ascending; empty: 0, 1, 2 ...
FrameStack StackOf(std::vector<Image8> frames, double fps, std::vector<double> time = {});

}  // namespace lumi
