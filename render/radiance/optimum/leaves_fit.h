// P_same of correlation.h for kernels: polynomials fitted when the settings are known. With y = h / (2 r_max),
//   G = -ln(2 y) - 1/2 + y Q(y^2),
// Q smooth on [0, 1] but for (1 - q)^(5/2) at its end; and theta^2 = c^2 A(c^2) from the chord c of two unit vectors,
// whose componentwise difference keeps digits where their product would lose them.
#pragma once

#include <array>

#include "render/radiance/correlation.h"

namespace lumi {

template <class T>
struct LeavesFit {
  static constexpr int kQ = sizeof(T) == 4 ? 8 : 26;  // degree of Q in 2 q - 1
  static constexpr int kA = sizeof(T) == 4 ? 4 : 9;   // degree of A in 2 c^2/c2_max - 1
  // Largest error of P_same over [0, 2 r_max] that a fit may have to be usable.
  static constexpr double kTolerance = sizeof(T) == 4 ? 4e-6 : 1e-8;

  std::array<T, kQ + 1> q;
  std::array<T, kA + 1> a;
  T c2_max;        // (2 sin(reach/2))^2 with reach = 2 r_max / alpha: beyond it nothing correlates
  T c2_scale;      // 2 / c2_max
  T y_from_theta;  // alpha / (2 r_max)
  T log_ratio;     // L
  T ratio;         // r_max / r_min
  T y_near;        // r_min / r_max: below it the smallest leaves count
  double error;    // of P_same as a function of theta, measured when fitted, without rounding
  bool usable;     // error within kTolerance: not for leaves of nearly one size, nor for angles beyond some 100 degrees

  // alpha: of h = alpha theta + ...
  LeavesFit(const FallingLeaves& leaves, double alpha);
};

extern template struct LeavesFit<float>;
extern template struct LeavesFit<double>;

}  // namespace lumi
