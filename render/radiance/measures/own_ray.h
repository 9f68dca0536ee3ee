// What lies on a photo's own ray it sees, whatever its depth map says: beside a silhouette the map's texels, widened,
// take a point for blocked that the photo shows. Visibility rises to 1 as the angle falls from kOwnRayRad to 0,
// continuously.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

// Between rays so close an occluder as far away as half the point's distance moves by no more than the half texel that
// an edge's feather reaches beyond it (128 texels across 50 degrees).
constexpr float kOwnRayRad = 0.0035F;

LUMI_INLINE float VisibilityNearOwnRay(float v, float theta) {
  const float s = std::min(theta * (1 / kOwnRayRad), 1.0F);
  return 1.0F - (1.0F - v) * (s * s * (3.0F - 2.0F * s));
}

}  // namespace lumi
