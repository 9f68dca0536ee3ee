// Angle at the proxy point p between the desired ray and the ray to camera j (thesis sec. 4.1; Kahan's form). With d
// the unit ray, t the distance to p and D = C_j - C_desired: atan2(|D x d|, t - D.d), which keeps its digits down to 0
// because D was formed in double. A camera behind the view counts: it sees the same radiance.
#pragma once

#include "render/radiance/measures/record.h"

namespace lumi {

template <typename T>
LUMI_INLINE T Angle(T Dx, T Dy, T Dz, T dx, T dy, T dz, T t) {
  const T cx = Dy * dz - Dz * dy;
  const T cy = Dz * dx - Dx * dz;
  const T cz = Dx * dy - Dy * dx;
  return AtanPositive(std::sqrt(cx * cx + cy * cy + cz * cz), t - (Dx * dx + Dy * dy + Dz * dz));
}

namespace measure {

// The term that h always has: alpha theta, in radians.
struct Angle {
  static constexpr std::string_view kName = "angle", kTitle = "the angle";
  static constexpr bool kEffect = false;

  struct Settings {
    double alpha = 1;  // >= 0
    bool operator==(const Settings&) const = default;
  };
  template <typename Table>
  static void Options(Table& table) {
    table.Real("alpha", &Settings::alpha, kFactorRange, "Weight of the angle, >= 0", kFactorRow("angle"));
  }

  static constexpr std::string_view kHeatMapUnit = "deg", kHeatMapHelp = "The angle to that photo's ray";
};

}  // namespace measure
}  // namespace lumi
