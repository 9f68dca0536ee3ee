// The whole way from photographs to a lumigraph with its report: each stage a sibling program, which writes its own
// provenance, so that a second run redoes only what changed and a run that was killed goes on.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/options.h"
#include "pipeline/sibling_stage.h"

namespace lumi {

// What a run made of the minutes that it was given.
struct KeptMinutes {
  double asked = 0;
  double took = 0;      // all stages, each in the run that did its work
  std::string quality;  // of qualities.h
  double expected_camera_minutes = 0;
  std::vector<std::string> left_out;  // stages for which no time was left
  bool met = true;
};

struct PipelineSummary {
  std::filesystem::path scene, report, video, web, contact_sheet;  // the last three: empty where not made
  std::vector<StageResult> stages;
  double colmap_seconds = 0;  // COLMAP's own part of reconstruct
  // Preparation, proxy and report: all that is needed for a lumigraph beside COLMAP. Evaluation and video are extras.
  double around_colmap_seconds = 0;
  double seconds = 0;  // this run
  std::optional<KeptMinutes> minutes;
};

// Throws lumi::Error: UsageError for options or paths that do not fit, else what the failing stage said.
PipelineSummary RunPipeline(const PipelineOptions& options, ProgressSink& progress);

// The summary as --json has it, and as a person reads it.
void ListKeys(JsonKeys& j, PipelineSummary& summary);
std::string Describe(const PipelineSummary& summary);
// The stages' own commands, one a line: run one after the other they make the same scene. A comment stands for what no
// program of its own does: the report, and the import of a workspace.
std::string DescribeCommands(const PipelineSummary& summary);

}  // namespace lumi
