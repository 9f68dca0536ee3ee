// Stabilised videos measured against their input, as the stabilisation literature does (homography.h, stability.h), and
// by what trembles in them (jitter.h).
//
//   ScoreResult result = Score({.input = "shaky.mp4", .stabilised = {"a.mp4", "b.mp4"}}, progress);
//
// All videos are read side by side, a few frames of each at a time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/program/progress.h"
#include "stabilize/score/jitter.h"
#include "stabilize/score/stability.h"

namespace lumi::score {

struct ScoreOptions {
  std::filesystem::path input;
  std::vector<std::filesystem::path> stabilised;  // may be empty: the input alone
};

// Pixels are the video's own. None where it cannot be said: `warnings` of the result say why.
struct VideoScore {
  std::filesystem::path file;
  int width_px = 0, height_px = 0;
  double fps = 0;
  // Against the input; the input's own are 1. Mean over frames; least (the worst frame's), its frame, and the mean;
  // mean.
  std::optional<double> cropping_ratio, distortion, distortion_mean, kept_area;
  int distortion_frame = -1;
  // Of its own path: the least of the three.
  std::optional<double> stability, stability_x, stability_y, stability_rotation;
  // The same for the paths less their best straight line: here a steady walk or pan counts as fully stable, while the
  // score above gives it 0.9 at most.
  std::optional<double> stability_detrended;
  JitterResult jitter;
  MeasuredPath::Path path;
  std::vector<int> cuts;   // frames that begin a new shot
  int failed_steps = 0;    // frames without a movement from the one before
  int failed_matches = 0;  // frames that cannot be found in the input's
  bool uneven_times = false;
};

struct ScoreResult {
  std::vector<VideoScore> videos;  // the input first
  int frames = 0;                  // that all videos have
  std::vector<std::string> warnings;
  double seconds = 0;
};

// Throws InputError (no video, no video stream), DataError (one frame; times that are missing or fall; less than half
// as long as the input; frames of another size in the middle; nothing to follow in the input), Interrupted.
ScoreResult Score(const ScoreOptions& options, ProgressSink& progress);

}  // namespace lumi::score
