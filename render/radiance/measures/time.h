// Time (thesis sec. 7.1): dissimilarity of two times in units of 2 r_max. Nothing in the inner half of the window, a raised
// cosine up to 1 at its edge, and in proportion beyond, so that the nearest in time still lead where the window is empty.
// On the circle of a period where there is one.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

LUMI_INLINE float TimeDissimilarity(float dt_s, float inverse_half_window, float period_s, float inverse_period) {
  dt_s = std::abs(dt_s);
  const float turns = dt_s * inverse_period;  // 0 without a period
  dt_s = std::abs(dt_s - period_s * std::floor(turns + 0.5F));
  const float s = dt_s * inverse_half_window;
  return s > 1 ? s : RaisedCosine(2 * s - 1);
}

}  // namespace lumi
