// What a video's period costs: the width its frames are looked at in, and how many there are, against the period's
// error, its own standard deviation and seconds.
//
//   PeriodTradeoffOptions options{.video = "fixed.mp4"};
//   const TradeoffTable table = MeasurePeriodTradeoff(options, {}, progress);
//   WritePeriodTradeoff(folder, table);
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "scene/program/progress.h"
#include "scene/tradeoff/table.h"
#include "timeperiodic/frame_stack.h"
#include "timeperiodic/period.h"

namespace lumi {

// Of a video from a tripod, or of one whose camera moves. Throws DataError where nothing repeats.
PeriodEstimate PeriodOfVideo(const FrameStack& stack, bool moving, const PeriodOptions& options,
                             ProgressSink& progress);

struct PeriodTradeoffOptions {
  std::filesystem::path video;
  bool moving = false;
  PeriodOptions period = {};
  int width_px = 192;  // as given
  std::optional<double> true_period_frames =
      {};  // what errors are against; none: the row of the most pixels that found a period
};
// dB of held-out photos where the scene had this period; none: not known.
using HeldOutByPeriod = std::function<std::optional<double>(double period_frames)>;

// Without rows.
TradeoffTable PeriodTradeoffTable();
// As given first, then a quarter, half and twice of the width, an eighth, a quarter and half of the frames (the first
// ones), and the least of both. A row that finds no period says why. `held_out` may be empty.
TradeoffTable MeasurePeriodTradeoff(const PeriodTradeoffOptions& options, const HeldOutByPeriod& held_out,
                                    ProgressSink& progress);
// FOLDER/period.json, .csv and .svg.
TradeoffFiles WritePeriodTradeoff(const std::filesystem::path& folder, const TradeoffTable& table);

}  // namespace lumi
