#include "render/radiance/settings.h"

#include <cmath>

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
  return {};
}

std::string_view Name(Similarity v) { return v == Similarity::kFull ? "full" : "identity"; }
std::string_view Name(Correlation v) { return v == Correlation::kInverse ? "inverse" : "falling-leaves"; }
std::string_view Name(Combine v) { return v == Combine::kSmooth ? "smooth" : "additive"; }
std::string_view Name(WeightSum v) {
  return v == WeightSum::kRenormalise ? "renormalise" : v == WeightSum::kConstrained ? "constrained" : "local-mean";
}
std::string_view Name(Sampling v) { return v == Sampling::kCandidates ? "candidates" : "interpolated"; }

}  // namespace lumi
