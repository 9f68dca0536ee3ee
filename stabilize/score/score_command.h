// `lumi-stabilize score`: what it takes, its keys in JSON, its table, its plot.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/json_keys.h"
#include "stabilize/score/score.h"

namespace lumi::score {

struct ScoreCommandOptions {
  ScoreOptions score;
  std::filesystem::path plot;  // SVG of paths and spectra; empty: none
};

// A figure that cannot be said is null.
ScoreResult RunScore(const ScoreCommandOptions& options, ProgressSink& progress);
void ListKeys(JsonKeys& j, ScoreResult& result);
std::string Describe(const ScoreResult& result);   // a table
std::string ScorePlot(const ScoreResult& result);  // SVG

}  // namespace lumi::score
