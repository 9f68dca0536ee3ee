// Arithmetic on lanes.h, for kernels: include it only where they are compiled (render/CMakeLists.txt sets their options).
#pragma once

#include <cmath>
#include <cstdint>

#include "render/radiance/kernel.h"
#include "render/radiance/optimum/lanes.h"

namespace lumi {

template <class T>
LUMI_INLINE Lanes<T> Broadcast(T x) {
  return x - Lanes<T>{};
}
template <class V>
LUMI_INLINE V LaneMin(V a, V b) {
  return a < b ? a : b;
}
template <class V>
LUMI_INLINE V LaneMax(V a, V b) {
  return a > b ? a : b;
}
template <class T>
LUMI_INLINE Lanes<T> LaneSqrt(Lanes<T> a) {
  alignas(64) T x[kLaneCount<T>];
  *reinterpret_cast<Lanes<T>*>(x) = a;
  for (int l = 0; l < kLaneCount<T>; ++l) x[l] = std::sqrt(x[l]);
  return *reinterpret_cast<Lanes<T>*>(x);
}

// The smallest of the lanes.
LUMI_INLINE float Smallest(Lanes<float> v) {
  using I = LaneTypes<float>::I;
  v = LaneMin(v, __builtin_shuffle(v, I{8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7}));
  v = LaneMin(v, __builtin_shuffle(v, I{4, 5, 6, 7, 0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3}));
  v = LaneMin(v, __builtin_shuffle(v, I{2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1}));
  v = LaneMin(v, __builtin_shuffle(v, I{1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0}));
  return v[0];
}
LUMI_INLINE double Smallest(Lanes<double> v) {
  using I = LaneTypes<double>::I;
  v = LaneMin(v, __builtin_shuffle(v, I{4, 5, 6, 7, 0, 1, 2, 3}));
  v = LaneMin(v, __builtin_shuffle(v, I{2, 3, 0, 1, 2, 3, 0, 1}));
  v = LaneMin(v, __builtin_shuffle(v, I{1, 0, 1, 0, 1, 0, 1, 0}));
  return v[0];
}

// Natural logarithm of positive, normal numbers: exponent, and mantissa m in [sqrt(1/2), sqrt(2)). Error below 2e-7 (float), 1e-13
// (double), absolute near 1 and relative elsewhere. In float by a polynomial of m - 1 (the coefficients are those of Cephes' logf:
// a division costs more), in double by the series of 2 atanh((m - 1)/(m + 1)).
LUMI_INLINE Lanes<float> LaneLog(Lanes<float> x) {
  using I = LaneTypes<float>::I;
  const I bits = (I)x, exponent = (bits - 0x3f3504f3) >> 23;
  const Lanes<float> t = (Lanes<float>)(bits - (exponent << 23)) - 1.0F, t2 = t * t;
  Lanes<float> p = 7.0376836292e-2F * t - 1.1514610310e-1F;
  p = p * t + 1.1676998740e-1F;
  p = p * t - 1.2420140846e-1F;
  p = p * t + 1.4249322787e-1F;
  p = p * t - 1.6668057665e-1F;
  p = p * t + 2.0000714765e-1F;
  p = p * t - 2.4999993993e-1F;
  p = p * t + 3.3333331174e-1F;
  return __builtin_convertvector(exponent, Lanes<float>) * 0.6931471806F + (t + t2 * (t * p - 0.5F));
}
LUMI_INLINE Lanes<double> LaneLog(Lanes<double> x) {
  using I = LaneTypes<double>::I;
  const I bits = (I)x, exponent = (bits - 0x3fe6a09e667f3bcdLL) >> 52;
  const Lanes<double> m = (Lanes<double>)(bits - (exponent << 52));
  const Lanes<double> z = (m - 1) / (m + 1), z2 = z * z;
  Lanes<double> series = 2.0 / 15 + z2 * (2.0 / 17);
  series = 2.0 / 13 + z2 * series;
  series = 2.0 / 11 + z2 * series;
  series = 2.0 / 9 + z2 * series;
  series = 2.0 / 7 + z2 * series;
  series = 2.0 / 5 + z2 * series;
  series = 2.0 / 3 + z2 * series;
  series = 2.0 + z2 * series;
  // The exponent to double through the mantissa of 1.5 * 2^52: AVX2 has no conversion of 64-bit integers.
  const Lanes<double> e = (Lanes<double>)(exponent + 0x4338000000000000LL) - 6755399441055744.0;
  return e * 0.69314718055994530942 + z * series;
}

}  // namespace lumi
