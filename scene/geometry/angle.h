// Angles that keep their accuracy down to zero (Kahan 2006, "How futile are mindless assessments of roundoff", sec.
// 12): acos(dot) loses half the digits near 0 and pi; these do not.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "scene/geometry/constants.h"

namespace lumi {

// Angle in [0, pi] between two vectors of any non-zero length.
template <typename Derived, typename Other>
typename Derived::Scalar AngleBetween(const Eigen::MatrixBase<Derived>& a, const Eigen::MatrixBase<Other>& b) {
  using Scalar = typename Derived::Scalar;
  const auto u = (a / a.norm()).eval();
  const auto v = (b / b.norm()).eval();
  return Scalar(2) * std::atan2((u - v).norm(), (u + v).norm());
}

}  // namespace lumi
