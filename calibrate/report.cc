#include "calibrate/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

constexpr double kDrawingWidthPx = 560;

// Light to dark blue.
std::string Shade(double share) {
  const double t = std::clamp(share, 0.0, 1.0);
  return fmt::format("rgb({:.0f},{:.0f},{:.0f})", 240 - 215 * t, 245 - 175 * t, 250 - 110 * t);
}

std::string SvgOpen(double width, double height, const std::string& title) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:.0f} {1:.0f}' width='{0:.0f}' height='{1:.0f}' "
      "role='img'><title>{2}</title>\n",
      width, height, Escaped(title));
}

std::string UncertaintySvg(const CalibrateSummary& summary) {
  const UncertaintyMap& map = summary.uncertainty;
  const double height = kDrawingWidthPx * summary.gathered.height_px / summary.gathered.width_px;
  const double w = kDrawingWidthPx / map.columns, h = height / map.rows;
  // A few cells at the edge of what the polynomial can hold would leave no shades for the rest.
  const double darkest = std::min(map.largest_px, 4 * map.median_px);
  std::string svg = SvgOpen(kDrawingWidthPx, height, "Standard deviation of the projection in pixels") +
                    "<g shape-rendering='crispEdges'>\n";
  for (int r = 0; r < map.rows; ++r)
    for (int c = 0; c < map.columns; ++c) {
      const double sigma = map.sigma_px[static_cast<std::size_t>(r * map.columns + c)];
      svg +=
          fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='{}'><title>{}</title></rect>\n",
                      c * w, r * h, w + 0.3, h + 0.3, std::isfinite(sigma) ? Shade(sigma / darkest) : "#c33",
                      std::isfinite(sigma) ? fmt::format("{:.3f} px", sigma) : "no inverse");
    }
  svg += "</g>\n";
  for (int r = 1; r < map.rows; r += 4)
    for (int c = 1; c < map.columns; c += 5) {
      const double sigma = map.sigma_px[static_cast<std::size_t>(r * map.columns + c)];
      if (std::isfinite(sigma))
        svg += fmt::format("<text x='{:.1f}' y='{:.1f}' font-size='12' text-anchor='middle' fill='{}'>{:.2f}</text>\n",
                           (c + 0.5) * w, (r + 0.5) * h + 4, sigma > 0.55 * darkest ? "#fff" : "#111", sigma);
    }
  return svg + "</svg>";
}

std::string CoverageSvg(const CalibrateSummary& summary) {
  const double s = kDrawingWidthPx / summary.gathered.width_px, height = s * summary.gathered.height_px;
  std::string svg = SvgOpen(kDrawingWidthPx, height, "Corners of all views");
  svg += fmt::format("<rect width='{:.0f}' height='{:.0f}' fill='#f4f6f8' stroke='#888'/>\n", kDrawingWidthPx, height);
  for (std::size_t v = 0; v < summary.fit.views.size(); ++v) {
    const BoardView& view = summary.fit.views[v];
    svg += fmt::format("<g fill='hsl({:.0f},70%,40%)'><title>{}</title>",
                       std::fmod(137.5 * static_cast<double>(v), 360), Escaped(view.name));
    for (std::size_t i = 0; i < view.corners_px.size(); ++i)
      svg += view.Used(i) ? fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2'/>", s * view.corners_px[i].x(),
                                        s * view.corners_px[i].y())
                          : fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='4' fill='none' stroke='#c33'/>",
                                        s * view.corners_px[i].x(), s * view.corners_px[i].y());
    svg += "</g>\n";
  }
  return svg + "</svg>";
}

std::string Row(const std::vector<std::string>& cells, const char* tag = "td", const char* attributes = "") {
  std::string row = fmt::format("<tr{}>", attributes);
  for (const std::string& cell : cells) row += fmt::format("<{0}>{1}</{0}>", tag, Escaped(cell));
  return row + "</tr>\n";
}

}  // namespace

TradeoffTable ViewCountTable(const std::vector<ViewCountTrial>& trials) {
  using enum TradeoffRole;
  TradeoffTable table{.columns = {{"views", kSetting, "views", 7},
                                  {"subsets"},
                                  {"held_out_rms_px", kLessIsBetter, "held-out px", 12, "{:.4f}"},
                                  {"sigma_fx_percent", kLessIsBetter, "sigma fx %", 12, "{:.4f}"},
                                  {"spread_fx_percent", kLessIsBetter, "spread fx %", 13, "{:.4f}"},
                                  {"seconds", kCost, "seconds", 9, "{:.3f}"}},
                      .rows_key = "views"};
  for (const ViewCountTrial& t : trials)
    table.Add({t.views, t.subsets, t.held_out_rms_px, t.sigma_f_percent, t.spread_f_percent, t.seconds});
  return table;
}

TradeoffTable ModelTable(const FitResult& fit) {
  using enum TradeoffRole;
  TradeoffTable table{.columns = {{"name", kSetting, "model", -16},
                                  {"terms", kSetting, "terms", 5},
                                  {"rms_px", kFigure, "RMS px", 8, "{:.4f}"},
                                  {"cross_validated_rms_px", kLessIsBetter, "cross-validated px", 20, "{:.4f}"},
                                  {"fx", kFigure, "fx", 9, "{:.2f}"},
                                  {"sigma_fx", kFigure, "sigma", 7, "{:.2f}"},
                                  {"as_good", kFigure, "as good", 9},
                                  {"seconds", kCost, "seconds", 9, "{:.3f}"},
                                  {"why_not", kRemark},
                                  {"chosen"}},
                      .rows_key = "models",
                      .starred = "chosen"};
  for (const ModelTrial& t : fit.trials)
    table.Add({t.model.name, t.model.FreeCount(), t.rms_px, t.cross_validated_rms_px, t.fx_px, t.sigma_fx_px, t.as_good,
               t.seconds, t.why_not, t.model.name == fit.calibration.model.name});
  return table;
}

std::vector<Plot> ViewCountPlots(const TradeoffTable& table) {
  const PlotAxis views{"views", false, true};
  return {PlotOf(table, {"Error on views left out",
                         "",
                         "views",
                         views,
                         "held_out_rms_px",
                         {"rms, px", true},
                         {{"", "held out", "#1b5e9b", Marker::kCircle, true}}}),
          PlotOf(table, {"Focal length fx",
                         "",
                         "views",
                         views,
                         "sigma_fx_percent",
                         {"percent", true},
                         {{"", "sigma", "#1b5e9b", Marker::kCircle, true},
                          {"", "spread of subsets", "#c46a12", Marker::kCircle, true, "spread_fx_percent"}}})};
}

std::string ReportHtml(const CalibrateOptions& options, const CalibrateSummary& summary) {
  const Calibration& c = summary.fit.calibration;
  const FitResult& fit = summary.fit;
  const auto optional = [](const std::optional<double>& x) { return x ? fmt::format("{:.4f}", *x) : std::string("-"); };
  std::string h = fmt::format(
      "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><meta name='generator' "
      "content='{}'><title>Calibration</title>\n<style>"
      "body{{font:15px/1.5 system-ui,sans-serif;max-width:1180px;margin:2em auto;padding:0 "
      "1em;color:#1c2127;background:#fff}}"
      "table{{border-collapse:collapse;margin:.6em 0}}td,th{{padding:.15em .8em;text-align:right;border-bottom:1px "
      "solid #ddd;font-variant-numeric:tabular-nums}}"
      "td:first-child,th:first-child,td.t{{text-align:left}}tr.chosen{{background:#e4eef7;font-weight:600}}figure{{"
      "display:inline-block;margin:0 1.2em 1em 0}}"
      "figcaption{{max-width:560px;color:#555}}code{{overflow-wrap:anywhere}}svg{{max-width:100%;height:auto}}</"
      "style></head><body>\n",
      kReportMark);
  h += fmt::format(
      "<h1>Calibration</h1><p>{} views of a {} board, {}x{} pixels. RMS {:.4f} px; cross-validated {} px. Model {}: "
      "{}.</p>\n",
      fit.views.size(), Escaped(options.board), summary.gathered.width_px, summary.gathered.height_px, c.rms_px,
      optional(fit.cross_validated_rms_px), c.model.name, Escaped(fit.choice));
  h += "<table>" + Row({"", "value", "standard deviation"}, "th");
  const auto term = [&](const char* name, double value, double sigma) {
    h += Row({name, fmt::format("{:.6g}", value), sigma > 0 ? fmt::format("{:.2g}", sigma) : "held"});
  };
  const PixelTerms pixels = c.Pixels(), sigma = fit.PixelSigmas();
  term("fx, px", pixels.fx, sigma.fx);
  term("fy, px", pixels.fy, sigma.fy);
  term("cx, px", pixels.cx, sigma.cx);
  term("cy, px", pixels.cy, sigma.cy);
  const std::vector<std::pair<const char*, Term>> terms = {{"skew, px", kSkew}, {"k1", kK1}, {"k2", kK2},
                                                           {"p1", kP1},         {"p2", kP2}, {"k3", kK3}};
  for (const auto& [name, t] : terms) term(name, c.intrinsics[t], c.Sigma(t, c.noise_px));
  h += "</table><p>Pixels with the first one's centre at (0.5, 0.5); camera.yaml has it at (0, 0), as OpenCV.</p>\n";
  if (const auto colmap = ColmapCameraOf(c.intrinsics))
    h += fmt::format("<p>COLMAP: {} <code>{}</code></p>\n", colmap->model, colmap->params);
  h += fmt::format(
      "<figure>{}<figcaption>How far the projection of a fixed direction may be off (standard deviation, px), less "
      "what a turn of the camera undoes: "
      "median {:.3f}, largest {:.3f}.{}</figcaption></figure>\n",
      UncertaintySvg(summary), summary.uncertainty.median_px, summary.uncertainty.largest_px,
      std::ranges::any_of(summary.uncertainty.sigma_px, [](double s) { return !std::isfinite(s); })
          ? " Red: beyond the reach of the distortion's polynomial, no ray belongs to such a pixel."
          : "");
  h += fmt::format(
      "<figure>{}<figcaption>Corners, a colour a view; their hull covers {:.0f} % of the picture. {} single corners "
      "are left out (ringed).</figcaption></figure>\n",
      CoverageSvg(summary), 100 * fit.coverage, fit.corners_left_out);
  h += "<h2>Models</h2><table>" +
       Row({"model", "terms", "RMS px", "cross-validated px", "fx, px", "by noise", "as good", "seconds", ""}, "th");
  for (const ModelTrial& t : fit.trials)
    h += Row({t.model.name, std::to_string(t.model.FreeCount()), fmt::format("{:.4f}", t.rms_px),
              optional(t.cross_validated_rms_px), fmt::format("{:.2f}", t.fx_px), fmt::format("{:.2f}", t.sigma_fx_px),
              t.as_good ? "yes" : "", fmt::format("{:.3f}", t.seconds), t.why_not},
             "td", t.model.name == c.model.name ? " class='chosen'" : "");
  h += "</table>\n";
  if (!summary.tradeoff.empty())
    h += "<h2>Number of views</h2>" + SvgOf(ViewCountPlots(ViewCountTable(summary.tradeoff)));
  h += "<h2>Views</h2><table>" + Row({"view", "RMS px"}, "th");
  for (std::size_t v = 0; v < fit.views.size(); ++v)
    h += Row({fit.views[v].name, fmt::format("{:.4f}", c.view_rms_px[v])});
  h += "</table>\n";
  if (!summary.gathered.refused.empty() || !fit.refused.empty()) {
    h += "<h2>Refused</h2><table>" + Row({"view", "reason"}, "th");
    for (const auto* refused : {&summary.gathered.refused, &fit.refused})
      for (const RefusedView& r : *refused) h += Row({r.name, r.reason});
    h += "</table>\n";
  }
  if (summary.gathered.video)
    h += fmt::format("<p>Of {} frames {} were searched; {} show no whole board, {} show what others show.</p>\n",
                     summary.gathered.pictures, summary.gathered.searched, summary.gathered.without_board,
                     summary.gathered.redundant);
  return h + "</body></html>\n";
}

}  // namespace lumi
