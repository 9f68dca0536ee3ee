// The program's commands: what they take, and their JSON.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/program/progress.h"
#include "timeperiodic/period.h"

namespace lumi {

struct PeriodCommandOptions {
  std::filesystem::path video;
  bool moving = false;      // the camera moves: the still background is aligned first
  std::vector<int> frames;  // two that look alike, with `count` periods between them; empty: found
  int count = 0;
  PeriodOptions period;
  int width_px = 192;          // of the frames that are looked at
  std::filesystem::path plot;  // SVG; empty: none
};

// JSON text: period_frames, period_sigma_frames, harmonics_considered, samples_per_window ...
std::string RunPeriod(const PeriodCommandOptions& options, ProgressSink& progress);

std::string PeriodJson(const PeriodEstimate& estimate, double fps, int frames);
std::string DescribePeriod(const std::string& json);

}  // namespace lumi
