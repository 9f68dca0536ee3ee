// `lumi-render tradeoff`: measures a table of settings for error and time, finds the Pareto front, recommends settings
// for 8, 16, 33 and 100 ms and for no limit, and keeps the front in the scene. docs/tradeoff.md.
#pragma once

#include <string>

#include "render/tradeoff/workbench.h"

namespace lumi {

// Writes OUT/tradeoff.csv, .json, .svg and figure-5-4.svg, and SCENE/fronts where the scene is ours. All at the end: an
// interrupted run leaves nothing. Returns the JSON text of tradeoff.json.
std::string RunTradeoff(const MeasureOptions& options, ProgressSink& progress);
std::string DescribeTradeoff(const std::string& json);

// `lumi-render tradeoff --ablation`: the rows of Fig. 5-3 for one view: pictures, false colours, differences from the
// first row, ablation.csv, .json and index.html in OUT.
std::string RunAblation(const MeasureOptions& options, ProgressSink& progress);
std::string DescribeAblation(const std::string& json);

// `lumi-render tradeoff --time-windows`: widths of the time window against what they cost: temporal blur, spatial
// error, photos in the window, held-out error and milliseconds (thesis sec. 7.2); time-windows.csv, .json and .svg in
// OUT.
std::string RunTimeWindows(const MeasureOptions& options, ProgressSink& progress);
std::string DescribeTimeWindows(const std::string& json);

}  // namespace lumi
