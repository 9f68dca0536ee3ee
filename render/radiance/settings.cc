#include "render/radiance/settings.h"

#include <cmath>

namespace lumi {

std::string Validate(const RadianceSettings& s) {
  if (s.k < 0 || s.k > kMaxBlend) return "--k takes 1 to " + std::to_string(kMaxBlend) + ", or all";
  if (!(s.gamma >= 0) || !std::isfinite(s.gamma)) return "--gamma must be 0 or more";
  if (!(s.fov_feather > 0 && s.fov_feather <= 0.5)) return "--fov-feather must lie in (0, 0.5]";
  return {};
}

}  // namespace lumi
