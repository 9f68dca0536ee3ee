#include "render/radiance/weights.h"

#include <cmath>
#include <limits>

#include "render/radiance/kernel.h"
#include "render/radiance/measures/angle.h"
#include "render/radiance/measures/field_of_view.h"

namespace lumi {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLanes = RelativeSources::kLanes;

// h and f of every camera, and the smallest h of each block of kLanes: the common case, angle and field of view, in one pass.
LUMI_KERNEL void Dissimilarity(const RelativeSources& r, float dirx, float diry, float dirz, float t, float alpha, float gamma,
                               float* __restrict h_out, float* __restrict f_out, float* __restrict block_min) {
  const float* __restrict dx = r.dx.data();
  const float* __restrict dy = r.dy.data();
  const float* __restrict dz = r.dz.data();
  const float* __restrict m0 = r.m[0].data();
  const float* __restrict m1 = r.m[1].data();
  const float* __restrict m2 = r.m[2].data();
  const float* __restrict m3 = r.m[3].data();
  const float* __restrict m4 = r.m[4].data();
  const float* __restrict m5 = r.m[5].data();
  const float* __restrict m6 = r.m[6].data();
  const float* __restrict m7 = r.m[7].data();
  const float* __restrict m8 = r.m[8].data();
  const float* __restrict width = r.width_px.data();
  const float* __restrict height = r.height_px.data();
  const float* __restrict feather = r.feather_px.data();
  const float* __restrict enabled = r.enabled.data();
  for (int j = 0; j < r.padded; ++j) {
    const float theta = alpha * Angle(dx[j], dy[j], dz[j], dirx, diry, dirz, t);
    // Where the point falls in the photo.
    const float px = t * dirx - dx[j], py = t * diry - dy[j], pz = t * dirz - dz[j];
    const float w = m6[j] * px + m7[j] * py + m8[j] * pz;
    const float iw = 1.0F / (w > 0 ? w : 1.0F);
    const float u = (m0[j] * px + m1[j] * py + m2[j] * pz) * iw;
    const float v = (m3[j] * px + m4[j] * py + m5[j] * pz) * iw;
    const float edge = std::min(std::min(u, width[j] - u), std::min(v, height[j] - v));
    const bool seen = (w > 0) & (edge >= 0) & (enabled[j] > 0);
    const float f = seen ? FieldOfView(edge, feather[j]) : 0.0F;
    // gamma (1/f - 1), infinite where the camera is blind even for gamma = 0.
    const float penalised = theta * (1.0F + gamma * (1.0F / (f > 0 ? f : 1.0F) - 1.0F));
    float h = f > 0 ? penalised : kInfinity;
    h = seen & (theta == 0) ? 0.0F : h;
    h_out[j] = h;
    f_out[j] = f;
  }
  for (int b = 0; b < r.padded / kLanes; ++b) {
    float m = h_out[b * kLanes];
    for (int i = 1; i < kLanes; ++i) m = std::min(m, h_out[b * kLanes + i]);
    block_min[b] = m;
  }
}

// The same from measures that were evaluated one by one. `r`, `tau`: nullptr where the measure is off.
LUMI_KERNEL void Combined(const float* __restrict theta, const float* __restrict f, const float* __restrict r, const float* __restrict tau, int padded,
                          float alpha, float beta, float gamma, float epsilon, float* __restrict h_out, float* __restrict block_min) {
  for (int j = 0; j < padded; ++j) h_out[j] = alpha * theta[j];
  if (r)
    for (int j = 0; j < padded; ++j) h_out[j] += beta * (1.0F - r[j]);
  if (tau)
    for (int j = 0; j < padded; ++j) h_out[j] += epsilon * tau[j];
  for (int j = 0; j < padded; ++j) {
    const float penalised = h_out[j] * (1.0F + gamma * (1.0F / (f[j] > 0 ? f[j] : 1.0F) - 1.0F));
    h_out[j] = f[j] > 0 ? penalised : kInfinity;
  }
  for (int b = 0; b < padded / kLanes; ++b) {
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

void Evaluate(const RelativeSources& sources, const Eigen::Vector3f& d, float t, const Eigen::Vector3f& normal,
              const RadianceSettings& settings, WeighScratch& scratch) {
  const auto n = static_cast<std::size_t>(sources.padded);
  if (scratch.f.size() < n) {
    scratch.f.resize(n);
    scratch.h.resize(n + n / kLanes);
  }
  const auto alpha = static_cast<float>(settings.alpha), gamma = static_cast<float>(settings.gamma);
  const bool resolution = settings.resolution != Resolution::kOff && settings.beta > 0;
  const bool time = settings.time && settings.epsilon > 0;
  if (settings.field_of_view && !resolution && !time) {
    Dissimilarity(sources, d.x(), d.y(), d.z(), t, alpha, gamma, scratch.h.data(), scratch.f.data(), scratch.h.data() + n);
    return;
  }
  EvaluateMeasures(sources, settings, d, t, normal, scratch.measures);
  const Measures& m = scratch.measures;
  std::copy_n(m.f.begin(), n, scratch.f.begin());
  const auto unit = static_cast<float>(2 * settings.r_max_rad);
  Combined(m.theta.data(), m.f.data(), resolution ? m.r.data() : nullptr, time ? m.tau.data() : nullptr, sources.padded, alpha,
           static_cast<float>(settings.beta) * unit, gamma, static_cast<float>(settings.epsilon) * unit, scratch.h.data(), scratch.h.data() + n);
}

// h with visibility from h without it: 1/f becomes 1/(f v). v <= 1, so h only grows.
class WithVisibility {
 public:
  WithVisibility(const RelativeSources& r, const VisibilityMaps* maps, const Eigen::Vector3f& direction, float t, float gamma)
      : r_(r), maps_(maps && !maps->empty() && gamma > 0 ? maps : nullptr), p_(t * direction), gamma_(gamma) {}

  float operator()(std::int32_t camera, float h, float f) const {
    if (!maps_ || !(h > 0)) return h;
    const auto j = static_cast<std::size_t>(camera);
    const float x = p_.x() - r_.dx[j], y = p_.y() - r_.dy[j], z = p_.z() - r_.dz[j];
    const float w = r_.m[6][j] * x + r_.m[7][j] * y + r_.m[8][j] * z;
    const float u = (r_.m[0][j] * x + r_.m[1][j] * y + r_.m[2][j] * z) / w;
    const float v = (r_.m[3][j] * x + r_.m[4][j] * y + r_.m[5][j] * z) / w;
    const float seen = maps_->Visibility(camera, u, v, r_.width_px[j], r_.height_px[j], w);
    return h * (1 + gamma_ * (1 / (f * seen) - 1)) / (1 + gamma_ * (1 / f - 1));
  }

 private:
  const RelativeSources& r_;
  const VisibilityMaps* maps_;
  const Eigen::Vector3f p_;
  const float gamma_;
};

// How opaque the pixel is: fades with the best view of the point, full for a photo's own ray (h = 0).
float Alpha(float f_largest, float h_smallest) {
  return h_smallest == 0 ? 1.0F : std::min(1.0F, f_largest / kAlphaFullAt);
}

}  // namespace

RayWeights Weigh(const RelativeSources& sources, const VisibilityMaps* visibility, const Eigen::Vector3f& direction, float t,
                 const RadianceSettings& settings, WeighScratch& scratch, const Eigen::Vector3f& normal) {
  RayWeights out;
  Evaluate(sources, direction, t, normal, settings, scratch);
  const WithVisibility seen(sources, visibility, direction, t, static_cast<float>(settings.gamma));
  const float* h_unblocked = scratch.h.data();
  const float* block_min = h_unblocked + sources.padded;

  // The k + 1 smallest, ascending; ties by index, so that the result does not depend on how the loop was split.
  const int k = settings.k;
  std::array<float, kMaxBlend + 1> best_h;
  std::array<std::int32_t, kMaxBlend + 1> best_j;
  int found = 0;
  for (int b = 0; b < sources.padded / kLanes; ++b) {
    float limit = found <= k ? kInfinity : best_h[static_cast<std::size_t>(k)];
    if (!(block_min[b] < limit)) continue;
    for (int j = b * kLanes; j < (b + 1) * kLanes; ++j) {
      if (!(h_unblocked[j] < limit)) continue;
      const float h = seen(j, h_unblocked[j], scratch.f[static_cast<std::size_t>(j)]);
      if (!(h < limit)) continue;
      int i = found <= k ? found++ : k;
      for (; i > 0 && best_h[static_cast<std::size_t>(i - 1)] > h; --i) {
        best_h[static_cast<std::size_t>(i)] = best_h[static_cast<std::size_t>(i - 1)];
        best_j[static_cast<std::size_t>(i)] = best_j[static_cast<std::size_t>(i - 1)];
      }
      best_h[static_cast<std::size_t>(i)] = h;
      best_j[static_cast<std::size_t>(i)] = j;
      limit = found <= k ? kInfinity : best_h[static_cast<std::size_t>(k)];
    }
  }
  if (found == 0) return out;

  // h_1/h_j - h_1/h_{k+1}, with h_1/h_1 = 1 also at 0; no k+1st camera: the window's edge is at infinity.
  const float h1 = best_h[0];
  const bool windowed = found == k + 1;
  const float edge = !windowed ? 0.0F : best_h[static_cast<std::size_t>(k)] == h1 ? 1.0F : h1 / best_h[static_cast<std::size_t>(k)];
  const int n = std::min(found, k);
  float sum = 0;
  for (int i = 0; i < n; ++i) {
    const float hi = best_h[static_cast<std::size_t>(i)];
    const float w = (hi == h1 ? 1.0F : h1 / hi) - edge;
    if (!(w > 0)) break;
    out.camera[static_cast<std::size_t>(i)] = best_j[static_cast<std::size_t>(i)];
    out.weight[static_cast<std::size_t>(i)] = w;
    sum += w;
    out.count = i + 1;
  }
  if (out.count == 0) {
    // A (k+1)-way tie: all windowed weights vanish and the limit depends on the direction of approach. The tied share.
    out.count = n;
    for (int i = 0; i < n; ++i) {
      out.camera[static_cast<std::size_t>(i)] = best_j[static_cast<std::size_t>(i)];
      out.weight[static_cast<std::size_t>(i)] = 1.0F;
    }
    sum = static_cast<float>(n);
  }
  for (int i = 0; i < out.count; ++i) out.weight[static_cast<std::size_t>(i)] /= sum;
  out.alpha = Alpha(Largest(scratch.f.data(), sources.padded), h1);
  return out;
}

float WeighAll(const RelativeSources& sources, const VisibilityMaps* visibility, const Eigen::Vector3f& direction, float t,
               const RadianceSettings& settings, WeighScratch& scratch, std::vector<float>& weights_out,
               const Eigen::Vector3f& normal) {
  Evaluate(sources, direction, t, normal, settings, scratch);
  const WithVisibility seen(sources, visibility, direction, t, static_cast<float>(settings.gamma));
  float* h = scratch.h.data();
  float h1 = kInfinity;
  const auto n = static_cast<std::size_t>(sources.count);
  for (std::size_t j = 0; j < n; ++j) {
    if (h[j] < kInfinity) h[j] = seen(static_cast<std::int32_t>(j), h[j], scratch.f[j]);
    h1 = std::min(h1, h[j]);
  }
  weights_out.assign(n, 0.0F);
  if (!(h1 < kInfinity)) return 0;
  float sum = 0;
  for (std::size_t j = 0; j < n; ++j) {
    weights_out[j] = h[j] == h1 ? 1.0F : h1 / h[j];
    sum += weights_out[j];
  }
  for (float& w : weights_out) w /= sum;
  return Alpha(Largest(scratch.f.data(), sources.padded), h1);
}

}  // namespace lumi
