// What the whole way from photos to a lumigraph costs: the pipeline run at each of its qualities, its minutes against
// the error of left-out photos, and which stage takes most of them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/options.h"
#include "scene/files/json_keys.h"
#include "scene/program/progress.h"
#include "scene/tradeoff/table.h"

namespace lumi {

struct PipelinePrice {
  TradeoffTable table;               // a row a quality, cheapest first
  TradeoffFiles files = {};          // OUT/tradeoff/pipeline.json, .csv, .svg
  std::string recommended = {};      // the best by the table, within `minutes` where they were given
  std::filesystem::path scene = {};  // that quality's: OUT/NAME
  bool fits = true;                  // within them
};
void ListKeys(JsonKeys& j, PipelinePrice& price);
std::string Describe(const PipelinePrice& price);

// Runs every quality into options.output/NAME, as RunPipeline would (a second run goes on), or, with options.minutes,
// the cheapest first until one takes longer. A quality that failed is a row with its reason; throws where all fail.
PipelinePrice RunPipelinePrice(const PipelineOptions& options, ProgressSink& progress);

}  // namespace lumi
