// What each command of lumi-timeperiodic answers: a struct, its keys in JSON (ListKeys), its text for people
// (Describe).
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "scene/files/json_keys.h"
#include "scene/tradeoff/table.h"
#include "timeperiodic/period.h"
#include "timeperiodic/sampling.h"

namespace lumi {

struct PeriodTradeoff {
  TradeoffTable table;
  TradeoffFiles files;
};

struct PeriodSummary {
  PeriodEstimate estimate;
  double fps = 0;
  int frames = 0;
  double samples_per_window = 0;  // of one frame
  double seconds = 0;
  std::optional<PeriodTradeoff> tradeoff;  // none: not asked for
};

struct MasksFigures {
  bool found = false;  // else they were given
  std::optional<double> moving_share;
  std::optional<int> corners, aligned_frames;
};

struct CalibratedVideo {
  PeriodSummary period;
  std::string period_from;  // "given", "fixed video", "moving video"
  std::filesystem::path scene;
  MasksFigures masks;
  bool reused = false;
  std::optional<JsonKeys>
      reconstruct;  // lumi-reconstruct's own; this and the next two: none where it ended with the masks
  std::optional<int> images_registered;
  std::optional<SamplingReport> sampling;
};

struct SceneSampling {
  SamplingReport report;
  double period_frames = 0, period_s = 0, fps = 0;
};

void ListKeys(JsonKeys& j, PeriodSummary& s);
void ListKeys(JsonKeys& j, CalibratedVideo& s);
void ListKeys(JsonKeys& j, SceneSampling& s);

std::string Describe(const PeriodSummary& s);
std::string Describe(const CalibratedVideo& s);
std::string Describe(const SceneSampling& s);

}  // namespace lumi
