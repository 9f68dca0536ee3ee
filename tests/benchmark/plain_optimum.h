// The thesis's optimum as it is written down (sec. 4.3): all photos at each ray, S filled pair by pair, Cholesky in
// double. The baseline of optimum_bench; compiled with every instruction of the machine that measures, as the kernels
// that it is compared with are.
#pragma once

#include "render/radiance/correlation.h"

namespace lumi::test {

// A point that `photos` photos look at: their centres less the viewer's, f and angle to the viewer's ray (rad) of each.
struct PlainSample {
  int photos = 0;
  const float *dx = nullptr, *dy = nullptr, *dz = nullptr;
  const float *f = nullptr, *theta = nullptr;
  double point[3] = {0, 0, 0};  // less the viewer's centre
  double nugget = 0;            // on S's diagonal
};

// The sum of the weights.
double SolvePlainly(const PlainSample& sample, const FallingLeaves& leaves);

}  // namespace lumi::test
