// How a photo's measures make its dissimilarity from a ray (thesis Eq. 4.7, corrected: docs/render.md), once for all of
// C++; its twin for the shaders is shader::kDissimilarity. T is float, double or a register of either.
//
//   g = alpha theta + sum over the terms of factor 2 r_max |own - value|
//   h = g (1 + gamma (1 / (f v) - 1)),  infinite where the photo is blind (f = 0), 0 where g is 0
//
// The view's own value stands for a photo that is the view; between two photos (the optimum's S_ij) the other's stands
// in its place.
#pragma once

#include <limits>

#include "render/radiance/kernel.h"

namespace lumi {

template <typename T>
LUMI_INLINE T Magnitude(T x) {
  return x > -x ? x : -x;
}

// g with one more term. scale: factor 2 r_max.
template <typename T, typename Scale>
LUMI_INLINE T WithTerm(T g, Scale scale, T own, T value) {
  return g + scale * Magnitude(own - value);
}

// What a gate in (0, 1] multiplies g by.
template <typename T>
LUMI_INLINE T Penalty(T gate, T gamma) {
  return T(1) + gamma * (T(1) / gate - T(1));
}

template <typename T>
LUMI_INLINE T Dissimilarity(T g, T gate, T gamma) {
  // Without branches, which would keep a loop scalar.
  const bool seen = gate > 0;
  const T h = g * Penalty(seen ? gate : T(1), gamma);
  const T finite = g > 0 ? h : T(0);
  return seen ? finite : std::numeric_limits<T>::infinity();
}

// h with a second gate v, from h with the first alone.
template <typename T>
LUMI_INLINE T WithGate(T h, T f, T v, T gamma) {
  return h * Penalty(f * v, gamma) / Penalty(f, gamma);
}

}  // namespace lumi
