#include "render/cpu/candidate_weights.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

#include "render/radiance/dissimilarity.h"
#include "render/radiance/kernel.h"
#include "render/radiance/measures/photo_sight.h"
#include "render/radiance/measures/visibility.h"
#include "render/radiance/settings.h"
#include "scene/program/registers.h"

namespace lumi {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLanes = 16;
// The window's edge at a (k+1)-way tie, where all weights would vanish: the float before 1, so that exactly the tied
// photos share the weight.
constexpr float kTied = 1 - std::numeric_limits<float>::epsilon() / 2;

struct RayBatch {
  alignas(64) float x[kBatch], y[kBatch], z[kBatch];  // rays of depth 1, and
  alignas(64) float squared[kBatch];                  // their squared length
  alignas(64) float h1[kBatch], edge[kBatch], sum[kBatch], f[kBatch];
};

LUMI_KERNEL void Rays(const LayerBatch& b, const CandidateRule& rule, RayBatch& rays) {
  const Linear rx = rule.ray_x, ry = rule.ray_y, rz = rule.ray_z;
  const int n = b.padded();
  const float* __restrict bx = b.x;
  const float* __restrict by = b.y;
  for (int i = 0; i < n; ++i) {
    const float x = rx.c + rx.x * bx[i] + rx.y * by[i], y = ry.c + ry.x * bx[i] + ry.y * by[i],
                z = rz.c + rz.x * bx[i] + rz.y * by[i];
    rays.x[i] = x;
    rays.y[i] = y;
    rays.z[i] = z;
    rays.squared[i] = x * x + y * y + z * z;
    rays.f[i] = 0;
  }
}

// Where the batch's pixels lie for a photo: what measures ask of it (radiance/measures/record.h).
template <Resolution kStretch>
struct PixelSight {
  const LayerBatch& b;
  const RayBatch& rays;
  const CandidateRay& c;
  const PlaneSlopes* slopes;
  int i;
  const PhotoField* of = nullptr;  // the measure's; read by field()

  // The angle at the point, atan2(|D x d|, t - D.d), both arguments times |ray| / depth.
  LUMI_INLINE float theta() const {
    const float x = rays.x[i], y = rays.y[i], z = rays.z[i], s = b.inverse_depth[i];
    const float cx = c.dy * z - c.dz * y, cy = c.dz * x - c.dx * z, cz = c.dx * y - c.dy * x;
    return AtanPositive(std::sqrt(cx * cx + cy * cy + cz * cz) * s,
                        rays.squared[i] - (c.dx * x + c.dy * y + c.dz * z) * s);
  }
  LUMI_INLINE float At(const Linear& f) const { return f.c + f.x * b.x[i] + f.y * b.y[i] + f.d * b.inverse_depth[i]; }
  LUMI_INLINE float w_by_depth() const { return At(c.map.w); }  // depth in the photo over that in the view
  LUMI_INLINE float Inverse(float w) const { return 1.0F / (w > 0 ? w : 1.0F); }
  LUMI_INLINE float u() const { return At(c.map.u) * Inverse(w_by_depth()); }
  LUMI_INLINE float v() const { return At(c.map.v) * Inverse(w_by_depth()); }
  LUMI_INLINE float w() const { return w_by_depth() / b.inverse_depth[i]; }
  LUMI_INLINE float width() const { return c.width_px; }
  LUMI_INLINE float height() const { return c.height_px; }
  LUMI_INLINE float field() const {
    return FieldAt(of->Of(c.view).data(), of->columns, of->rows, u(), v(), c.width_px, c.height_px);
  }
  LUMI_INLINE float stretch() const {
    if constexpr (kStretch == Resolution::kDistance) {
      const float s = b.inverse_depth[i];
      const float px = rays.x[i] - c.dx * s, py = rays.y[i] - c.dy * s, pz = rays.z[i] - c.dz * s;
      return c.focal_ratio * std::sqrt((px * px + py * py + pz * pz) / rays.squared[i]);
    } else {
      const float w = w_by_depth(), x = u(), y = v();
      const Linear &mu = c.map.u, &mv = c.map.v, &mw = c.map.w;
      const float sigma =
          PlaneStretch(mu.x - x * mw.x, mu.y - x * mw.y, mv.x - y * mw.x, mv.y - y * mw.y, mu.d - x * mw.d,
                       mv.d - y * mw.d, slopes->dx[i], slopes->dy[i], slopes->facing[i], w);
      return w > 0 ? sigma : 1e12F;
    }
  }
};

// What a term adds to h.
template <typename M, Resolution kStretch>
LUMI_KERNEL void AddTerm(const LayerBatch& b, const RayBatch& rays, const CandidateRay& given,
                         const PlaneSlopes* slopes, const typename M::Shape& given_shape, const PhotoField* field,
                         float scale, float* __restrict terms) {
  const CandidateRay c = given;
  const typename M::Shape shape = given_shape;
  const int n = b.padded();
  for (int i = 0; i < n; ++i)
    terms[i] = WithTerm(terms[i], scale, static_cast<float>(M::kOwn),
                        M::Value(PixelSight<kStretch>{b, rays, c, slopes, i, field}, shape));
}

// Adds all terms that differ from pixel to pixel; returns false if there are none.
bool AddTerms(const LayerBatch& b, const RayBatch& rays, const CandidateRay& c, const CandidateRule& rule,
              float* terms) {
  const RadianceSettings& s = *rule.settings;
  bool any = false;
  ForEachTerm([&]<typename M> {
    if constexpr (PixelTerm<M>) {
      if (!(M::Factor(s) > 0)) return;
      if (!any) std::fill_n(terms, b.padded(), c.terms);
      any = true;
      const auto scale = static_cast<float>(M::Factor(s) * 2 * s.r_max_rad);
      const PhotoField* field = &(*rule.fields)[MeasureList::IndexOf<M>()];
      (s.resolution == Resolution::kJacobian
           ? AddTerm<M, Resolution::kJacobian>
           : AddTerm<M, Resolution::kDistance>)(b, rays, c, rule.slopes, M::ShapeOf(s), field, scale, terms);
    }
  });
  return any;
}

// Field of view of a photo. kInner: it contains all pixels, feather excluded (f = 1, and its u, v, w are not needed).
// kSoft: it fades. kHard: weights take f = 1 everywhere, and f_out says whether it contains the pixel.
enum class Field { kInner, kSoft, kHard };

// Computes h without visibility, f, and (except for Field::kInner) the arguments of Visibility. `terms`: read if
// kTerms.
template <Field kField, bool kTerms>
LUMI_KERNEL void Measure(const LayerBatch& b, const CandidateRay& given, const CandidateRule& rule, RayBatch& rays,
                         const float* __restrict terms, float* __restrict h_out, float* __restrict f_out,
                         float* __restrict u_out, float* __restrict v_out, float* __restrict w_out) {
  const CandidateRay c = given;
  const float alpha = rule.alpha, gamma = rule.gamma, feather = 1 / c.feather_px;
  const int n = b.padded();
  float* __restrict f_largest = rays.f;
  for (int i = 0; i < n; ++i) {
    const PixelSight<Resolution::kOff> at{b, rays, c, nullptr, i, nullptr};
    const float g = alpha * at.theta() + (kTerms ? terms[i] : c.terms);
    if constexpr (kField == Field::kInner) {
      h_out[i] = g;
      f_out[i] = 1;
      f_largest[i] = 1;
      continue;
    }
    const float w = at.w_by_depth(), u = at.u(), v = at.v();
    const float edge = std::min(std::min(u, c.width_px - u), std::min(v, c.height_px - v));
    const bool seen = (w > 0) & (edge >= 0);
    // With field of view off h is never infinite.
    const float f = seen ? (kField == Field::kSoft ? std::max(RaisedCosine(edge * feather), kBarelySeen) : 1.0F) : 0.0F;
    h_out[i] = kField == Field::kSoft ? Dissimilarity(g, f, gamma) : g;
    f_out[i] = f;
    u_out[i] = u;
    v_out[i] = v;
    w_out[i] = w / b.inverse_depth[i];
    f_largest[i] = std::max(f_largest[i], f);
  }
}

// Applies VisibilityMaps::Visibility to h.
LUMI_KERNEL void Visibility(int n, const CandidateRay& c, const CandidateRule& rule, const float* __restrict f,
                            const float* __restrict u, const float* __restrict v, const float* __restrict depth,
                            float* __restrict h) {
  const float* __restrict map = c.depth_map;
  const int width = rule.map_width, right = width - 1, low = rule.map_height - 1;
  const float su = static_cast<float>(width) / c.width_px, sv = static_cast<float>(rule.map_height) / c.height_px;
  const float gamma = rule.gamma;
  const bool soft = rule.field_of_view;
  const float least = soft ? 0.0F : 1.0F;
  // With field of view off, points outside a photo are looked up at its border, and points behind it are not.
  const float* asked = soft ? f : depth;
  for (int i = 0; i < n; ++i) {
    const float x = std::min(std::max(0.0F, u[i] * su - 0.5F), static_cast<float>(right));
    const float y = std::min(std::max(0.0F, v[i] * sv - 0.5F), static_cast<float>(low));
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const int x1 = std::min(x0 + 1, right), y1 = std::min(y0 + 1, low);
    const float ax = x - static_cast<float>(x0), ay = y - static_cast<float>(y0);
    const float top =
        (1 - ax) * SeenPast(depth[i], map[y0 * width + x0]) + ax * SeenPast(depth[i], map[y0 * width + x1]);
    const float bottom =
        (1 - ax) * SeenPast(depth[i], map[y1 * width + x0]) + ax * SeenPast(depth[i], map[y1 * width + x1]);
    const float seen = VisibilityOf((1 - ay) * top + ay * bottom);
    const float value = std::max(f[i], least);
    const float blocked = WithGate(h[i], value > 0 ? value : 1.0F, seen, gamma);
    // Selected by bits: from a condition the compiler would make a branch around the division and not vectorise.
    const std::int32_t counts = -static_cast<std::int32_t>((h[i] > 0) & (value > 0) & (asked[i] > 0));
    h[i] = std::bit_cast<float>((std::bit_cast<std::int32_t>(blocked) & counts) |
                                (std::bit_cast<std::int32_t>(h[i]) & ~counts));
  }
}

// Moves the smaller of each pair to a, the larger to b.
template <class V>
LUMI_INLINE void Order(V& a, V& b) {
  const V smaller = a < b ? a : b;
  b = a < b ? b : a;
  a = smaller;
}

template <int kBytes>
LUMI_INLINE bool AnyLess(typename Register<kBytes>::Floats a, typename Register<kBytes>::Floats b) {
  const auto less = std::bit_cast<typename Register<kBytes>::Pairs>(a < b);
  std::uint64_t any = 0;
  for (int p = 0; p < Register<kBytes>::kNumbers / 2; ++p) any |= less[p];
  return any != 0;
}

// Puts h among the `rows` smallest so far of each pixel (rows of kBatch, the smallest first).
template <int kBytes>
LUMI_INLINE void InsertInto(int n, int rows, const float* __restrict h, float* __restrict smallest) {
  using V = typename Register<kBytes>::Floats;
  const float* last = smallest + (rows - 1) * kBatch;
  for (int base = 0; base < n; base += Register<kBytes>::kNumbers) {
    V v = LoadRegister<V>(h + base);
    // For most photos, h is larger than the last row at all of these pixels.
    if (!AnyLess<kBytes>(v, LoadRegister<V>(last + base))) continue;
    for (int s = 0; s < rows; ++s) {
      V least = LoadRegister<V>(smallest + s * kBatch + base);
      Order(least, v);
      StoreRegister(least, smallest + s * kBatch + base);
    }
  }
}
LUMI_WITH_64 void Insert64(int n, int rows, const float* h, float* smallest) { InsertInto<64>(n, rows, h, smallest); }
LUMI_WITH_32 void Insert32(int n, int rows, const float* h, float* smallest) { InsertInto<32>(n, rows, h, smallest); }
LUMI_WITH_16 void Insert16(int n, int rows, const float* h, float* smallest) { InsertInto<16>(n, rows, h, smallest); }
void Insert(int n, int rows, const float* h, float* smallest) {
  static const auto insert = WidestRegister() == 64 ? Insert64 : WidestRegister() == 32 ? Insert32 : Insert16;
  insert(n, rows, h, smallest);
}

// Whether any of kLanes pixels has a finite h that is at most `last`.
LUMI_INLINE bool Counts(const float* __restrict h, const float* __restrict last) {
  int counts = 0;
  for (int i = 0; i < kLanes; ++i) counts += (h[i] <= last[i]) & (h[i] < kInfinity);
  return counts > 0;
}

// Applies visibility to the h of all photos where it can matter. Visibility only raises h: a photo that is not among
// the k + 1 smallest so far without it cannot be among them with it, so its depth map is not read and its weight is 0
// either way. Photos are visited in ascending order of h at the batch's middle, so that those likely to count come
// first. `smallest` gets the k + 1 smallest h of each pixel.
struct SightRows {
  float *f, *u, *v, *w;  // rows of kBatch, as h
};
void AddVisibility(int n, const std::vector<CandidateRay>& candidates, const CandidateRule& rule, const SightRows& at,
                   float* h, float* smallest) {
  std::vector<std::size_t> order(candidates.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const float* middle = h + n / 2;
  std::ranges::stable_sort(order, {}, [&](std::size_t c) { return middle[c * kBatch]; });
  const float* last = smallest + rule.k * kBatch;
  for (const std::size_t c : order) {
    const std::size_t row = c * kBatch;
    // Runs of pixels that count.
    for (int from = 0; candidates[c].depth_map && from < n; from += kLanes) {
      int to = from;
      while (to < n && Counts(h + row + to, last + to)) to += kLanes;
      if (to == from) continue;
      const std::size_t first = row + static_cast<std::size_t>(from);
      Visibility(to - from, candidates[c], rule, at.f + first, at.u + first, at.v + first, at.w + first, h + first);
      from = to;
    }
    Insert(n, rule.k + 1, h + row, smallest);
  }
}

// From the smallest and the (k+1)st h of each pixel: h_1, and h_1 / h_{k+1} (kTied at a tie, 0 without a (k+1)st).
LUMI_KERNEL void Window(int n, const float* __restrict first, const float* __restrict last, float* __restrict h1_out,
                        float* __restrict edge_out) {
  for (int i = 0; i < n; ++i) {
    h1_out[i] = first[i];
    edge_out[i] = last[i] < kInfinity ? (last[i] == first[i] ? kTied : first[i] / last[i]) : 0.0F;
  }
}

// Replaces h by h_1/h_j - h_1/h_{k+1} and adds it to `sum`.
LUMI_KERNEL void Weights(int n, float* __restrict h, const float* __restrict h1, const float* __restrict edge,
                         float* __restrict sum) {
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

void WeighCandidates(LayerBatch& b, const std::vector<CandidateRay>& candidates, const CandidateRule& rule,
                     std::vector<float>& weights) {
  const int n = b.padded();
  // Per photo, rows for h, f and the arguments of Visibility; one row for the terms.
  const std::size_t rows = candidates.size();
  weights.resize(std::max(weights.size(), (5 * rows + 1) * kBatch));
  float* contained = weights.data() + rows * kBatch;
  float *u = contained + rows * kBatch, *v = u + rows * kBatch, *w = v + rows * kBatch, *terms = w + rows * kBatch;
  RayBatch rays;
  Rays(b, rule, rays);
  bool maps = false;
  for (std::size_t c = 0; c < rows; ++c) {
    const CandidateRay& ray = candidates[c];
    float *h = weights.data() + c * kBatch, *f = contained + c * kBatch;
    const bool inner = ray.inner && !ray.depth_map;
    const bool any = AddTerms(b, rays, ray, rule, terms);
    const auto measure = inner                ? (any ? Measure<Field::kInner, true> : Measure<Field::kInner, false>)
                         : rule.field_of_view ? (any ? Measure<Field::kSoft, true> : Measure<Field::kSoft, false>)
                                              : (any ? Measure<Field::kHard, true> : Measure<Field::kHard, false>);
    measure(b, ray, rule, rays, terms, h, f, u + c * kBatch, v + c * kBatch, w + c * kBatch);
    maps = maps || ray.depth_map;
  }
  alignas(64) float smallest[(kMaxBlend + 1) * kBatch];
  std::fill_n(smallest, (rule.k + 1) * kBatch, kInfinity);
  if (maps && rule.gamma > 0)
    AddVisibility(n, candidates, rule, {contained, u, v, w}, weights.data(), smallest);
  else
    for (std::size_t c = 0; c < rows; ++c) Insert(n, rule.k + 1, weights.data() + c * kBatch, smallest);
  Window(n, smallest, smallest + rule.k * kBatch, rays.h1, rays.edge);
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
