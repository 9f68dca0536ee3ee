// A moving video of a scene that repeats itself, placed in space and time (thesis, section 7.2.1): period, masks of
// what moves, cameras of all frames by lumi-reconstruct (a program of its own), times and period in the scene, and a
// report on how space and time are covered.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/program/progress.h"
#include "timeperiodic/period.h"
#include "timeperiodic/summaries.h"

namespace lumi {

struct CalibrateVideoOptions {
  std::filesystem::path video;
  std::filesystem::path scene;          // to be written
  std::filesystem::path fixed_video;    // of the same scene from a tripod: its period is taken; empty: none
  std::optional<double> period_frames;  // of `video`; neither: from the moving video itself
  std::filesystem::path masks;          // COLMAP's, frame_000000.jpg.png ...; empty: found
  bool tradeoff = false;                // also what a period costs, and what it brings; SCENE/tradeoff/period.*
  bool masks_only = false;              // stop when the masks are written, to be looked at and edited
  std::vector<std::string> reconstruct_arguments;  // passed on to lumi-reconstruct
  PeriodOptions period;
  int width_px = 192;             // of the frames that are looked at
  double max_moving_share = 0.8;  // of the picture; more: too little background
  int threads = 0;
  std::uint64_t seed = 0;
};
std::optional<std::string> Validate(const CalibrateVideoOptions& options);

// Writes SCENE and, in SCENE/timeperiodic/: masks/, period.svg, sampling.svg, summary.json. Throws DataError:
// nothing repeats; too little that stands still; what lumi-reconstruct refuses.
CalibratedVideo CalibrateVideo(const CalibrateVideoOptions& options, ProgressSink& progress);

// The sampling of a scene that has times and a period; plot: SVG to write, or empty. Throws DataError where it has not.
SceneSampling ReportSceneSampling(const std::filesystem::path& scene, const std::filesystem::path& plot,
                                  ProgressSink& progress);

}  // namespace lumi
