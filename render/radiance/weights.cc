#include "render/radiance/weights.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "render/radiance/dissimilarity.h"
#include "render/radiance/kernel.h"
#include "render/radiance/leaves_table.h"
#include "render/radiance/measures/photo_sight.h"

namespace lumi {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLanes = RelativeSources::kLanes;

// h and f of every camera, and the smallest h of each block of kLanes. `terms`: of h beside the angle, read where
// kTerms says so; without kField f is whether the camera takes part.
template <bool kTerms, bool kField>
LUMI_KERNEL void AllDissimilarities(const RelativeSources& r, const RayPoint& point, const float* __restrict terms,
                                    float alpha, float gamma, float* __restrict h_out, float* __restrict f_out,
                                    float* __restrict block_min) {
  const PhotoArrays a(r);
  const RayPoint p = point;
  for (int j = 0; j < r.padded; ++j) {
    float g = alpha * PhotoSight<Resolution::kOff>{a, p, j}.theta();
    if constexpr (kTerms) g += terms[j];
    const float f = kField ? FieldOfViewOf(a, p, j) : a.enabled[j];
    h_out[j] = Dissimilarity(g, f, gamma);
    f_out[j] = f;
  }
  for (int b = 0; b < r.padded / kLanes; ++b) {
    float m = h_out[b * kLanes];
    for (int i = 1; i < kLanes; ++i) m = std::min(m, h_out[b * kLanes + i]);
    block_min[b] = m;
  }
}

LUMI_KERNEL float Largest(const float* __restrict f, int n) {
  float lanes[kLanes] = {};
  for (int b = 0; b < n; b += kLanes)
    for (int i = 0; i < kLanes; ++i) lanes[i] = std::max(lanes[i], f[b + i]);
  float m = 0;
  for (const float l : lanes) m = std::max(m, l);
  return m;
}

void Evaluate(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch) {
  const auto& [sources, visibility, settings] = by;
  const auto n = static_cast<std::size_t>(sources.padded);
  if (scratch.f.size() < n) {
    scratch.f.resize(n);
    scratch.h.resize(n + n / kLanes);
  }
  const RayPoint point =
      PointOfRay(sources, settings, ray.direction.cast<float>(), static_cast<float>(ray.t), ray.normal);
  const bool terms = HasTerms(settings);
  scratch.measures.terms.clear();
  if (terms) EvaluateTerms(sources, settings, point, scratch.measures);
  const auto evaluate =
      terms ? (settings.field_of_view ? AllDissimilarities<true, true> : AllDissimilarities<true, false>)
            : (settings.field_of_view ? AllDissimilarities<false, true> : AllDissimilarities<false, false>);
  evaluate(sources, point, scratch.measures.terms.data(), static_cast<float>(settings.alpha),
           static_cast<float>(settings.gamma), scratch.h.data(), scratch.f.data(), scratch.h.data() + n);
}

// h with visibility from h without it: 1/f becomes 1/(f v). v <= 1, so h only grows.
class WithVisibility {
 public:
  WithVisibility(const Weighing& by, const ProxyRay& ray)
      : r_(by.sources),
        maps_(by.visibility && !by.visibility->empty() && by.settings.gamma > 0 ? by.visibility : nullptr),
        p_(static_cast<float>(ray.t) * ray.direction.cast<float>()),
        gamma_(static_cast<float>(by.settings.gamma)) {}

  // `seen`: v.
  float operator()(std::int32_t camera, float h, float f, float& seen) const {
    seen = 1;
    if (!maps_ || !(h > 0)) return h;
    const auto j = static_cast<std::size_t>(camera);
    const float x = p_.x() - r_.dx[j], y = p_.y() - r_.dy[j], z = p_.z() - r_.dz[j];
    const float w = r_.m[6][j] * x + r_.m[7][j] * y + r_.m[8][j] * z;
    if (!(w > 0)) return h;  // field of view is off, and the point behind the camera
    const float u = (r_.m[0][j] * x + r_.m[1][j] * y + r_.m[2][j] * z) / w;
    const float v = (r_.m[3][j] * x + r_.m[4][j] * y + r_.m[5][j] * z) / w;
    seen = maps_->Visibility(r_.view[j], u, v, r_.width_px[j], r_.height_px[j], w);
    return WithGate(h, f, seen, gamma_);
  }

  const VisibilityMaps* maps() const { return maps_; }

 private:
  const RelativeSources& r_;
  const VisibilityMaps* maps_;
  const Eigen::Vector3f p_;
  const float gamma_;
};

// The k + 1 nearest cameras, found in float. If rounding exchanged the last with the next one, the two are so close
// that the window's edge is the same.
constexpr int kMostFound = kMaxBlend + 1;
struct Nearest {
  int count = 0;
  std::array<float, kMostFound> h, seen;
  std::array<std::int32_t, kMostFound> camera;
};

Nearest FindNearest(const RelativeSources& sources, const WithVisibility& visible, int wanted,
                    const WeighScratch& scratch) {
  Nearest best;
  const float* h_unblocked = scratch.h.data();
  const float* block_min = h_unblocked + sources.padded;
  const auto last = static_cast<std::size_t>(wanted - 1);
  // Ascending; ties by index, so that the result does not depend on how the loop was split.
  for (int b = 0; b < sources.padded / kLanes; ++b) {
    float limit = best.count < wanted ? kInfinity : best.h[last];
    if (!(block_min[b] < limit)) continue;
    for (int j = b * kLanes; j < (b + 1) * kLanes; ++j) {
      if (!(h_unblocked[j] < limit)) continue;
      float seen;
      const float h = visible(j, h_unblocked[j], scratch.f[static_cast<std::size_t>(j)], seen);
      if (!(h < limit)) continue;
      auto i = static_cast<std::size_t>(best.count < wanted ? best.count++ : wanted - 1);
      for (; i > 0 && best.h[i - 1] > h; --i) {
        best.h[i] = best.h[i - 1];
        best.seen[i] = best.seen[i - 1];
        best.camera[i] = best.camera[i - 1];
      }
      best.h[i] = h;
      best.seen[i] = seen;
      best.camera[i] = j;
      limit = best.count < wanted ? kInfinity : best.h[last];
    }
  }
  return best;
}

constexpr int kExactLanes = 8;
constexpr int kExactPadded = (kMostFound + kExactLanes - 1) / kExactLanes * kExactLanes;
struct ExactRows {
  double value[RelativeSources::kExact][kExactPadded];
  double theta[kExactPadded], u[kExactPadded], v[kExactPadded], depth[kExactPadded];
};

// Angle and image of the point for a few cameras, in double.
LUMI_KERNEL void Exactly(ExactRows& e, int n, double dx, double dy, double dz, double t) {
  const double x = t * dx, y = t * dy, z = t * dz;
  const int padded = (n + kExactLanes - 1) / kExactLanes * kExactLanes;
  for (int i = 0; i < padded; ++i) {
    const double Dx = e.value[0][i], Dy = e.value[1][i], Dz = e.value[2][i];
    const double cx = Dy * dz - Dz * dy, cy = Dz * dx - Dx * dz, cz = Dx * dy - Dy * dx;
    e.theta[i] = AtanPositive(std::sqrt(cx * cx + cy * cy + cz * cz), t - (Dx * dx + Dy * dy + Dz * dz));
    const double px = x - Dx, py = y - Dy, pz = z - Dz;
    const double w = e.value[9][i] * px + e.value[10][i] * py + e.value[11][i] * pz;
    const double iw = 1.0 / (w > 0 ? w : 1.0);
    e.u[i] = (e.value[3][i] * px + e.value[4][i] * py + e.value[5][i] * pz) * iw;
    e.v[i] = (e.value[6][i] * px + e.value[7][i] * py + e.value[8][i] * pz) * iw;
    e.depth[i] = w;
  }
}

// One camera's h, and which it is.
struct Ranked {
  double h;
  std::int32_t camera;
};

// The same cameras weighed in double, ascending: near a tie or a photo's border a float's last digits show in the
// weights.
int Refine(const Weighing& by, const WithVisibility& visible, const Nearest& found, const ProxyRay& ray,
           const WeighScratch& scratch, std::array<Ranked, kMostFound>& out) {
  const auto& [sources, visibility, settings] = by;
  ExactRows e;
  for (int i = 0; i < (found.count + kExactLanes - 1) / kExactLanes * kExactLanes; ++i) {
    const auto j = static_cast<std::size_t>(found.camera[static_cast<std::size_t>(std::min(i, found.count - 1))]);
    const double* exact = sources.exact.data() + RelativeSources::kExact * j;
    for (std::size_t row = 0; row < RelativeSources::kExact; ++row) e.value[row][i] = exact[row];
  }
  Exactly(e, found.count, ray.direction.x(), ray.direction.y(), ray.direction.z(), ray.t);

  int count = 0;
  for (int i = 0; i < found.count; ++i) {
    const auto n = static_cast<std::size_t>(i);
    const std::int32_t camera = found.camera[n];
    const auto j = static_cast<std::size_t>(camera);
    double g = settings.alpha * e.theta[i];
    if (!scratch.measures.terms.empty()) g += static_cast<double>(scratch.measures.terms[j]);
    double f = 1;
    if (settings.field_of_view) {
      const double edge =
          std::min(std::min(e.u[i], e.value[12][i] - e.u[i]), std::min(e.v[i], e.value[13][i] - e.v[i]));
      // In float the point was inside; if it is just outside in double, it counts as on the border.
      f = std::max(FieldOfView(edge, e.value[14][i]), static_cast<double>(kBarelySeen));
    }
    double v = static_cast<double>(found.seen[n]);
    // Between its two ends, v depends on the pixel and is computed again; at the ends it is constant.
    if (visible.maps() && v > static_cast<double>(kBlockedVisibility) && v < 1 && g > 0)
      v = visible.maps()->Visibility(sources.view[j], e.u[i], e.v[i], e.value[12][i], e.value[13][i], e.depth[i]);
    const double h = Dissimilarity(g, f * v, settings.gamma);
    int at = count++;
    for (; at > 0 && out[static_cast<std::size_t>(at - 1)].h > h; --at)
      out[static_cast<std::size_t>(at)] = out[static_cast<std::size_t>(at - 1)];
    out[static_cast<std::size_t>(at)] = {h, camera};
  }
  return count;
}

// R(h) of the falling leaves, for real-time weights. Beyond 2 r_max nothing correlates but one photo must still lead,
// so a small multiple of 1/h is added, which has an effect only there.
double LeafWeight(const LeavesTable& leaves, double h) {
  constexpr double kTrace = 1e-6;
  return leaves(h) + kTrace * leaves.r_max_rad() / (leaves.r_max_rad() + h);
}

// nullptr where R is 1/h. A thread keeps the table that it last used: making one takes as long as thousands of weights.
const LeavesTable* Leaves(const RadianceSettings& s) {
  if (s.correlation != Correlation::kFallingLeaves) return nullptr;
  thread_local std::optional<LeavesTable> table;
  if (!table || !table->Is(s.r_min_rad, s.r_max_rad)) table.emplace(s.r_min_rad, s.r_max_rad);
  return &*table;
}

// How opaque the pixel is: fades with the best view of the point, full for a photo's own ray (h = 0).
float Alpha(float f_largest, float h_smallest) {
  return h_smallest == 0 ? 1.0F : std::min(1.0F, f_largest / kAlphaFullAt);
}

}  // namespace

RayWeights Weigh(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch) {
  const auto& [sources, visibility, settings] = by;
  RayWeights out;
  Evaluate(by, ray, scratch);
  const WithVisibility seen(by, ray);
  const int k = settings.k;
  const Nearest found = FindNearest(sources, seen, k + 1, scratch);
  if (found.count == 0) return out;
  std::array<Ranked, kMostFound> best;
  const int ranked = Refine(by, seen, found, ray, scratch, best);

  // h_1/h_j - h_1/h_{k+1}, with h_1/h_1 = 1 also at 0; no k+1st camera: the window's edge is at infinity.
  const double h1 = best[0].h;
  const double last = ranked > k ? best[static_cast<std::size_t>(k)].h : std::numeric_limits<double>::infinity();
  const double edge = last == h1 ? 1.0 : h1 / last;
  const int n = std::min(ranked, k);
  double sum = 0;
  std::array<double, kMaxBlend> weight;
  const LeavesTable* leaves = Leaves(settings);
  for (int i = 0; i < n; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double w = leaves ? LeafWeight(*leaves, best[at].h) * (1 - best[at].h / last)
                            : (best[at].h == h1 ? 1.0 : h1 / best[at].h) - edge;
    if (!(w > 0)) break;
    out.camera[at] = best[at].camera;
    weight[at] = w;
    sum += w;
    out.count = i + 1;
  }
  if (out.count == 0) {
    // A (k+1)-way tie: all windowed weights vanish and the limit depends on the direction of approach. The tied cameras
    // share equally.
    out.count = n;
    for (std::size_t i = 0; i < static_cast<std::size_t>(n); ++i) {
      out.camera[i] = best[i].camera;
      weight[i] = 1;
    }
    sum = n;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(out.count); ++i)
    out.weight[i] = static_cast<float>(weight[i] / sum);
  out.alpha = Alpha(Largest(scratch.f.data(), sources.padded), static_cast<float>(h1));
  return out;
}

float WeighAll(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch, std::vector<float>& weights_out) {
  const auto& [sources, visibility, settings] = by;
  Evaluate(by, ray, scratch);
  const WithVisibility seen(by, ray);
  float* h = scratch.h.data();
  float h1 = kInfinity;
  const auto n = static_cast<std::size_t>(sources.count);
  for (std::size_t j = 0; j < n; ++j) {
    float v;
    if (h[j] < kInfinity) h[j] = seen(static_cast<std::int32_t>(j), h[j], scratch.f[j], v);
    h1 = std::min(h1, h[j]);
  }
  weights_out.assign(n, 0.0F);
  if (!(h1 < kInfinity)) return 0;
  const LeavesTable* leaves = Leaves(settings);
  double sum = 0;
  for (std::size_t j = 0; j < n; ++j) {
    if (leaves)
      weights_out[j] = h[j] < kInfinity ? static_cast<float>(LeafWeight(*leaves, static_cast<double>(h[j]))) : 0.0F;
    else
      weights_out[j] = h[j] == h1 ? 1.0F : h1 / h[j];
    sum += static_cast<double>(weights_out[j]);
  }
  for (float& w : weights_out) w = static_cast<float>(static_cast<double>(w) / sum);
  return Alpha(Largest(scratch.f.data(), sources.padded), h1);
}

float WeighRay(const Weighing& by, const ProxyRay& ray, WeighScratch& scratch, WeightedPhotos& out) {
  if (by.settings.k > 0) {
    const RayWeights r = Weigh(by, ray, scratch);
    out.camera.insert(out.camera.end(), r.camera.begin(), r.camera.begin() + r.count);
    out.weight.insert(out.weight.end(), r.weight.begin(), r.weight.begin() + r.count);
    return r.count > 0 ? r.alpha : 0.0F;
  }
  std::vector<float>& all = scratch.everyone;
  const float alpha = WeighAll(by, ray, scratch, all);
  for (std::size_t j = 0; j < all.size(); ++j)
    if (all[j] > 0) {
      out.camera.push_back(static_cast<std::int32_t>(j));
      out.weight.push_back(all[j]);
    }
  return alpha;
}

}  // namespace lumi
