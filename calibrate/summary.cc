// A calibration's summary as JSON and as text.
#include <fmt/format.h>

#include <utility>

#include "calibrate/calibrate.h"
#include "calibrate/report.h"

namespace lumi {
namespace {

struct ViewRow {
  std::string name;
  double rms_px;
};
void ListKeys(JsonKeys& j, ViewRow& v) { j("name", v.name, "rms_px", v.rms_px); }

// Of each parameter: its name, value and standard deviation.
struct Parameter {
  const char* name;
  double value, sigma;
};
std::vector<Parameter> ParametersOf(const FitResult& fit) {
  const Calibration& c = fit.calibration;
  const PixelTerms sigma = fit.PixelSigmas();
  std::vector<Parameter> parameters{{"fx", c.intrinsics[kFx], sigma.fx},
                                    {"fy", c.Fy(), sigma.fy},
                                    {"cx", c.intrinsics[kCx], sigma.cx},
                                    {"cy", c.intrinsics[kCy], sigma.cy}};
  for (const auto& [name, term] :
       {std::pair("skew", kSkew), {"k1", kK1}, {"k2", kK2}, {"p1", kP1}, {"p2", kP2}, {"k3", kK3}})
    parameters.push_back({name, c.intrinsics[term], c.Sigma(term, c.noise_px)});
  return parameters;
}

}  // namespace

static void ListKeys(JsonKeys& j, RefusedView& r) { j("name", r.name, "reason", r.reason); }

void ListKeys(JsonKeys& j, CalibrateSummary& s) {
  Calibration& c = s.fit.calibration;
  const std::vector<Parameter> parameters = ParametersOf(s.fit);
  for (const Parameter& p : parameters) j.Say(p.name, p.value);
  for (const Parameter& p : parameters) j.Say(("sigma_" + std::string(p.name)).c_str(), p.sigma);
  const PixelTerms& spread = s.fit.model_spread_px;
  j.Say("spread_fx", spread.fx).Say("spread_fy", spread.fy).Say("spread_cx", spread.cx).Say("spread_cy", spread.cy);
  j("rms_px", c.rms_px, "cross_validated_rms_px", s.fit.cross_validated_rms_px, "noise_px", c.noise_px);
  j("width_px", s.gathered.width_px, "height_px", s.gathered.height_px, "board", s.board, "square_mm", s.square_mm);
  j("model", c.model.name, "choice", s.fit.choice).Say("views_used", s.fit.views.size());
  std::vector<RefusedView> refused = s.gathered.refused;
  refused.insert(refused.end(), s.fit.refused.begin(), s.fit.refused.end());
  j("views_refused", refused, "pictures", s.gathered.pictures, "pictures_searched", s.gathered.searched);
  j("pictures_without_board", s.gathered.without_board, "pictures_redundant", s.gathered.redundant, "corners_left_out",
    s.fit.corners_left_out);
  j("coverage", s.fit.coverage, "uncertainty_median_px", s.uncertainty.median_px, "uncertainty_largest_px",
    s.uncertainty.largest_px);
  const auto colmap = ColmapCameraOf(c.intrinsics);
  j.Say("colmap_model", colmap ? std::optional(colmap->model) : std::nullopt)
      .Say("colmap_params", colmap ? std::optional(colmap->params) : std::nullopt);
  std::vector<ViewRow> views;
  for (std::size_t v = 0; v < s.fit.views.size(); ++v) views.push_back({s.fit.views[v].name, c.view_rms_px[v]});
  j("views", views).Append(KeysOf(ModelTable(s.fit)));
  if (!s.tradeoff.empty()) {
    TradeoffTable table = ViewCountTable(s.tradeoff);
    table.rows_key = "tradeoff";
    j.Append(KeysOf(table));
    j("tradeoff_json", s.tradeoff_files.json, "tradeoff_svg", s.tradeoff_files.svg);
  }
  j("undistorted", s.undistorted, "output", s.output, "report", s.report, "seconds_boards", s.gathered.seconds,
    "seconds", s.seconds);
}

std::string Describe(const CalibrateSummary& s) {
  const Calibration& c = s.fit.calibration;
  std::string text = fmt::format("{} of {} pictures with a {} board are used, {}x{} pixels\n\n", s.fit.views.size(),
                                 s.gathered.pictures, s.board, s.gathered.width_px, s.gathered.height_px);
  for (const Parameter& p : ParametersOf(s.fit))
    text += p.sigma > 0 ? fmt::format("{:>5} {:12.5f} +- {:.5f}\n", p.name, p.value, p.sigma)
                        : fmt::format("{:>5} {:12.5f}    held\n", p.name, p.value);
  if (const PixelTerms& spread = s.fit.model_spread_px; spread.fx > 0)
    text +=
        fmt::format("(of that by which models that do as well differ: fx {:.2g}, fy {:.2g}, cx {:.2g}, cy {:.2g})\n",
                    spread.fx, spread.fy, spread.cx, spread.cy);
  const auto number = [](const std::optional<double>& x) { return x ? fmt::format("{:.4f}", *x) : std::string("-"); };
  text += fmt::format(
      "\nRMS {:.4f} px, cross-validated {} px, projection uncertain by {:.3f} px (median), {:.3f} px (largest)\n",
      c.rms_px, number(s.fit.cross_validated_rms_px), s.uncertainty.median_px, s.uncertainty.largest_px);
  text += "\n" + TextOf(ModelTable(s.fit)) + fmt::format("\n* {}\n", s.fit.choice);
  if (!s.tradeoff.empty()) text += "\n" + TextOf(ViewCountTable(s.tradeoff)) + "\n";
  if (!s.gathered.refused.empty() || !s.fit.refused.empty()) text += "\nrefused:\n";
  for (const auto* refused : {&s.gathered.refused, &s.fit.refused})
    for (const RefusedView& r : *refused) text += fmt::format("  {}: {}\n", r.name, r.reason);
  const auto colmap = ColmapCameraOf(c.intrinsics);
  text += colmap ? fmt::format("\nCOLMAP: --ImageReader.camera_model {} --ImageReader.camera_params {}\n",
                               colmap->model, colmap->params)
                 : std::string("\nCOLMAP: no model of its has skew: undistort the photos (--undistort)\n");
  return text + fmt::format("{} and {}, {:.1f} s", s.output.string(), s.report.string(), s.seconds);
}

}  // namespace lumi
