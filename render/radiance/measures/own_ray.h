// A photo sees every point on its own rays, whatever its depth map says: beside a silhouette, the width of the map's
// texels makes points count as blocked that the photo shows. Visibility rises to 1 as the angle falls from kOwnRayRad
// to 0, continuously.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

// Between rays this close, an occluder at half the point's distance moves by at most half a texel, by which an edge's
// feather extends beyond it (128 texels across 50 degrees).
constexpr float kOwnRayRad = 0.0035F;

LUMI_INLINE float VisibilityNearOwnRay(float v, float theta) {
  const float s = std::min(theta * (1 / kOwnRayRad), 1.0F);
  return 1.0F - (1.0F - v) * (s * s * (3.0F - 2.0F * s));
}

}  // namespace lumi
