// What lumi-stabilize SCENE -o PATH.json takes and answers.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/program/progress.h"
#include "stabilize/stabilize.h"

namespace lumi {

struct StabilizeCommandOptions {
  std::filesystem::path scene, output;
  std::filesystem::path before;  // PATH.json of the window before this one
  std::filesystem::path plot;    // SVG of the tracks; empty: none
  StabilizeOptions stabilize;
};

struct StabilizeSummary {
  std::filesystem::path path;  // that was written
  StabilizeReport report;
  bool cropped = false;            // to report.view_scale
  std::vector<std::string> shown;  // names of the first and the last frame that belong to this path
  double seconds = 0;
};
void ListKeys(JsonKeys& j, StabilizeSummary& summary);
std::string Describe(const StabilizeSummary& summary);

StabilizeSummary RunStabilize(const StabilizeCommandOptions& options, ProgressSink& progress);

}  // namespace lumi
