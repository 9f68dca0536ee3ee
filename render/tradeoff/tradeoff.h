// `lumi-render tradeoff`: measures a table of settings for error and time, finds the Pareto front, recommends settings
// for 8, 16, 33 and 100 ms and for no limit, and keeps the front in the scene. docs/tradeoff.md.
#pragma once

#include "render/tradeoff/workbench.h"
#include "scene/program/answer.h"

namespace lumi {

// Writes OUT/tradeoff.csv, .json, .svg and figure-5-4.svg, and SCENE/fronts where the scene is ours. All at the end: an
// interrupted run leaves nothing.
Answer RunTradeoff(const MeasureOptions& options, ProgressSink& progress);

// `lumi-render tradeoff --ablation`: the rows of Fig. 5-3 for one view: pictures, false colours, differences from the
// first row, ablation.csv, .json and index.html in OUT.
Answer RunAblation(const MeasureOptions& options, ProgressSink& progress);

// `lumi-render tradeoff --time-windows`: widths of the time window against what they cost: temporal blur, spatial
// error, photos in the window, held-out error and milliseconds (thesis sec. 7.2); time-windows.csv, .json and .svg in
// OUT.
Answer RunTimeWindows(const MeasureOptions& options, ProgressSink& progress);

// `lumi-render properties`: a figure for each of the nine properties that Table 3.2 asks of an image-based rendering
// algorithm; properties.json in OUT where OUT is given.
Answer RunProperties(const MeasureOptions& options, ProgressSink& progress);

}  // namespace lumi
