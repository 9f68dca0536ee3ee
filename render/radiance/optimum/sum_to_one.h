// The three ways in which the optimum's weights come to sum to 1 (thesis sec. 4.1, and the local mean, ours). S w = y
// holds for radiance of mean 0; far from all photos w -> 0, and the sum says how much of the estimate the mean must
// bring.
#pragma once

#include <cstdint>
#include <vector>

#include "render/radiance/settings.h"

namespace lumi {

// The least sum that weights are divided by. For smaller sums the local mean adds what is missing, so that no weight
// grows by more than 1/kSmallestSum and nothing jumps.
constexpr double kSmallestSum = 1e-3;

// w of the photos that have one, to sum 1 together with `mean`, the real-time weights m (their sum 1).
//   renormalise  w / s, s = sum w
//   constrained  w + (1 - s) z / sum z, z = S^-1 f: Lagrange's solution where every f is 1. With S^-1 1, as for f = 1,
//   a photo
//                would enter at once with a finite weight as soon as it sees the point.
//   local mean   w + (1 - s) m: the deviations from the mean m are estimated
// Returns the factor of m that is still to be added; w is changed in place. z is read by `constrained` only.
double SumToOne(WeightSum how, std::vector<double>& w, const std::vector<double>& z, double& sum_before);

}  // namespace lumi
