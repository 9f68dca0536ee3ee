#include "render/cpu/candidate_weights.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "render/radiance/kernel.h"
#include "render/radiance/measures/resolution.h"
#include "render/radiance/measures/visibility.h"
#include "render/radiance/settings.h"

namespace lumi {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLanes = 16;
// The window's edge at a (k+1)-way tie, where all weights would vanish: the float before 1, so that exactly the tied share.
constexpr float kTied = 1 - std::numeric_limits<float>::epsilon() / 2;

struct RayBatch {
  alignas(64) float x[kBatch], y[kBatch], z[kBatch];  // rays times 1, and
  alignas(64) float squared[kBatch];  // their squared length
  alignas(64) float h1[kBatch], edge[kBatch], sum[kBatch], f[kBatch];
};

LUMI_KERNEL void Rays(const LayerBatch& b, const CandidateRule& rule, RayBatch& rays) {
  const Linear rx = rule.ray_x, ry = rule.ray_y, rz = rule.ray_z;
  const int n = b.padded();
  const float* __restrict bx = b.x;
  const float* __restrict by = b.y;
  for (int i = 0; i < n; ++i) {
    const float x = rx.c + rx.x * bx[i] + rx.y * by[i], y = ry.c + ry.x * bx[i] + ry.y * by[i], z = rz.c + rz.x * bx[i] + rz.y * by[i];
    rays.x[i] = x;
    rays.y[i] = y;
    rays.z[i] = z;
    rays.squared[i] = x * x + y * y + z * z;
    rays.f[i] = 0;
  }
}

// Field of view: a photo that contains all pixels, feather excluded (f = 1, and where it sees them need not be known); one that
// fades; or f = 1 everywhere, and whether it contains the pixel is told by f_out.
enum class Field { kInner, kSoft, kHard };
// What h has beside the angle: nothing; a constant of the photo; that and its resolution.
enum class Term { kNone, kConstant, kDistance, kJacobian };

// h without visibility, f, and (not for Field::kInner) visibility's arguments.
template <Field kField, Term kTerm>
[[gnu::always_inline]] inline void Measure(const LayerBatch& b, const CandidateRay& c, const CandidateRule& rule, RayBatch& rays,
                                           float* __restrict h_out, float* __restrict f_out, float* __restrict u_out,
                                           float* __restrict v_out, float* __restrict w_out) {
  constexpr bool kMapped = kField != Field::kInner || kTerm == Term::kJacobian;
  const float dx = c.dx, dy = c.dy, dz = c.dz, alpha = rule.alpha, beta = rule.beta, gamma = rule.gamma;
  const float constant = c.time, focal_ratio = c.focal_ratio, low = rule.inverse_log_low, high = rule.inverse_log_high;
  const Linear mu = c.map.u, mv = c.map.v, mw = c.map.w;
  const float width = c.width_px, height = c.height_px, feather = 1 / c.feather_px;
  const int n = b.padded();
  const float* __restrict rx = rays.x;
  const float* __restrict ry = rays.y;
  const float* __restrict rz = rays.z;
  const float* __restrict squared = rays.squared;
  const float* __restrict bx = b.x;
  const float* __restrict by = b.y;
  const float* __restrict depth = b.inverse_depth;
  const float* __restrict slope_x = kTerm == Term::kJacobian ? rule.slopes->dx : nullptr;
  const float* __restrict slope_y = kTerm == Term::kJacobian ? rule.slopes->dy : nullptr;
  const float* __restrict facing = kTerm == Term::kJacobian ? rule.slopes->facing : nullptr;
  float* __restrict f_largest = rays.f;
  for (int i = 0; i < n; ++i) {
    const float x = rx[i], y = ry[i], z = rz[i], s = depth[i];
    // The angle at the point, atan2(|D x d|, t - D.d), both arguments times |ray| / depth.
    const float cx = dy * z - dz * y, cy = dz * x - dx * z, cz = dx * y - dy * x;
    float g = AtanPositive(std::sqrt(cx * cx + cy * cy + cz * cz) * s, squared[i] - (dx * x + dy * y + dz * z) * s);
    float u = 0, v = 0, w = 0, iw = 0;
    if constexpr (kMapped) {
      w = mw.c + mw.x * bx[i] + mw.y * by[i] + mw.d * s;
      iw = 1.0F / (w > 0 ? w : 1.0F);
      u = (mu.c + mu.x * bx[i] + mu.y * by[i] + mu.d * s) * iw;
      v = (mv.c + mv.x * bx[i] + mv.y * by[i] + mv.d * s) * iw;
    }
    if constexpr (kTerm != Term::kNone) g = alpha * g + constant;
    if constexpr (kTerm == Term::kDistance) {
      const float px = x - dx * s, py = y - dy * s, pz = z - dz * s;
      g += beta * (1 - ResolutionValue(focal_ratio * std::sqrt((px * px + py * py + pz * pz) / squared[i]), low, high));
    }
    if constexpr (kTerm == Term::kJacobian) {
      const float sigma = PlaneStretch(mu.x - u * mw.x, mu.y - u * mw.y, mv.x - v * mw.x, mv.y - v * mw.y, mu.d - u * mw.d,
                                       mv.d - v * mw.d, slope_x[i], slope_y[i], facing[i], w);
      const float value = ResolutionValue(sigma, low, high);
      g += beta * (1 - (w > 0 ? value : 0.0F));
    }
    if constexpr (kField == Field::kInner) {
      h_out[i] = g;
      f_out[i] = 1;
      f_largest[i] = 1;
      continue;
    }
    const float edge = std::min(std::min(u, width - u), std::min(v, height - v));
    const bool seen = (w > 0) & (edge >= 0);
    constexpr bool kSoft = kField == Field::kSoft;
    const float f = seen ? (kSoft ? RaisedCosine(edge * feather) : 1.0F) : 0.0F;
    // gamma (1/f - 1), infinite where the photo is blind; with field of view off it is never.
    const float penalised = kSoft ? g * (1.0F + gamma * (1.0F / (f > 0 ? f : 1.0F) - 1.0F)) : g;
    float h = !kSoft | (f > 0) ? penalised : kInfinity;
    h = (g == 0) & (seen | !kSoft) ? 0.0F : h;
    h_out[i] = h;
    f_out[i] = f;
    u_out[i] = u;
    v_out[i] = v;
    w_out[i] = w / s;
    f_largest[i] = std::max(f_largest[i], f);
  }
}

template <Term kTerm>
[[gnu::always_inline]] inline void MeasureIn(Field field, const LayerBatch& b, const CandidateRay& c, const CandidateRule& rule,
                                             RayBatch& rays, float* h, float* f, float* u, float* v, float* w) {
  if (field == Field::kInner)
    Measure<Field::kInner, kTerm>(b, c, rule, rays, h, f, u, v, w);
  else if (field == Field::kSoft)
    Measure<Field::kSoft, kTerm>(b, c, rule, rays, h, f, u, v, w);
  else
    Measure<Field::kHard, kTerm>(b, c, rule, rays, h, f, u, v, w);
}

using MeasureKernel = void(Field, const LayerBatch&, const CandidateRay&, const CandidateRule&, RayBatch&, float*, float*, float*, float*,
                           float*);
LUMI_KERNEL void MeasureAngle(Field field, const LayerBatch& b, const CandidateRay& c, const CandidateRule& rule, RayBatch& rays,
                              float* h, float* f, float* u, float* v, float* w) {
  MeasureIn<Term::kNone>(field, b, c, rule, rays, h, f, u, v, w);
}
LUMI_KERNEL void MeasureConstant(Field field, const LayerBatch& b, const CandidateRay& c, const CandidateRule& rule, RayBatch& rays,
                                 float* h, float* f, float* u, float* v, float* w) {
  MeasureIn<Term::kConstant>(field, b, c, rule, rays, h, f, u, v, w);
}
LUMI_KERNEL void MeasureDistance(Field field, const LayerBatch& b, const CandidateRay& c, const CandidateRule& rule, RayBatch& rays,
                                 float* h, float* f, float* u, float* v, float* w) {
  MeasureIn<Term::kDistance>(field, b, c, rule, rays, h, f, u, v, w);
}
LUMI_KERNEL void MeasureJacobian(Field field, const LayerBatch& b, const CandidateRay& c, const CandidateRule& rule, RayBatch& rays,
                                 float* h, float* f, float* u, float* v, float* w) {
  MeasureIn<Term::kJacobian>(field, b, c, rule, rays, h, f, u, v, w);
}

// VisibilityMaps::Visibility, into h.
LUMI_KERNEL void Visibility(int n, const CandidateRay& c, const CandidateRule& rule, const float* __restrict f, const float* __restrict u,
                            const float* __restrict v, const float* __restrict depth, float* __restrict h) {
  const float* __restrict map = c.depth_map;
  const int width = rule.map_width, right = width - 1, low = rule.map_height - 1;
  const float su = static_cast<float>(width) / c.width_px, sv = static_cast<float>(rule.map_height) / c.height_px;
  const float gamma = rule.gamma;
  const bool soft = rule.field_of_view;
  // With field of view off a photo is asked at its border for points outside, and not for points behind it.
  const float* asked = soft ? f : depth;
  for (int i = 0; i < n; ++i) {
    const float x = std::min(std::max(0.0F, u[i] * su - 0.5F), static_cast<float>(right));
    const float y = std::min(std::max(0.0F, v[i] * sv - 0.5F), static_cast<float>(low));
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, right), y1 = std::min(y0 + 1, low);
    const float ax = x - static_cast<float>(x0), ay = y - static_cast<float>(y0);
    const float top = (1 - ax) * SeenPast(depth[i], map[y0 * width + x0]) + ax * SeenPast(depth[i], map[y0 * width + x1]);
    const float bottom = (1 - ax) * SeenPast(depth[i], map[y1 * width + x0]) + ax * SeenPast(depth[i], map[y1 * width + x1]);
    const float seen = VisibilityOf((1 - ay) * top + ay * bottom);
    const float value = soft ? f[i] : 1.0F;
    const float factor = value > 0 ? (1 + gamma * (1 / (value * seen) - 1)) / (1 + gamma * (1 / value - 1)) : 1.0F;
    h[i] = (h[i] > 0) & (asked[i] > 0) ? h[i] * factor : h[i];
  }
}

// The smaller of each lane to a, the larger to b.
#if defined(__GNUC__) && !defined(__clang__)
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float)), may_alias));
[[gnu::always_inline]] inline void Order(Lanes& a, Lanes& b) {
  const Lanes smaller = a < b ? a : b;
  b = a < b ? b : a;
  a = smaller;
}
#else
struct Lanes {
  float v[kLanes];
};
inline void Order(Lanes& a, Lanes& b) {
  for (int i = 0; i < kLanes; ++i)
    if (b.v[i] < a.v[i]) std::swap(a.v[i], b.v[i]);
}
#endif

// The smallest and the (k+1)st of each pixel; a k known to the compiler keeps them in registers.
template <int kFixed>
[[gnu::always_inline]] inline void SmallestAndLast(int n, int candidates, int k_given, const float* __restrict h, float* __restrict h1_out,
                                                   float* __restrict edge_out) {
  const int k = kFixed > 0 ? kFixed : k_given;
  alignas(64) float infinite[kLanes], first[kLanes], last[kLanes];
  for (float& f : infinite) f = kInfinity;
  for (int base = 0; base < n; base += kLanes) {
    Lanes best[(kFixed > 0 ? kFixed : kMaxBlend) + 1];
#pragma GCC unroll 8
    for (int s = 0; s <= k; ++s) std::memcpy(&best[s], infinite, sizeof(Lanes));
    for (int c = 0; c < candidates; ++c) {
      Lanes v;
      std::memcpy(&v, h + c * kBatch + base, sizeof(Lanes));
#pragma GCC unroll 8
      for (int s = 0; s <= k; ++s) Order(best[s], v);
    }
    std::memcpy(first, &best[0], sizeof(Lanes));
    std::memcpy(last, &best[k], sizeof(Lanes));
    for (int i = 0; i < kLanes; ++i) {
      h1_out[base + i] = first[i];
      edge_out[base + i] = last[i] < kInfinity ? (last[i] == first[i] ? kTied : first[i] / last[i]) : 0.0F;
    }
  }
}

LUMI_KERNEL void WindowAny(int n, int candidates, int k, const float* h, float* h1, float* edge) {
  SmallestAndLast<0>(n, candidates, k, h, h1, edge);
}
LUMI_KERNEL void Window3(int n, int candidates, int k, const float* h, float* h1, float* edge) {
  SmallestAndLast<3>(n, candidates, k, h, h1, edge);
}
LUMI_KERNEL void Window4(int n, int candidates, int k, const float* h, float* h1, float* edge) {
  SmallestAndLast<4>(n, candidates, k, h, h1, edge);
}
LUMI_KERNEL void Window5(int n, int candidates, int k, const float* h, float* h1, float* edge) {
  SmallestAndLast<5>(n, candidates, k, h, h1, edge);
}

// h to h_1/h_j - h_1/h_{k+1}; their sum.
LUMI_KERNEL void Weights(int n, float* __restrict h, const float* __restrict h1, const float* __restrict edge, float* __restrict sum) {
  for (int i = 0; i < n; ++i) {
    const float ratio = h[i] == h1[i] ? 1.0F : h1[i] / std::max(h[i], 1e-37F);
    const float w = h[i] < kInfinity ? std::max(0.0F, ratio - edge[i]) : 0.0F;
    h[i] = w;
    sum[i] += w;
  }
}

LUMI_KERNEL void Scale(int n, const float* __restrict by, float* __restrict w) {
  for (int i = 0; i < n; ++i) w[i] *= by[i];
}

}  // namespace

void WeighCandidates(LayerBatch& b, const std::vector<CandidateRay>& candidates, const CandidateRule& rule, std::vector<float>& weights) {
  const int n = b.padded(), count = static_cast<int>(candidates.size());
  // One row more each for what a photo contains, where field of view is off, and for visibility's arguments.
  const std::size_t rows = candidates.size();
  weights.resize(std::max(weights.size(), (2 * rows + 4) * kBatch));
  float* contained = weights.data() + rows * kBatch;
  float *u = contained + rows * kBatch, *v = u + kBatch, *w = v + kBatch;
  RayBatch rays;
  Rays(b, rule, rays);
  MeasureKernel* const measure = rule.resolution == Resolution::kJacobian   ? MeasureJacobian
                                 : rule.resolution == Resolution::kDistance ? MeasureDistance
                                 : rule.time                                ? MeasureConstant
                                                                            : MeasureAngle;
  for (std::size_t c = 0; c < rows; ++c) {
    float *h = weights.data() + c * kBatch, *f = contained + c * kBatch;
    const bool inner = candidates[c].inner && !candidates[c].depth_map;
    measure(inner ? Field::kInner : rule.field_of_view ? Field::kSoft : Field::kHard, b, candidates[c], rule, rays, h, f, u, v, w);
    if (candidates[c].depth_map && rule.gamma > 0) Visibility(n, candidates[c], rule, f, u, v, w, h);
  }
  (rule.k == 3 ? Window3 : rule.k == 4 ? Window4 : rule.k == 5 ? Window5 : WindowAny)(n, count, rule.k, weights.data(), rays.h1, rays.edge);
  std::fill_n(rays.sum, n, 0.0F);
  for (std::size_t c = 0; c < rows; ++c) Weights(n, weights.data() + c * kBatch, rays.h1, rays.edge, rays.sum);
  for (int i = 0; i < n; ++i) {
    b.alpha[i] = !(rays.sum[i] > 0) ? 0.0F : rays.h1[i] == 0 ? 1.0F : std::min(1.0F, rays.f[i] / kAlphaFullAt);
    rays.sum[i] = rays.sum[i] > 0 ? 1 / rays.sum[i] : 0.0F;
  }
  for (std::size_t c = 0; c < rows; ++c) Scale(n, rays.sum, weights.data() + c * kBatch);
  if (rule.field_of_view) return;
  std::fill_n(b.alpha, n, 0.0F);
  for (std::size_t c = 0; c < rows; ++c) {
    Scale(n, contained + c * kBatch, weights.data() + c * kBatch);
    for (int i = 0; i < n; ++i) b.alpha[i] += weights[c * kBatch + static_cast<std::size_t>(i)];
  }
  for (int i = 0; i < n; ++i) b.alpha[i] = std::min(1.0F, b.alpha[i]);
}

}  // namespace lumi
