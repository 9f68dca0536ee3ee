#include "timeperiodic/period_tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"
#include "timeperiodic/align.h"

namespace lumi {
namespace {

constexpr int kPeriodComponents = 48;
constexpr int kLeastWidth = 16, kLeastFrames = 16;
constexpr double kLeastShownPercent = 1e-5;  // where the logarithmic axis ends

struct PeriodSetting {
  std::string name, line;
  int width_px = 0, frames = 0;  // 0: all
};

struct PeriodRow {
  PeriodSetting setting;
  double seconds = 0;
  PeriodEstimate found;
  std::string failed;
  std::optional<double> held_out_db = {};
};

std::vector<PeriodSetting> SettingsOf(int width_px, int frames, int video_width_px) {
  std::vector<PeriodSetting> settings{
      {fmt::format("as given: {} px, {} frames", width_px, frames), "", width_px, frames}};
  for (const double factor : {0.25, 0.5, 2.0}) {
    const int width = std::min(video_width_px, static_cast<int>(std::lround(factor * width_px)));
    if (width >= kLeastWidth && width != width_px && width != settings.back().width_px)
      settings.push_back({fmt::format("{} px", width), "width", width, frames});
  }
  for (const int part : {8, 4, 2})
    if (frames / part >= kLeastFrames)
      settings.push_back({fmt::format("{} frames", frames / part), "frames", width_px, frames / part});
  PeriodSetting least = settings.front();
  for (const PeriodSetting& s : settings) {
    least.width_px = std::min(least.width_px, s.width_px);
    least.frames = std::min(least.frames, s.frames);
  }
  if (least.width_px < width_px && least.frames < frames)
    settings.push_back(
        {fmt::format("{} px, {} frames", least.width_px, least.frames), "several", least.width_px, least.frames});
  return settings;
}

}  // namespace

PeriodEstimate PeriodOfVideo(const FrameStack& stack, bool moving, const PeriodOptions& options,
                             ProgressSink& progress) {
  if (!moving) return EstimatePeriod(FixedSignals(stack, {}), {}, options);
  const Alignment alignment = AlignFrames(stack, {}, progress);
  return EstimatePeriod(MovingSignals(stack, alignment, {.components = kPeriodComponents}), alignment.camera, options);
}

TradeoffTable PeriodTradeoffTable() {
  using enum TradeoffRole;
  return {.columns = {{"name", kSetting, "setting", -20, "{}", "setting"},
                      {"line", kSetting},
                      {"settings.look_width", kSetting},
                      {"settings.frames", kSetting},
                      {"seconds", kCost, "seconds", 8, "{:.2f}"},
                      {"period_frames", kFigure, "period", 10, "{:.4f}"},
                      {"period_sigma_frames", kLessIsBetter, "+-", 8, "{:.4f}"},
                      {"error_percent", kLessIsBetter, "error %", 9, "{:.4f}"},
                      {"explained", kMoreIsBetter, "explained", 9, "{:.3f}"},
                      {"psnr_holdout_db", kMoreIsBetter, "held-out dB", 11, "{:.2f}"},
                      {"reference"},
                      {"front"},
                      {"failed", kFailed}},
          .starred = "front"};
}

TradeoffTable MeasurePeriodTradeoff(const PeriodTradeoffOptions& options, const HeldOutByPeriod& held_out,
                                    ProgressSink& progress) {
  std::vector<PeriodSetting> settings{{"", "", options.width_px, 0}};
  std::vector<PeriodRow> rows;
  Progress steps(progress, "measuring the period", 8);
  for (std::size_t i = 0; i < settings.size(); ++i) {
    CheckInterrupted();
    PeriodRow row{.setting = settings[i], .found = {}, .failed = {}};
    const auto start = std::chrono::steady_clock::now();
    try {
      FrameStackOptions reading;
      reading.max_width_px = row.setting.width_px;
      reading.first_frames = row.setting.frames;
      const FrameStack stack = ReadFrameStack(options.video, reading, SilentProgress());
      if (i == 0) settings = SettingsOf(stack.width, stack.count(), stack.video_width);
      row.setting = settings[i];
      row.found = PeriodOfVideo(stack, options.moving, options.period, SilentProgress());
    } catch (const DataError& e) {
      row.failed = e.what();
    }
    row.seconds = SecondsSince(start);
    if (held_out && row.failed.empty()) row.held_out_db = held_out(row.found.period_frames);
    rows.push_back(std::move(row));
    steps.Step();
  }
  const PeriodRow* reference = nullptr;
  const auto pixels = [](const PeriodRow& r) {
    return 1.0 * r.setting.width_px * r.setting.width_px * r.setting.frames;
  };
  if (!options.true_period_frames)
    for (const PeriodRow& row : rows)
      if (row.failed.empty() && (reference == nullptr || pixels(row) > pixels(*reference))) reference = &row;
  const double truth = options.true_period_frames.value_or(reference != nullptr ? reference->found.period_frames
                                                                                : CostAndQuality::kNone);

  TradeoffTable table = PeriodTradeoffTable();
  for (const PeriodRow& row : rows) {
    const double error =
        &row == reference ? CostAndQuality::kNone : 100 * std::abs(row.found.period_frames / truth - 1);
    table.Add({row.setting.name, row.setting.line, row.setting.width_px, row.setting.frames, row.seconds,
               row.found.period_frames, row.found.sigma_frames, error, row.found.explained, row.held_out_db,
               &row == reference, false, row.failed});
  }
  table.MarkFront("seconds", "error_percent");
  table.facts = {{"video", options.video.string()},
                 {"reference", reference != nullptr ? reference->setting.name : "the known period"},
                 {"reference_period_frames", truth}};
  return table;
}

TradeoffFiles WritePeriodTradeoff(const std::filesystem::path& folder, const TradeoffTable& table) {
  TradeoffPanel panel;
  panel.title = "Period", panel.subtitle = "against the reference";
  panel.x = "seconds", panel.x_axis = {"seconds", true};
  panel.y = "error_percent", panel.y_axis = {"error, %", true};
  panel.series = {{"", "as given", "#24292f", Marker::kDiamond},
                  {"width", "", "#1f6feb"},
                  {"frames", "", "#15803d", Marker::kSquare},
                  {"several", "", "#9333ea"}};
  panel.by = "line";
  panel.front = table.Front("seconds", "error_percent");
  panel.least = kLeastShownPercent;
  std::vector<Plot> plots{PlotOf(table, panel)};
  panel.title = "Held-out photos", panel.subtitle = "of the scene, rendered with each setting's period";
  panel.y = "psnr_holdout_db", panel.y_axis = PlotAxis();
  panel.y_axis.label = "PSNR, dB";
  panel.front.clear();
  if (const Plot plot = PlotOf(table, panel); !plot.series.empty()) plots.push_back(plot);
  return WriteTradeoff(folder / "period", table, plots);
}

}  // namespace lumi
