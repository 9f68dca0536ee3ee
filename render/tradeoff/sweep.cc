#include "render/tradeoff/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "render/radiance/setting_options.h"

namespace lumi {
namespace {

constexpr int kBaseGrid = 25;  // the thesis's
const std::vector<int> kGrids = {4, 8, 12, 16, 25, 32, 64};

}  // namespace

std::string_view Name(Method method) {
  switch (method) {
    case Method::kPixel: return "identity";
    case Method::kInterpolated: return "interpolated";
    case Method::kCandidates: return "candidates";
    case Method::kOptimumGrid: return "optimum on the grid";
    default: return "optimum";
  }
}

Method MethodOf(const RadianceSettings& s) {
  if (s.similarity == Similarity::kFull) return s.Sparse() ? Method::kOptimumGrid : Method::kOptimumPixel;
  if (!s.Sparse()) return Method::kPixel;
  return s.sampling == Sampling::kCandidates ? Method::kCandidates : Method::kInterpolated;
}

RadianceSettings WithMethod(RadianceSettings s, Method method, int grid) {
  const bool optimum = method == Method::kOptimumGrid || method == Method::kOptimumPixel;
  const bool sparse = method != Method::kPixel && method != Method::kOptimumPixel;
  s.similarity = optimum ? Similarity::kFull : Similarity::kIdentity;
  s.correlation = optimum ? Correlation::kFallingLeaves : Correlation::kInverse;
  s.sampling = method == Method::kInterpolated || optimum ? Sampling::kInterpolated : Sampling::kCandidates;
  s.grid_columns = s.grid_rows = sparse ? grid : 0;
  return s;
}

bool HasSamples(const RadianceSettings& s) {
  return s.Sparse() && (s.similarity == Similarity::kFull || s.sampling == Sampling::kInterpolated || s.k > 0);
}

RadianceSettings PerPixel(const RadianceSettings& settings) {
  RadianceSettings s = settings;
  s.grid_columns = s.grid_rows = 0;
  // Options that weights at every pixel do not read are reset, so that equal references have equal settings.
  s.sampling = Sampling::kCandidates;
  s.epipoles = true;
  return s;
}

std::string PointName(const RadianceSettings& s, const RadianceSettings& base) {
  const Method method = MethodOf(s);
  std::string name(Name(method));
  if (s.Sparse()) name += fmt::format(" {}x{}", s.grid_columns, s.grid_rows);
  if (s.Sparse() && method != Method::kCandidates && !s.epipoles) name += " without epipoles";
  const bool optimum = s.similarity == Similarity::kFull;
  if (!optimum) name += s.k == 0 ? ", k all" : fmt::format(", k {}", s.k);
  if (!optimum && s.correlation != Correlation::kInverse) name += ", falling leaves";
  // Other options are named if they differ from `base`.
  constexpr std::array<std::string_view, 6> kSaid = {"similarity", "k", "correlation", "grid", "sampling", "epipoles"};
  for (const SettingOption& o : SettingOptions()) {
    if (std::find(kSaid.begin(), kSaid.end(), o.name) != kSaid.end()) continue;
    const OptionValue now = o.get(s);
    if (now == o.get(base)) continue;
    const auto* number = std::get_if<double>(&now);
    name += fmt::format(", {} {}", o.name, number ? fmt::format("{:g}", *number) : Text(now));
  }
  return name;
}

std::vector<SweepPoint> SweepTable(const RadianceSettings& given, SweepSize size) {
  RadianceSettings base = given;
  const int grid = base.Sparse() ? std::max(base.grid_columns, base.grid_rows) : kBaseGrid;
  std::vector<SweepPoint> table;
  const auto add = [&](const RadianceSettings& s) {
    const bool known = std::any_of(table.begin(), table.end(), [&](const SweepPoint& p) { return p.settings == s; });
    const bool idle = s.Sparse() && !HasSamples(s);
    if (!known && !idle && Validate(s).empty()) table.push_back({PointName(s, base), s});
  };
  const auto with = [&](Method method, int side, auto&& change) {
    RadianceSettings s = WithMethod(base, method, side);
    change(s);
    add(s);
  };
  const auto plain = [](RadianceSettings&) {};

  for (const Method m :
       {Method::kCandidates, Method::kInterpolated, Method::kPixel, Method::kOptimumGrid, Method::kOptimumPixel})
    with(m, grid, plain);
  if (size == SweepSize::kMethods) return table;

  const std::vector<int> grids = size == SweepSize::kQuick ? std::vector<int>{8, 16, 32} : kGrids;
  for (const int side : grids) {
    with(Method::kCandidates, side, plain);
    for (const bool epipoles : {true, false})
      with(Method::kInterpolated, side, [&](RadianceSettings& s) { s.epipoles = epipoles; });
    with(Method::kOptimumGrid, side, plain);
  }
  with(Method::kInterpolated, grid, [](RadianceSettings& s) { s.epipoles = false; });
  with(Method::kOptimumGrid, grid, [](RadianceSettings& s) { s.epipoles = false; });

  const std::vector<int> ks = size == SweepSize::kQuick ? std::vector<int>{2, 8} : std::vector<int>{1, 2, 3, 5, 8, 16};
  for (const int k : ks) {
    with(Method::kCandidates, grid, [&](RadianceSettings& s) { s.k = k; });
    with(Method::kInterpolated, grid, [&](RadianceSettings& s) { s.k = k; });
    with(Method::kPixel, grid, [&](RadianceSettings& s) { s.k = k; });
  }
  with(Method::kPixel, grid, [](RadianceSettings& s) { s.k = 0; });

  // A measure with several variants is measured with each of them. Then each effect is switched off alone, to show its
  // cost and its worth here; corrections applied when photos are read cost no frame anything.
  for (const SettingOption& o : SettingOptions())
    for (const std::string& choice : o.is_switch ? o.choices : std::vector<std::string>())
      for (const Method m : {Method::kCandidates, Method::kPixel, Method::kOptimumGrid})
        with(m, grid, [&](RadianceSettings& s) { o.set(s, choice); });
  if (size == SweepSize::kQuick) return table;
  for (const SettingOption& o : SettingOptions())
    if (o.is_switch && o.measure != measure::WhiteBalance::kName && o.measure != measure::Vignetting::kName)
      with(Method::kCandidates, grid, [&](RadianceSettings& s) { o.set(s, std::string("off")); });

  // The optimum's own dials.
  for (const double deg : {10.0, 14.0, 24.0}) {
    with(Method::kOptimumGrid, grid, [&](RadianceSettings& s) { s.cutoff_rad = deg * kRadPerDeg; });
    with(Method::kOptimumPixel, grid, [&](RadianceSettings& s) { s.cutoff_rad = deg * kRadPerDeg; });
  }
  for (const WeightSum sum : {WeightSum::kRenormalise, WeightSum::kConstrained, WeightSum::kLocalMean})
    with(Method::kOptimumGrid, grid, [&](RadianceSettings& s) { s.sum = sum; });
  with(Method::kOptimumGrid, grid, [](RadianceSettings& s) { s.combine = Combine::kAdditive; });

  // Combinations of cheap with cheap options, and of expensive with expensive ones.
  for (const auto& [side, k] : {std::pair{8, 1}, {8, 2}, {16, 2}, {16, 3}, {32, 8}, {64, 16}}) {
    with(Method::kCandidates, side, [&](RadianceSettings& s) { s.k = k; });
    with(Method::kInterpolated, side, [&](RadianceSettings& s) { s.k = k; });
  }
  return table;
}

}  // namespace lumi
