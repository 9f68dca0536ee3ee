#include "render/radiance/optimum/lane_solver.h"

#include "render/radiance/dissimilarity.h"

#include <algorithm>
#include <cmath>

#include "render/radiance/optimum/leaves_fit_lanes.h"
#include "scene/program/registers.h"

namespace lumi {
namespace {

// Steps of conjugate gradients before a lane is handed to Cholesky: a condition of about 150 (float), 2000 (double).
template <class T>
constexpr int kMaxSteps = sizeof(T) == 4 ? 64 : 256;

// The directions' means over the lanes and their largest distance from it: by the triangle inequality two photos'
// directions differ in every lane by at least the means' distance less both spreads.
template <class T, int kBytes>
LUMI_INLINE void MeanAndSpread(LaneSystem<T, kBytes>& s) {
  using V = Lanes<T, kBytes>;
  for (int i = 0; i < s.count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    V d2{};
    for (std::size_t c = 0; c < 3; ++c) {
      const V u = s.u[c][k].v;
      T sum = 0;
      for (int l = 0; l < kLaneCount<T, kBytes>; ++l) sum += u[l];
      const T m = sum / T(kLaneCount<T, kBytes>);
      s.mean[c][k] = static_cast<float>(m);
      const V d = u - m;
      d2 += d * d;
    }
    // Rounding of the mean to float: 1e-6 covers it.
    s.spread[k] = static_cast<float>(std::sqrt(-Smallest(-d2))) + 1e-6F;
  }
}

LUMI_INLINE int Candidates(int i, int count, float reach, const float* __restrict mx, const float* __restrict my,
                           const float* __restrict mz, const float* __restrict spread,
                           std::int32_t* __restrict near_flag, std::int32_t* __restrict out) {
  const float x = mx[i], y = my[i], z = mz[i], own = reach + spread[i];
  for (int j = i + 1; j < count; ++j) {
    const float dx = mx[j] - x, dy = my[j] - y, dz = mz[j] - z, bound = own + spread[j];
    near_flag[j] = dx * dx + dy * dy + dz * dz < bound * bound ? 1 : 0;
  }
  int found = 0;
  for (int j = i + 1; j < count; ++j) {
    out[found] = j;
    found += near_flag[j];
  }
  return found;
}

template <class T, int kBytes>
LUMI_INLINE void Assemble(const LeavesFit<T>& fit, LaneSystem<T, kBytes>& system, std::int32_t* flag,
                          std::int32_t* candidate) {
  using V = Lanes<T, kBytes>;
  const int n = system.count;
  const LaneBlock<T, kBytes>*ux = system.u[0].data(), *uy = system.u[1].data(), *uz = system.u[2].data(),
                     *f = system.f.data();
  const float reach = std::sqrt(static_cast<float>(fit.c2_max)) * (1 + 1e-6F);
  const T near_chord = fit.y_near / fit.y_from_theta, c2_near = near_chord * near_chord;
  const V c2_max = Broadcast<V>(fit.c2_max);
  std::size_t used = 0;
  for (int i = 0; i < n; ++i) {
    system.first[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(used);
    const int found = Candidates(i, n, reach, system.mean[0].data(), system.mean[1].data(), system.mean[2].data(),
                                 system.spread.data(), flag, candidate);
    if (system.s.size() < used + static_cast<std::size_t>(found)) {
      system.s.resize(2 * used + static_cast<std::size_t>(found));
      system.column.resize(system.s.size());
    }
    LaneBlock<T, kBytes>* s = system.s.data();
    const V xi = ux[i].v, yi = uy[i].v, zi = uz[i].v, fi = f[i].v;
    for (int k = 0; k < found; ++k) {
      const int j = candidate[k];
      const V dx = ux[j].v - xi, dy = uy[j].v - yi, dz = uz[j].v - zi;
      V c2 = dx * dx + dy * dy + dz * dz;
      const T smallest = Smallest(c2);
      if (!(smallest < fit.c2_max)) continue;
      c2 = LaneMin(c2, c2_max);
      V y = LaneSqrt(FitSquaredAngle(fit, c2)) * fit.y_from_theta;
      for (int c = 0; c < system.channels; ++c) {
        const LaneBlock<T, kBytes>* e = system.channel[c].data();
        y = WithTerm(y, T(1), e[i].v, e[j].v);
      }
      s[used].v = fi * f[j].v * FitPSame(fit, y, smallest <= c2_near);
      system.column[used] = j;
      ++used;
    }
  }
  system.first[static_cast<std::size_t>(n)] = static_cast<std::int32_t>(used);
  system.pairs = used;
}

// out = S p
template <class T, int kBytes>
LUMI_INLINE void Multiply(const LaneSystem<T, kBytes>& system, const LaneBlock<T, kBytes>* p,
                          LaneBlock<T, kBytes>* out) {
  using V = Lanes<T, kBytes>;
  const int n = system.count;
  const std::int32_t *first = system.first.data(), *column = system.column.data();
  const LaneBlock<T, kBytes>* s = system.s.data();
  const V diagonal = Broadcast<V>(system.diagonal);
  for (int i = 0; i < n; ++i) out[i].v = diagonal * p[i].v;
  for (int i = 0; i < n; ++i) {
    const V pi = p[i].v;
    V sum = out[i].v;
    for (std::int32_t k = first[i]; k < first[i + 1]; ++k) {
      const V a = s[k].v;
      const std::int32_t j = column[k];
      sum += a * p[j].v;
      out[j].v += a * pi;
    }
    out[i].v = sum;
  }
}

template <class T, int kBytes>
LUMI_INLINE void ConjugateGradients(LaneSystem<T, kBytes>& system, const LaneBlock<T, kBytes>* b,
                                    LaneBlock<T, kBytes>* x, T tolerance) {
  using V = Lanes<T, kBytes>;
  const int n = system.count;
  LaneBlock<T, kBytes>*r = system.r.data(), *p = system.p.data(), *q = system.q.data();
  V rr{};
  for (int i = 0; i < n; ++i) {
    const V v = b[i].v;
    x[i].v = V{};
    r[i].v = v;
    p[i].v = v;
    rr += v * v;
  }
  const V stop = rr * (tolerance * tolerance), zero{}, one = Broadcast<V>(1);
  V indefinite{};
  int step = 0;
  for (;; ++step) {
    const V open = rr > stop ? one : zero;
    if (!(Smallest(-open) < 0) || step == kMaxSteps<T>) break;
    Multiply(system, p, q);
    V pq{};
    for (int i = 0; i < n; ++i) pq += p[i].v * q[i].v;
    const V down = pq > zero ? zero : open;
    indefinite = LaneMax(indefinite, down);
    const V go = open * (one - indefinite);
    const V a = go > zero ? rr / (go > zero ? pq : one) : zero;
    V next{};
    for (int i = 0; i < n; ++i) {
      x[i].v += a * p[i].v;
      const V v = r[i].v - a * q[i].v;
      r[i].v = v;
      next += v * v;
    }
    const V c = go > zero ? next / (go > zero ? rr : one) : zero;
    for (int i = 0; i < n; ++i) p[i].v = r[i].v + c * p[i].v;
    // A lane that met no descent is closed: its flag says so.
    rr = indefinite > zero ? zero : next;
  }
  system.steps = std::max(system.steps, step);
  for (int l = 0; l < kLaneCount<T, kBytes>; ++l)
    if (!(rr[l] <= stop[l]) || indefinite[l] > 0) system.solved[static_cast<std::size_t>(l)] = false;
}

template <class T, int kBytes>
LUMI_INLINE void SolveLanes(const LeavesFit<T>& fit, T tolerance, bool also_z, LaneSystem<T, kBytes>& system,
                            std::int32_t* flag, std::int32_t* candidate) {
  MeanAndSpread(system);
  Assemble(fit, system, flag, candidate);
  system.solved.fill(true);
  system.steps = 0;
  ConjugateGradients(system, system.y.data(), system.w.data(), tolerance);
  if (also_z) ConjugateGradients(system, system.f.data(), system.z.data(), tolerance);
}

template <class T, int kBytes>
LUMI_INLINE void PlaceLanes(const LeavesFit<T>& fit, const float* const* D, const LanePoints<T, kBytes>& p,
                            const T* desired, LaneSystem<T, kBytes>& system) {
  using V = Lanes<T, kBytes>;
  V point[3];
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t l = 0; l < static_cast<std::size_t>(kLaneCount<T, kBytes>); ++l) point[c][l] = p[c][l];
  const V px = point[0], py = point[1], pz = point[2];
  // A photo (or the view) at the proxy point has no direction; any will do, but not 0/0.
  const V tiny = Broadcast<V>(T(1e-30)), one = Broadcast<V>(1);
  const V back = -one / LaneSqrt(LaneMax(px * px + py * py + pz * pz, tiny));
  const V c2_max = Broadcast<V>(fit.c2_max);
  for (std::size_t i = 0; i < static_cast<std::size_t>(system.count); ++i) {
    const V x = T(D[0][i]) - px, y = T(D[1][i]) - py, z = T(D[2][i]) - pz;
    const V scale = one / LaneSqrt(LaneMax(x * x + y * y + z * z, tiny));
    const V ux = x * scale, uy = y * scale, uz = z * scale;
    system.u[0][i].v = ux;
    system.u[1][i].v = uy;
    system.u[2][i].v = uz;
    V h;
    if constexpr (sizeof(T) == 4) {
      h = system.y[i].v * fit.y_from_theta;
    } else {
      const V dx = ux - px * back, dy = uy - py * back, dz = uz - pz * back;
      const V c2 = dx * dx + dy * dy + dz * dz;
      // Beyond reach the polynomial is not defined, and nothing correlates.
      h = c2 < c2_max ? LaneSqrt(FitSquaredAngle(fit, LaneMin(c2, c2_max))) * fit.y_from_theta : one;
    }
    for (int c = 0; c < system.channels; ++c) h = WithTerm(h, T(1), Broadcast<V>(desired[c]), system.channel[c][i].v);
    system.y[i].v = system.f[i].v * FitPSame(fit, h, true);
  }
}

#define LUMI_LANE_KERNELS(T, kBytes)                                                                                  \
  LUMI_WITH_##kBytes void SolveKernel(const LeavesFit<T>& fit, T tolerance, bool also_z,                              \
                                      LaneSystem<T, kBytes>& system, std::int32_t* lists) {                           \
    SolveLanes(fit, tolerance, also_z, system, lists, lists + system.count);                                          \
  }                                                                                                                   \
  LUMI_WITH_##kBytes void PlaceKernel(const LeavesFit<T>& fit, const float* const* D, const LanePoints<T, kBytes>& p, \
                                      const T* desired, LaneSystem<T, kBytes>& system) {                              \
    PlaceLanes(fit, D, p, desired, system);                                                                           \
  }
LUMI_LANE_KERNELS(float, 64)
LUMI_LANE_KERNELS(float, 32)
LUMI_LANE_KERNELS(float, 16)
LUMI_LANE_KERNELS(double, 64)
LUMI_LANE_KERNELS(double, 32)
LUMI_LANE_KERNELS(double, 16)

}  // namespace

template <class T, int kBytes>
void LaneSystem<T, kBytes>::Resize(int photos, int channels_used) {
  const auto n = static_cast<std::size_t>(photos);
  count = photos;
  channels = channels_used;
  if (f.size() >= n && !first.empty()) return;
  for (auto* v : {&u[0], &u[1], &u[2], &f, &y, &w, &z, &r, &p, &q}) v->resize(n);
  for (auto& c : channel) c.resize(n);
  for (auto& m : mean) m.resize(n);
  spread.resize(n);
  first.resize(3 * n + 1);  // rows; then two lists of candidates
}

template <class T, int kBytes>
void Solve(const LeavesFit<T>& fit, T tolerance, bool also_z, LaneSystem<T, kBytes>& system) {
  SolveKernel(fit, tolerance, also_z, system, system.first.data() + system.count + 1);
}
template <class T, int kBytes>
void Place(const LeavesFit<T>& fit, const float* const (&D)[3], const LanePoints<T, kBytes>& p,
           const T (&desired)[kMaxChannels], LaneSystem<T, kBytes>& system) {
  PlaceKernel(fit, D, p, desired, system);
}

#define LUMI_LANE_ENTRIES(T, kBytes)                                                               \
  template struct LaneSystem<T, kBytes>;                                                           \
  template void Solve(const LeavesFit<T>&, T, bool, LaneSystem<T, kBytes>&);                       \
  template void Place(const LeavesFit<T>&, const float* const(&)[3], const LanePoints<T, kBytes>&, \
                      const T(&)[kMaxChannels], LaneSystem<T, kBytes>&);
LUMI_LANE_ENTRIES(float, 64)
LUMI_LANE_ENTRIES(float, 32)
LUMI_LANE_ENTRIES(float, 16)
LUMI_LANE_ENTRIES(double, 64)
LUMI_LANE_ENTRIES(double, 32)
LUMI_LANE_ENTRIES(double, 16)

}  // namespace lumi
