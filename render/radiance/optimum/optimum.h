// The optimal weights at rays (thesis chapter 4, corrected as docs/optimum.md says): S w = y over the photos within
// settings.cutoff_rad of the ray,
// - Combine::kSmooth: S_ij = f_i f_j R(h_ij) off the diagonal, 1 on it, y_i = f_i R(h_i): a blind photo's weight is
//   exactly 0,
// - Combine::kAdditive: S_ij = R(h_ij), y_i = R(h_i) with h growing by gamma 2 r_max |f_i - f_j| (Eq. 4.7),
// R the falling leaves' P_same, h_ij = alpha theta_ij + 2 r_max sum over the measures' terms of factor |value_i -
// value_j|, the view itself having f = 1 and each term's kOwn, and f standing for field of view times visibility.
//
// Three paths, chosen by settings.accuracy: as many rays at a time as a register holds in float (to kFloatAccuracy) or
// double (to kLaneAccuracy), or ray by ray with Cholesky in double. The parts are in optimum/, one idea a file.
#pragma once

#include <cstdint>
#include <span>

#include "render/radiance/rays.h"
#include "render/radiance/settings.h"
#include "render/radiance/visibility.h"

namespace lumi {

struct ViewSetup;

// settings.accuracy below these needs the next path.
constexpr double kFloatAccuracy = 1e-4;
constexpr double kLaneAccuracy = 1e-7;
// Samples whose weights sum to less than this are counted: the optimum says little there.
constexpr double kSmallSum = 0.05;

// What happened, for the summary.
struct OptimumCounts {
  long samples = 0;        // rays that some photo sees
  long cameras = 0;        // photos that correlate with their ray (y > 0), over all samples
  long dense = 0;          // samples that needed Cholesky in double although the lanes were asked
  long nugget_raised = 0;  // S needed more than the standard nugget on its diagonal
  long indefinite = 0;     // eigenvalues were clipped
  long small_sums = 0;     // sum of the weights below kSmallSum before it was made 1
  OptimumCounts& operator+=(const OptimumCounts& o);
};

// Replaces `table`, adds to `counts`. Rays are solved in groups of neighbours, whatever their order, so pass many at
// once. A ray's result depends on its group by less than settings.accuracy. Weights that are exactly 0 are left out. A
// ray that misses the proxy, or that no photo sees, has alpha 0 and no entries. settings.correlation is not read.
void WeighOptimal(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                  OptimumCounts& counts);

// Registers of 64 bytes are AVX-512's, of 32 AVX2's, of 16 everyone's.
enum class LaneWidth { k16 = 16, k32 = 32, k64 = 64 };  // bytes
// What this machine has, widest first: the first is what WeighOptimal takes.
std::span<const LaneWidth> LaneWidths();
// The same by narrower registers, for tests and measurements. `width`: one of LaneWidths().
void WeighOptimal(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                  OptimumCounts& counts, LaneWidth width);

}  // namespace lumi
