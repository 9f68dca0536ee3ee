// The program's commands: what they take.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "scene/program/progress.h"
#include "timeperiodic/period.h"
#include "timeperiodic/summaries.h"

namespace lumi {

struct PeriodCommandOptions {
  std::filesystem::path video;
  bool moving = false;      // the camera moves: the still background is aligned first
  std::vector<int> frames;  // two that look alike, with `count` periods between them; empty: found
  int count = 0;
  PeriodOptions period;
  int width_px = 192;              // of the frames that are looked at
  std::filesystem::path plot;      // SVG; empty: none
  std::filesystem::path tradeoff;  // a folder for the table of width and frames against error and seconds; empty: none
  std::optional<double> true_period_frames;  // which its errors are against
};

PeriodSummary RunPeriod(const PeriodCommandOptions& options, ProgressSink& progress);

}  // namespace lumi
