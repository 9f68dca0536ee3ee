// `lumi-stabilize score`: what it takes, its JSON, its table, its plot.
#pragma once

#include <filesystem>
#include <string>

#include "stabilize/score/score.h"

namespace lumi::score {

struct ScoreCommandOptions {
  ScoreOptions score;
  std::filesystem::path plot;  // SVG of paths and spectra; empty: none
};

// JSON text: videos[{file, cropping_ratio, distortion, stability, jitter_px, ...}], frames, warnings; null where a figure
// cannot be said.
std::string RunScore(const ScoreCommandOptions& options, ProgressSink& progress);
std::string ScoreJson(const ScoreResult& result);
std::string DescribeScore(const std::string& json);  // a table
std::string ScorePlot(const ScoreResult& result);    // SVG

}  // namespace lumi::score
