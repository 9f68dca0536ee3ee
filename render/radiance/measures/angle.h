// Angle at the proxy point p between the desired ray and the ray to camera j (thesis sec. 4.1; Kahan's form). With d the unit
// ray, t the distance to p and D = C_j - C_desired: atan2(|D x d|, t - D.d), which keeps its digits down to 0 because D was
// formed in double. A camera behind the view counts: it sees the same radiance.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

LUMI_INLINE float Angle(float Dx, float Dy, float Dz, float dx, float dy, float dz, float t) {
  const float cx = Dy * dz - Dz * dy;
  const float cy = Dz * dx - Dx * dz;
  const float cz = Dx * dy - Dy * dx;
  return AtanPositive(std::sqrt(cx * cx + cy * cy + cz * cz), t - (Dx * dx + Dy * dy + Dz * dz));
}

}  // namespace lumi
