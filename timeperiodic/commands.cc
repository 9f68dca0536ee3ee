#include "timeperiodic/commands.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/tradeoff/json_rows.h"
#include "timeperiodic/frame_stack.h"
#include "timeperiodic/period_plot.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

std::string PeriodJson(const PeriodEstimate& e, double fps, int frames) {
  Json j;
  j["period_frames"] = e.period_frames;
  j["period_sigma_frames"] = e.sigma_frames;
  j["period_s"] = e.period_frames / fps;
  j["fps"] = fps;
  j["frames"] = frames;
  j["cycles"] = e.cycles;
  j["samples_per_window"] = frames / e.period_frames;
  j["explained"] = e.explained;
  j["harmonics"] = e.harmonics;
  j["harmonics_considered"] = Json::array();
  for (const PeriodCandidate& c : e.candidates)
    j["harmonics_considered"].push_back(
        {{"period_frames", c.period_frames}, {"relation", c.relation}, {"explained", c.explained}, {"harmonics", c.harmonics}});
  j["ambiguous"] = e.ambiguous;
  j["drift_percent"] = e.drift_percent;
  j["drift_sigma_percent"] = e.drift_sigma_percent;
  j["drifts"] = e.drifts;
  j["aliases_frames"] = e.aliases_frames;
  j["camera_share"] = e.camera_share;
  j["few_cycles"] = e.few_cycles;
  j["slips"] = Json::array();
  for (const Slip& s : e.slips) j["slips"].push_back({{"frame", s.frame}, {"frames", s.frames}});
  j["warnings"] = e.warnings;
  return j.dump();
}

std::string RunPeriod(const PeriodCommandOptions& o, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  if (!o.frames.empty() && o.frames.size() != 2) throw UsageError("--frames takes two frame numbers");
  if (o.frames.empty() != (o.count == 0)) throw UsageError("--frames A B and --count N go together");
  if (!o.frames.empty() && !o.tradeoff.empty()) throw UsageError("--tradeoff measures a search: it does not go with --frames");
  if (o.true_period_frames && o.tradeoff.empty()) throw UsageError("--true-period goes with --tradeoff");
  FrameStackOptions reading;
  reading.max_width_px = o.width_px;
  const FrameStack stack = ReadFrameStack(o.video, reading, progress);
  PeriodEstimate e;
  if (!o.frames.empty()) {
    for (const int f : o.frames)
      if (f < 0 || f >= stack.count())
        throw UsageError(fmt::format("--frames: there is no frame {}, the video has {} (0 to {})", f, stack.count(), stack.count() - 1));
    e = CountedPeriod(o.frames[0], o.frames[1], o.count);
  } else {
    e = PeriodOfVideo(stack, o.moving, o.period, progress);
  }
  for (const std::string& w : e.warnings) progress.Message(w);
  if (!o.plot.empty()) WriteTextAtomically(o.plot, PeriodPlot(e));
  Json j = Json::parse(PeriodJson(e, stack.fps, stack.count()));
  if (!o.tradeoff.empty()) {
    const TradeoffTable table =
        MeasurePeriodTradeoff({o.video, o.moving, o.period, o.width_px, o.true_period_frames}, {}, progress);
    j.update(Json::parse(PeriodTradeoffJson(table, WritePeriodTradeoff(o.tradeoff, table))));
  }
  j["seconds"] = SecondsSince(start);
  return j.dump();
}

std::string DescribePeriod(const std::string& text) {
  const auto j = Json::parse(text);
  return fmt::format("period {:.6g} frames +- {:.2g} ({:.5g} s), {:.1f} of them in {} frames: {:.3g} samples in a window of one frame",
                     j["period_frames"].get<double>(), j["period_sigma_frames"].get<double>(), j["period_s"].get<double>(),
                     j["cycles"].get<double>(), j["frames"].get<int>(), j["samples_per_window"].get<double>()) +
         DescribePeriodTradeoff(text);
}

std::string PeriodTradeoffJson(const TradeoffTable& table, const TradeoffFiles& files) {
  const Json j{{"tradeoff", Json::parse(JsonTextOf(table))},
               {"tradeoff_json", files.json.string()},
               {"tradeoff_csv", files.csv.string()},
               {"tradeoff_svg", files.svg.string()}};
  return j.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string DescribePeriodTradeoff(const std::string& text) {
  const auto j = Json::parse(text);
  if (!j.contains("tradeoff")) return {};
  TradeoffTable table = PeriodTradeoffTable();
  AddRows(j["tradeoff"]["points"], table);
  return "\n\n" + TextOf(table) + "\n* no other setting is both faster and nearer; errors against " +
         j["tradeoff"]["reference"].get<std::string>() + "\n" + j["tradeoff_json"].get<std::string>() + ", .csv, .svg";
}

}  // namespace lumi
