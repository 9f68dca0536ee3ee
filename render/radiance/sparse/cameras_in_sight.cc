#include "render/radiance/sparse/cameras_in_sight.h"

#include <array>
#include <cmath>

#include "render/radiance/kernel.h"
#include "render/radiance/measures/photo_sight.h"

namespace lumi {
namespace {

// Of the terms of a sum of six, far above what a float's rounding makes of it.
constexpr float kRounding = 1e-5F;

// sees[j]: 1 where camera j may see a point of the box, half sizes h about c. With q = p - D: behind the camera where
// w(q) <= 0 for all p, beside it where u(q) < 0, u(q) > width w(q) ... for all p; each is linear, so its extreme over
// the box is its value at c and the sum of the sizes of its terms.
LUMI_KERNEL void MaySee(const RelativeSources& r, const float* __restrict c, const float* __restrict h,
                        float* __restrict sees) {
  const PhotoArrays a(r);
  const float cx = c[0], cy = c[1], cz = c[2], hx = h[0], hy = h[1], hz = h[2];
  for (int j = 0; j < r.padded; ++j) {
    const float x = cx - a.Dx[j], y = cy - a.Dy[j], z = cz - a.Dz[j];
    const float ax = std::abs(x), ay = std::abs(y), az = std::abs(z);
    const auto most = [&](float mx, float my, float mz) {
      const float nx = std::abs(mx), ny = std::abs(my), nz = std::abs(mz);
      return mx * x + my * y + mz * z + nx * hx + ny * hy + nz * hz +
             kRounding * (nx * (ax + hx) + ny * (ay + hy) + nz * (az + hz));
    };
    const float u0 = a.m[0][j], u1 = a.m[1][j], u2 = a.m[2][j], v0 = a.m[3][j], v1 = a.m[4][j], v2 = a.m[5][j],
                w0 = a.m[6][j], w1 = a.m[7][j], w2 = a.m[8][j], W = a.width[j], H = a.height[j];
    const bool may = (most(w0, w1, w2) > 0) & (most(u0, u1, u2) >= 0) & (most(v0, v1, v2) >= 0) &
                     (most(W * w0 - u0, W * w1 - u1, W * w2 - u2) >= 0) &
                     (most(H * w0 - v0, H * w1 - v1, H * w2 - v2) >= 0) & (a.enabled[j] > 0);
    sees[j] = may ? 1.0F : 0.0F;
  }
}

}  // namespace

void CamerasInSight(const RelativeSources& sources, const Eigen::AlignedBox3f& box, std::vector<std::int32_t>& seeing) {
  thread_local std::vector<float> sees;
  sees.resize(static_cast<std::size_t>(sources.padded));
  const Eigen::Vector3f centre = box.center(), half = box.sizes() / 2;
  MaySee(sources, centre.data(), half.data(), sees.data());
  seeing.clear();
  for (std::int32_t j = 0; j < sources.count; ++j)
    if (sees[static_cast<std::size_t>(j)] > 0) seeing.push_back(j);
}

}  // namespace lumi
