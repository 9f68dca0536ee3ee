// Arithmetic on lanes.h, for kernels: include it only where they are compiled (render/CMakeLists.txt sets their
// options).
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "render/radiance/kernel.h"
#include "render/radiance/optimum/lanes.h"

namespace lumi {

template <class V>
LUMI_INLINE V Broadcast(LaneValue<V> x) {
  return x - V{};
}
template <class V>
LUMI_INLINE V LaneMin(V a, V b) {
  return a < b ? a : b;
}
template <class V>
LUMI_INLINE V LaneMax(V a, V b) {
  return a > b ? a : b;
}
template <class V>
LUMI_INLINE V LaneSqrt(V a) {
  alignas(sizeof(V)) LaneValue<V> x[kLanesOf<V>];
  *reinterpret_cast<V*>(x) = a;
  for (int l = 0; l < kLanesOf<V>; ++l) x[l] = std::sqrt(x[l]);
  return *reinterpret_cast<V*>(x);
}

// The lanes turned by `by` places; the smallest of them. Each turn halves what is left to compare.
template <int by, class V, int... lane>
LUMI_INLINE V TurnedLanes(V v, std::integer_sequence<int, lane...>) {
  return __builtin_shufflevector(v, v, (lane + by) % static_cast<int>(sizeof...(lane))...);
}
template <int by, class V>
LUMI_INLINE V Turned(V v) {
  return TurnedLanes<by>(v, std::make_integer_sequence<int, kLanesOf<V>>());
}
template <class V>
LUMI_INLINE LaneValue<V> Smallest(V v) {
  if constexpr (kLanesOf < V >> 8) v = LaneMin(v, Turned<8>(v));
  if constexpr (kLanesOf < V >> 4) v = LaneMin(v, Turned<4>(v));
  if constexpr (kLanesOf < V >> 2) v = LaneMin(v, Turned<2>(v));
  return LaneMin(v, Turned<1>(v))[0];
}

// Natural logarithm of positive, normal numbers: exponent, and mantissa m in [sqrt(1/2), sqrt(2)). Error below 2e-7
// (float), 1e-13 (double), absolute near 1 and relative elsewhere. In float by a polynomial of m - 1 (the coefficients
// are those of Cephes' logf: a division costs more), in double by the series of 2 atanh((m - 1)/(m + 1)).
template <class V>
requires std::is_same_v < LaneValue<V>,
float > LUMI_INLINE V LaneLog(V x) {
  using I = LaneIntegers<V>;
  const I bits = (I)x, exponent = (bits - 0x3f3504f3) >> 23;
  const V t = (V)(bits - (exponent << 23)) - 1.0F, t2 = t * t;
  V p = 7.0376836292e-2F * t - 1.1514610310e-1F;
  p = p * t + 1.1676998740e-1F;
  p = p * t - 1.2420140846e-1F;
  p = p * t + 1.4249322787e-1F;
  p = p * t - 1.6668057665e-1F;
  p = p * t + 2.0000714765e-1F;
  p = p * t - 2.4999993993e-1F;
  p = p * t + 3.3333331174e-1F;
  return __builtin_convertvector(exponent, V) * 0.6931471806F + (t + t2 * (t * p - 0.5F));
}
template <class V>
requires std::is_same_v < LaneValue<V>,
double > LUMI_INLINE V LaneLog(V x) {
  // Exponents by 1024 too large: AVX2 shifts 64-bit integers without their sign only.
  typedef std::uint64_t U __attribute__((vector_size(sizeof(V))));
  constexpr std::uint64_t kBias = std::uint64_t{1024} << 52;
  const U bits = (U)x, exponent = (bits + (kBias - 0x3fe6a09e667f3bcdULL)) >> 52;
  const V m = (V)(bits + kBias - (exponent << 52));
  const V z = (m - 1) / (m + 1), z2 = z * z;
  V series = 2.0 / 15 + z2 * (2.0 / 17);
  series = 2.0 / 13 + z2 * series;
  series = 2.0 / 11 + z2 * series;
  series = 2.0 / 9 + z2 * series;
  series = 2.0 / 7 + z2 * series;
  series = 2.0 / 5 + z2 * series;
  series = 2.0 / 3 + z2 * series;
  series = 2.0 + z2 * series;
  // The exponent to double through the mantissa of 1.5 * 2^52: AVX2 has no conversion of 64-bit integers.
  const V e = (V)(exponent + 0x4338000000000000ULL) - (6755399441055744.0 + 1024);
  return e * 0.69314718055994530942 + z * series;
}

}  // namespace lumi
