// Time (thesis sec. 7.1): dissimilarity of two times in units of 2 r_max. `least` in the window's core, a raised cosine from there up to
// 1 at the window's edge, and in proportion beyond, so that the nearest in time still lead where the window is empty. On the circle
// of a period where there is one.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

struct TimeShape {
  float inverse_half_window = 0;  // per second
  float core = 0.5F;              // the flat part of the window, [0, 1)
  float least = 0;                // in the core, [0, 1)
  float period_s = 0, inverse_period = 0;
};

LUMI_INLINE float TimeDissimilarity(float dt_s, const TimeShape& shape) {
  dt_s = std::abs(dt_s);
  const float turns = dt_s * shape.inverse_period;  // 0 without a period
  dt_s = std::abs(dt_s - shape.period_s * std::floor(turns + 0.5F));
  const float s = dt_s * shape.inverse_half_window;
  return s > 1 ? s : shape.least + (1 - shape.least) * RaisedCosine((s - shape.core) / (1 - shape.core));
}

}  // namespace lumi
