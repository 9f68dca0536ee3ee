// Which frames of a video become photographs: far enough apart for parallax, and the sharpest of their neighbours.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/program/progress.h"

namespace lumi {

struct FrameStatistics {
  double time_s = 0;
  double sharpness = 0;  // variance of the Laplacian, grey values, at kAnalysisWidth
  double step = 0;       // median movement of tracked corners since the frame before, in image widths
  bool cut = false;      // hardly any corner could be followed: a cut, or a violent shake
};

struct VideoStatistics {
  std::vector<FrameStatistics> frames;
  int width_px = 0, height_px = 0;
  double fps = 0;
  bool truncated = false;
};

// Decodes the whole video once, small. Throws InputError when no frame can be read.
VideoStatistics AnalyseVideo(const std::filesystem::path& video, ProgressSink& sink);

struct KeyframeOptions {
  int count = 0;             // how many; 0: one for each `spacing` of movement
  double spacing = 0.06;     // image widths of movement between keyframes
  int usual_count = 240;     // the spacing grows to keep to it, up to ...
  double max_spacing = 0.2;  // ... this, at which neighbours still share most of what they show; then there are more
  int max_count = 1000;      // the spacing grows beyond max_spacing to keep to it
  double window = 0.35;      // a keyframe may lie this fraction of the spacing off its place to be sharper
};

// Positions in `frames`, ascending. The first and the last part of the movement are covered; fewer than two mean that
// the camera does not move.
std::vector<int> SelectKeyframes(const std::vector<FrameStatistics>& frames, const KeyframeOptions& options);

}  // namespace lumi
