#include "render/radiance/settings.h"

#include <cmath>

namespace lumi {
namespace {

// Of a measure: beyond it, sums of measures leave what a float holds.
constexpr double kMaxFactor = 1e9;

}  // namespace

std::string Validate(const RadianceSettings& s) {
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  const auto weight = [](double v) { return v >= 0 && v <= kMaxFactor; };
  const auto duration = [](double v) { return v >= 0 && std::isfinite(v); };
  if (s.k < 0 || s.k > kMaxBlend) return "--k takes 1 to " + std::to_string(kMaxBlend) + ", or all";
  if (!weight(s.alpha)) return "--alpha must lie in [0, 1e9]";
  if (!weight(s.beta)) return "--beta must lie in [0, 1e9]";
  if (!weight(s.gamma)) return "--gamma must lie in [0, 1e9]";
  if (!weight(s.epsilon)) return "--epsilon must lie in [0, 1e9]";
  if (!(s.fov_feather > 0 && s.fov_feather <= 0.5)) return "--fov-feather must lie in (0, 0.5]";
  if (!(s.r_min_rad >= 0 && s.r_min_rad <= s.r_max_rad)) return "--r-min-deg must lie in [0, --r-max-deg]";
  if (!(s.r_max_rad > 0 && s.r_max_rad <= std::numbers::pi / 2)) return "--r-max-deg must lie in (0, 90]";
  if (!(s.cutoff_rad > 0 && s.cutoff_rad <= std::numbers::pi)) return "--cutoff-deg must lie in (0, 180]";
  if (!positive(s.accuracy)) return "--accuracy must be above 0";
  if (!(s.resolution_low >= 0 && s.resolution_low < 1)) return "--resolution-range must begin in [0, 1)";
  if (!(s.resolution_high > 1 && std::isfinite(s.resolution_high))) return "--resolution-range must end above 1";
  if (!std::isfinite(s.time_s)) return "--time-s must be a number";
  if (!positive(s.time_window_s)) return "--time-window-s must be above 0";
  if (!(s.time_core >= 0 && s.time_core <= 0.95)) return "--time-core must lie in [0, 0.95]";
  if (!(s.time_least >= 0 && s.time_least <= 0.5)) return "--time-least must lie in [0, 0.5]";
  if (!duration(s.period_s)) return "the scene's period must be 0 or more";
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
std::string_view Name(Resolution v) { return v == Resolution::kOff ? "off" : v == Resolution::kDistance ? "distance" : "jacobian"; }
std::string_view Name(Sampling v) { return v == Sampling::kCandidates ? "candidates" : "interpolated"; }

}  // namespace lumi
