// The depth maps of a scene's proxy as parts at the same time, so that the program that makes the proxy finds them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/executor/executor.h"
#include "pipeline/sibling_stage.h"
#include "scene/program/progress.h"

namespace lumi {

struct DepthMapParts {
  std::filesystem::path scene;
  std::vector<std::string> proxy;   // lumi-proxy's arguments for the proxy itself
  std::vector<std::string> common;  // and those that do not decide what the maps are, but for the seed
  int parts = 2;
};

// Each part goes as far as it can without the others' maps, again and again until all are there. What it was made from
// is recorded (provenance/depth-map-parts.json): given again it is reused.
StageResult MakeDepthMapsInParts(const DepthMapParts& wanted, Executor& executor, ProgressSink& progress);

}  // namespace lumi
