// SCENE/report.html and report.json: what came out, how good it is, what is missing and why, what to do next. One file
// that needs no network.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/sibling_stage.h"
#include "pipeline/sibling_summaries.h"

namespace lumi {

struct ReportInput {
  std::filesystem::path scene_folder;
  std::filesystem::path source;     // what the pipeline was given
  std::vector<StageResult> stages;  // those before the report
  double colmap_seconds = 0, around_colmap_seconds = 0;
  std::filesystem::path holdout_folder;  // where lumi-render wrote its held-out renders; empty: none
  std::filesystem::path video;           // empty: none
  std::filesystem::path web;             // the page to walk in; empty: none
};

struct ReportFiles {
  std::filesystem::path html, json, contact_sheet;  // contact sheet: empty where no picture could be shown
};

// How a fly-through's frames were made and what one took, in a line; empty where nothing is known.
std::string DescribeFrames(const sibling::FramesSummary& frames);

// Throws MachineError where the files cannot be written.
ReportFiles WriteReport(const ReportInput& input, ProgressSink& progress);

}  // namespace lumi
