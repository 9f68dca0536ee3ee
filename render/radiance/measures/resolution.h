// Resolution (thesis sec. 4.2.2 and 5.1.2): how much a pixel of photo j is stretched in the desired view, sigma > 1 where the
// photo is undersampled, and the value r_j in [0,1] that comes of it.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

// sigma as the ratio of distances, with the focal lengths that the thesis takes for equal.
LUMI_INLINE float DistanceStretch(float distance_source, float distance_desired, float focal_source_px, float focal_desired_px) {
  return (distance_source * focal_desired_px) / (distance_desired * focal_source_px);
}

// Largest singular value of [a b; c d], without cancellation (errata).
LUMI_INLINE float LargestSingularValue(float a, float b, float c, float d) {
  const float s = a + d, e = b - c, m = a - d, n = b + c;
  return 0.5F * (std::sqrt(s * s + e * e) + std::sqrt(m * m + n * n));
}

// sigma of the homography from photo to view that the proxy's plane induces: J_view J_photo^-1, where J maps a step in the
// plane's tangents to a step in pixels. Equal to the thesis's Jacobian (whose factor is 1 / (Gx + Hy + I)^2, errata), but
// finite in its intermediates. A photo that sees the plane edge-on is infinitely stretched.
LUMI_INLINE float JacobianStretch(float v00, float v01, float v10, float v11, float p00, float p01, float p10, float p11) {
  const float det = p00 * p11 - p01 * p10;
  const float a = v00 * p11 - v01 * p10, b = v01 * p00 - v00 * p01;
  const float c = v10 * p11 - v11 * p10, d = v11 * p00 - v10 * p01;
  const float size = LargestSingularValue(a, b, c, d);
  return std::abs(det) > size * 1e-12F ? size / std::abs(det) : 1e12F;
}

// The same from the photo's pixels as functions of the view's, whose Jacobian on the proxy's plane is (A + b c^T / facing) / w:
// A what rays at infinity have, b the motion of the photo's pixel and c / facing that of the inverse depth, a step of a pixel each,
// w the depth in the photo over that in the view. sigma = 1 / its smaller singular value, by the matrix determinant lemma:
// finite for a plane seen edge on, facing = 0, too.
LUMI_INLINE float PlaneStretch(float a00, float a01, float a10, float a11, float b0, float b1, float c0, float c1, float facing,
                               float w) {
  const float size = w * LargestSingularValue(a00 * facing + b0 * c0, a01 * facing + b0 * c1,  //
                                              a10 * facing + b1 * c0, a11 * facing + b1 * c1);
  const float det = std::abs((a00 * a11 - a01 * a10) * facing + c0 * (a11 * b0 - a01 * b1) + c1 * (a00 * b1 - a10 * b0));
  return det > size * 1e-12F ? size / det : 1e12F;
}

// What ResolutionValue takes for a limit; 0 for none.
inline float InverseLog(double limit) { return limit > 0 ? static_cast<float>(1 / std::abs(std::log2(limit))) : 0.0F; }

// Value of a stretch (Fig. 4-7): 1 at sigma = 1, a raised cosine of log sigma down to 0 at `high` for undersampled photos, and
// at `low` for oversampled ones; inverse_log_low = 0: those are not penalised (the pyramid serves them).
// inverse_log_x = 1 / |log2(x)|.
LUMI_INLINE float ResolutionValue(float sigma, float inverse_log_low, float inverse_log_high) {
  const float octaves = Log2(std::min(std::max(sigma, 1e-12F), 1e12F));
  return RaisedCosine(1.0F - (octaves > 0 ? octaves * inverse_log_high : -octaves * inverse_log_low));
}

}  // namespace lumi
