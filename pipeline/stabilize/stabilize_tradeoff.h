// What the dials of a stabilised video cost and give, on its first window: frames that a picture may use, photos that a pixel blends,
// rounds of the path, size of the pictures; against stability, jitter and seconds.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/stabilize/stabilize_video.h"

namespace lumi {

struct StabilizeTradeoffPoint {
  std::string dial, value;               // "k", "4"; "as chosen"
  double path_seconds = 0, render_seconds = 0, ms_per_frame = 0;
  double kept_scale = 1, stability = 0, distortion = 0, jitter_px = 0;
};

struct StabilizeTradeoff {
  int frames = 0;                        // of the window that it was measured on
  std::vector<StabilizeTradeoffPoint> points;
  std::filesystem::path json, plot;
};

// `window`: a window's folder with its scene/ and frames/. One dial at a time, the others as chosen. Writes folder / tradeoff.json and
// .svg.
StabilizeTradeoff MeasureStabilizeTradeoff(const std::filesystem::path& window, const std::filesystem::path& folder, const StabilizeVideoOptions& options, double fps,
                                           ProgressSink& progress);

std::string TableOf(const StabilizeTradeoff& tradeoff);

}  // namespace lumi
