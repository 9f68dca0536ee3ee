// What lumi-stabilize SCENE -o PATH.json takes and answers.
#pragma once

#include <filesystem>
#include <string>

#include "scene/program/progress.h"
#include "stabilize/stabilize.h"

namespace lumi {

struct StabilizeCommandOptions {
  std::filesystem::path scene, output;
  std::filesystem::path before;   // PATH.json of the window before this one
  std::filesystem::path plot;     // SVG of the tracks; empty: none
  StabilizeOptions stabilize;
};

// JSON text: model, frames, view_scale, shake_before_px, shake_after_px ...
std::string RunStabilize(const StabilizeCommandOptions& options, ProgressSink& progress);
std::string DescribeStabilize(const std::string& json);

}  // namespace lumi
