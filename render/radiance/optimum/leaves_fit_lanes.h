// Evaluates a LeavesFit, for kernels.
#pragma once

#include "render/radiance/optimum/lane_math.h"
#include "render/radiance/optimum/leaves_fit.h"

namespace lumi {

// V is a number or Lanes of it.
template <class T, class V>
LUMI_INLINE V FitQ(const LeavesFit<T>& fit, V q) {
  const V z = q + q - T(1);
  V p = V{} + fit.q[LeavesFit<T>::kQ];
  for (int i = LeavesFit<T>::kQ; i-- > 0;) p = p * z + fit.q[static_cast<std::size_t>(i)];
  return p;
}

// theta^2, for c2 <= c2_max.
template <class T, class V>
LUMI_INLINE V FitSquaredAngle(const LeavesFit<T>& fit, V c2) {
  const V z = c2 * fit.c2_scale - T(1);
  V p = V{} + fit.a[LeavesFit<T>::kA];
  for (int i = LeavesFit<T>::kA; i-- > 0;) p = p * z + fit.a[static_cast<std::size_t>(i)];
  return p * c2;
}

// P_same at h = 2 r_max y, y >= 0. `near`: whether some lane may lie below y_near.
template <class T, class V>
LUMI_INLINE V FitPSame(const LeavesFit<T>& fit, V y, bool near) {
  const V one = Broadcast<V>(1);
  const V yc = LaneMin(y, one), q = yc * yc;
  const V yQ = yc * FitQ(fit, q);
  constexpr T kTiny = sizeof(T) == 4 ? T(1e-36) : T(1e-300);
  // -ln(2 y) - 1/2
  V B = T(-0.5) * LaneLog(LaneMax(q, Broadcast<V>(kTiny))) - T(0.6931471805599453 + 0.5) + yQ;
  B = LaneMax(B, V{});
  if (near) {
    const V ys = LaneMin(y * fit.ratio, one);
    const V below = fit.log_ratio + yQ - ys * FitQ(fit, ys * ys);
    B = y < fit.y_near ? LaneMin(below, Broadcast<V>(fit.log_ratio)) : B;
  }
  const V P = B / (T(2) * fit.log_ratio - B);
  return y < one ? P : V{};
}

}  // namespace lumi
