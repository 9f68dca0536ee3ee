#include "timeperiodic/period_plot.h"

#include <fmt/format.h>

#include "scene/plot/plot.h"

namespace lumi {

std::string PeriodPlot(const PeriodEstimate& e) {
  Plot similarity{
      "Self-similarity", "correlation of the video with itself, shifted", {"shift, frames"}, {"correlation"}, {}, {}};
  PlotSeries curve{"", "#1f6feb", Marker::kNone, true, false, false, {}};
  for (const auto& [shift, rho] : e.similarity) curve.points.push_back({shift, rho, "", ""});
  similarity.series = {curve};
  for (int k = 1; k <= 4; ++k)
    similarity.marks.push_back(
        {k * e.period_frames, k == 1 ? fmt::format("T = {:.5g}", e.period_frames) : fmt::format("{} T", k)});

  Plot periodogram{"Periods",
                   "what four harmonics of a period explain",
                   {"period, frames", true},
                   {"share of the variance", false, true},
                   {},
                   {}};
  PlotSeries power{"", "#8250df", Marker::kNone, true, false, false, {}};
  for (const auto& [period, share] : e.periodogram) power.points.push_back({period, share, "", ""});
  PlotSeries considered{
      "considered: share predicted in unseen cycles", "#d1242f", Marker::kDiamond, false, false, false, {}};
  for (const PeriodCandidate& c : e.candidates)
    considered.points.push_back({c.period_frames, std::max(0.0, c.explained), c.relation,
                                 fmt::format("{:.6g} frames: {:.3f}", c.period_frames, c.explained)});
  periodogram.series = {power, considered};
  return SvgOf({similarity, periodogram});
}

}  // namespace lumi
