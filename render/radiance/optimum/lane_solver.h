// S w = y for as many neighbouring rays as a register has lanes. Two facts make it cheap: S is sparse (no two photos
// more than 2 r_max apart at the point correlate), with nearly one pattern for all the rays, so that each pair of
// photos is tested once for all of them; and it is well conditioned (r_min acts like noise: two photos 0.02 degrees
// apart correlate by 0.4 only), so that conjugate gradients need about ten products with it, where Cholesky fills it
// in.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/radiance/measures/list.h"
#include "render/radiance/optimum/lanes.h"
#include "render/radiance/optimum/leaves_fit.h"

namespace lumi {

template <class T, int kBytes>
struct alignas(kBytes) LaneBlock {
  Lanes<T, kBytes> v;
};

// Further terms of h, beside the angle: those of the measures, and Eq. 4.7's.
constexpr int kMaxChannels = kTermCount + 1;

// Rays are lanes. A lane without a ray, or a photo that a lane's ray does not see, has f = 0: its row is the
// identity's, and its weight exactly 0.
template <class T, int kBytes>
struct LaneSystem {
  static constexpr int kRays = kLaneCount<T, kBytes>;
  using Block = LaneBlock<T, kBytes>;

  // Set by the caller, `count` entries each.
  T diagonal = 1;  // of S: 1 + noise
  int count = 0;
  std::vector<Block> u[3];                   // unit directions from the proxy point to the photos' centres
  std::vector<Block> f;                      // the factor of a row and a column: S_ij = f_i f_j R(h_ij)
  std::vector<Block> y;                      // right-hand side
  std::vector<Block> channel[kMaxChannels];  // h_ij / (2 r_max) grows by |difference| of each of the first `channels`
  int channels = 0;

  // Results.
  std::vector<Block> w;            // S w = y
  std::vector<Block> z;            // S z = f, where it was asked for
  std::array<bool, kRays> solved;  // false: not positive definite along the way, or too many steps
  int steps = 0;                   // of conjugate gradients, the most of the lanes
  std::size_t pairs = 0;           // of photos that correlate for some lane

  // Memory.
  std::vector<Block> s, r, p, q;  // S's entries right of the diagonal, row by row; CG's vectors
  std::vector<std::int32_t> first, column;
  std::vector<float> mean[3], spread;  // of u over the lanes

  void Resize(int photos, int channels_used);
};

// One ray a lane: the proxy point less the view's centre, p[coordinate][lane].
template <class T, int kBytes>
using LanePoints = std::array<std::array<T, kLaneCount<T, kBytes>>, 3>;

// Fills u from the photos' centres D less the view's (`count` of each), then turns y from the angle between the ray and
// the photo into the right-hand side f R(alpha angle + 2 r_max sum |desired_c - channel_c|). In float the caller's
// angles are used: formed from D x d they are ten times better than those from u; in double y is not read and the chord
// serves.
template <class T, int kBytes>
void Place(const LeavesFit<T>& fit, const float* const (&D)[3], const LanePoints<T, kBytes>& p,
           const T (&desired)[kMaxChannels], LaneSystem<T, kBytes>& system);

// Fills w (and z). `tolerance`: of the residual, relative to the right-hand side.
template <class T, int kBytes>
void Solve(const LeavesFit<T>& fit, T tolerance, bool also_z, LaneSystem<T, kBytes>& system);

}  // namespace lumi
