#include "render/radiance/settings.h"

#include <array>
#include <cmath>
#include <utility>

#include "render/radiance/setting_options.h"

namespace lumi {
std::string Validate(const RadianceSettings& s) {
  if (s.k < 0 || s.k > kMaxBlend) return "--k takes 1 to " + std::to_string(kMaxBlend) + ", or all";
  for (const SettingOption& o : SettingOptions())
    if (o.problem)
      if (std::string problem = o.problem(s); !problem.empty()) return problem;
  if (s.r_min_rad > s.r_max_rad) return "--r-min-deg must lie in [0, --r-max-deg]";
  if (!(s.period_s >= 0 && std::isfinite(s.period_s))) return "the scene's period must be 0 or more";
  const bool none = s.grid_columns == 0 && s.grid_rows == 0;
  if (!none && (s.grid_columns < 2 || s.grid_rows < 2 || s.grid_columns > 4096 || s.grid_rows > 4096))
    return "--grid takes WxH with 2 to 4096 samples a side, or pixel";
  if (s.similarity == Similarity::kFull && s.correlation == Correlation::kInverse)
    return "--similarity full needs --correlation falling-leaves: 1/h is no covariance (infinite at 0)";
  if (s.similarity == Similarity::kFull && !none && s.sampling == Sampling::kCandidates)
    return "--similarity full on a grid needs --sampling interpolated: candidates are weighed with the identity";
  if (s.method != Algorithm::kUlr && (s.similarity == Similarity::kFull || !none))
    return "--method " + std::string(Name(s.method)) +
           " weighs every pixel its own way: " + (none ? "--similarity full" : "--grid") + " does not go with it";
  return {};
}

std::string_view Name(Similarity v) { return v == Similarity::kFull ? "full" : "identity"; }
std::string_view Name(Correlation v) {
  return v == Correlation::kInverse ? "inverse" : v == Correlation::kMeasured ? "measured" : "falling-leaves";
}
std::string_view Name(Combine v) { return v == Combine::kSmooth ? "smooth" : "additive"; }
std::string_view Name(WeightSum v) {
  return v == WeightSum::kRenormalise ? "renormalise" : v == WeightSum::kConstrained ? "constrained" : "local-mean";
}

namespace {
constexpr std::array kAlgorithms = std::to_array<std::pair<Algorithm, std::string_view>>({
    {Algorithm::kUlr, "ulr"},
    {Algorithm::kChenWilliams1993, "chen-williams-1993"},
    {Algorithm::kLevoyHanrahan1996, "levoy-hanrahan-1996"},
    {Algorithm::kGortler1996, "gortler-1996"},
    {Algorithm::kDebevec1996, "debevec-1996"},
    {Algorithm::kSeitzDyer1996, "seitz-dyer-1996"},
    {Algorithm::kPulli1997, "pulli-1997"},
    {Algorithm::kDebevec1998, "debevec-1998"},
    {Algorithm::kPighin1998, "pighin-1998"},
    {Algorithm::kHeigl1999, "heigl-1999"},
    {Algorithm::kLhuillierQuan1999, "lhuillier-quan-1999"},
    {Algorithm::kWood2000, "wood-2000"},
    {Algorithm::kSibrUlr, "sibr-ulr"},
});
}  // namespace

std::string_view Name(Algorithm v) { return kAlgorithms[static_cast<std::size_t>(v)].second; }

std::span<const Algorithm> Algorithms() {
  static const std::array all = [] {
    std::array<Algorithm, kAlgorithms.size()> a{};
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = kAlgorithms[i].first;
    return a;
  }();
  return all;
}

std::string_view Name(Sampling v) { return v == Sampling::kCandidates ? "candidates" : "interpolated"; }

}  // namespace lumi
