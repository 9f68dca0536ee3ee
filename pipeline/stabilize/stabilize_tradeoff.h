// What the dials of a stabilised video cost and give, on its first window: frames that a picture may use, photos that a
// pixel blends, rounds of the path, size of the pictures; against stability, jitter and seconds.
#pragma once

#include <filesystem>

#include "pipeline/stabilize/stabilize_video.h"
#include "scene/tradeoff/table.h"

namespace lumi {

struct StabilizeTradeoff {
  TradeoffTable table;
  TradeoffFiles files;
};

// `window`: a window's folder with its scene/ and frames/. One dial at a time, the others as chosen. Writes folder /
// tradeoff.json, .csv and .svg.
StabilizeTradeoff MeasureStabilizeTradeoff(const std::filesystem::path& window, const std::filesystem::path& folder,
                                           const StabilizeVideoOptions& options, double fps, ProgressSink& progress);

}  // namespace lumi
