// Functions for the kernels' loops (scene/program/kernel.h): without branches, of float and double alike.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "scene/program/kernel.h"

namespace lumi {

// atan2(y, x) for y >= 0, without branches: result in [0, pi]; error below 1.5e-7 rad, and relative below 1.5e-7
// towards 0, where the polynomial is odd. Coefficients: Chebyshev interpolation of atan(sqrt(s))/sqrt(s) on [0,1], 9
// nodes (2e-8).
LUMI_INLINE float AtanPositive(float y, float x) {
  const float ax = std::abs(x);
  const float lo = std::min(ax, y), hi = std::max(ax, y);
  const float a = lo / (hi > 0 ? hi : 1.0F);
  const float s = a * a;
  float p = 2.766283501e-3F;
  p = p * s - 1.573124912e-2F;
  p = p * s + 4.213762359e-2F;
  p = p * s - 7.456854826e-2F;
  p = p * s + 0.1061837064F;
  p = p * s - 0.1419779780F;
  p = p * s + 0.1999187203F;
  p = p * s - 0.3333303671F;
  p = p * s + 0.9999999818F;
  float r = p * a;
  r = y > ax ? 1.57079632679F - r : r;
  return x < 0 ? 3.14159265359F - r : r;
}

// The same in double, error below 1e-15 relative: the rational function of Cephes' atan (Moshier 1984), on [0, 1]
// reduced about 1.
LUMI_INLINE double AtanPositive(double y, double x) {
  const double ax = std::abs(x);
  const double lo = std::min(ax, y), hi = std::max(ax, y);
  const bool near_one = lo > 0.66 * hi;
  const double numerator = near_one ? lo - hi : lo, denominator = near_one ? lo + hi : hi;
  const double a = numerator / (denominator > 0 ? denominator : 1.0);
  const double z = a * a;
  const double p =
      (((-8.750608600031904122785e-1 * z - 1.615753718733365076637e1) * z - 7.500855792314704667340e1) * z -
       1.228866684490136173410e2) *
          z -
      6.485021904942025371773e1;
  const double q =
      ((((z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2) * z + 4.328810604912902668951e2) * z +
       4.853903996359136964868e2) *
          z +
      1.945506571482613964425e2;
  double r = a * (z * p / q) + a;
  r = near_one ? r + 0.78539816339744830962 : r;
  r = y > ax ? 1.57079632679489661923 - r : r;
  return x < 0 ? 3.14159265358979323846 - r : r;
}

// Raised cosine (1 - cos(pi s)) / 2 = sin^2(pi s / 2) for s clamped to [0,1]; error below 3e-7 (rounding), exactly 0 at
// 0 and accurate relative to its value there, where its inverse counts. Coefficients: Chebyshev interpolation of
// sin(sqrt(q))/sqrt(q) on [0, (pi/2)^2], 6 nodes (2e-11).
LUMI_INLINE float RaisedCosine(float s) {
  const float x = std::min(std::max(s, 0.0F), 1.0F) * 1.57079632679F;
  const float x2 = x * x;
  float p = -2.38892187e-8F;
  p = p * x2 + 2.75252698e-6F;
  p = p * x2 - 1.98408612e-4F;
  p = p * x2 + 8.33333097e-3F;
  p = p * x2 - 0.166666666F;
  const float sine = x + x * x2 * p;
  return std::min(sine * sine, 1.0F);
}

LUMI_INLINE double RaisedCosine(double s) {
  const double sine = std::sin(std::min(std::max(s, 0.0), 1.0) * 1.57079632679489661923);
  return sine * sine;
}

// log2 of a positive, normal number; error below 4e-7 absolute near 1 and relative elsewhere. The mantissa is taken
// from [sqrt(1/2), sqrt(2)), and log2(m) = 2/ln 2 atanh((m - 1)/(m + 1)) by its series.
LUMI_INLINE float Log2(float x) {
  const auto bits = std::bit_cast<std::int32_t>(x);
  const std::int32_t shifted = bits - 0x3f3504f3;  // sqrt(1/2)
  const std::int32_t exponent = shifted >> 23;
  const float m = std::bit_cast<float>(bits - (exponent << 23));
  const float z = (m - 1) / (m + 1), z2 = z * z;
  const float series = 1.0F + z2 * (0.333333333F + z2 * (0.2F + z2 * (0.142857143F + z2 * 0.111111111F)));
  return static_cast<float>(exponent) + 2.885390082F * z * series;
}
LUMI_INLINE double Log2(double x) { return std::log2(x); }

}  // namespace lumi
