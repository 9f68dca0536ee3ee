#include "render/cpu/blend.h"

#include <algorithm>
#include <cmath>

#include "render/radiance/measures/prefilter.h"

namespace lumi {
namespace {

// Below this the upper level's share is under 1/255 of a step: one level serves.
constexpr float kLevelZero = 1.0F / 512;

Eigen::Array3f Bilinear(const Image8& image, float x, float y) {
  // Clamped to the centres of the border pixels: no colour from outside a photo.
  x = std::min(std::max(x - 0.5F, 0.0F), static_cast<float>(image.width - 1));
  y = std::min(std::max(y - 0.5F, 0.0F), static_cast<float>(image.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
  const float ax = x - static_cast<float>(x0), ay = y - static_cast<float>(y0);
  const std::uint8_t *r0 = image.Row(y0), *r1 = image.Row(y1);
  const std::uint8_t *p00 = r0 + 3 * x0, *p01 = r0 + 3 * x1, *p10 = r1 + 3 * x0, *p11 = r1 + 3 * x1;
  Eigen::Array3f c;
  for (int i = 0; i < 3; ++i) {
    const float top = static_cast<float>(p00[i]) + ax * static_cast<float>(p01[i] - p00[i]);
    const float bottom = static_cast<float>(p10[i]) + ax * static_cast<float>(p11[i] - p10[i]);
    c[i] = top + ay * (bottom - top);
  }
  return c;
}

}  // namespace

Eigen::Array3f SamplePhoto(const Photo& photo, float u, float v, float level) {
  level -= static_cast<float>(photo.level0_shift);
  const int last = static_cast<int>(photo.levels.size()) - 1;
  const auto at = [&](int l) {
    const Image8& image = photo.levels[static_cast<std::size_t>(l)];
    return Bilinear(image, u * static_cast<float>(image.width), v * static_cast<float>(image.height));
  };
  if (!(level > kLevelZero)) return at(0);
  if (level >= static_cast<float>(last)) return at(last);
  const int l = static_cast<int>(level);
  const float a = level - static_cast<float>(l);
  return (1 - a) * at(l) + a * at(l + 1);
}

namespace {

// Weights that sum to one may be negative. If the remaining sum is smaller than this, dividing by it makes noise.
constexpr float kLeastContained = 0.05F;

// Most photos are read as they are, and need no logarithm.
float LevelOf(float footprint) { return footprint > kReadWhole ? PyramidLevel(footprint) : 0.0F; }

// radiance(j, u_px, v_px, footprint()): RGB in [0,1]; the footprint is that of radiance/measures/prefilter.h.
template <typename Radiance>
void Blend(const FramePlan& plan, const ViewSetup& setup, ImageF& image, const Radiance& radiance) {
  const auto k = static_cast<std::size_t>(plan.k);
  const RelativeSources& r = setup.sources;
  // Where the field of view does not take a photo's weight to 0 at its border (off, or a finite penalty in the
  // optimum), no colour from outside the photo is used all the same.
  const bool fading = setup.settings.field_of_view;
  const bool additive = setup.settings.similarity == Similarity::kFull && setup.settings.combine == Combine::kAdditive;
  const bool ends = !fading || additive;
  const Eigen::Vector3f axis = setup.desired.P.row(2).head<3>().transpose().cast<float>();
  std::size_t s = 0;
  for (int y = 0; y < plan.window.height; ++y) {
    float* out = image.Row(plan.window.y + y) + 4 * plan.window.x;
    for (int x = 0; x < plan.window.width; ++x, ++s, out += 4) {
      const float alpha = plan.alpha[s];
      if (!(alpha > 0)) {
        out[0] = out[1] = out[2] = out[3] = 0;
        continue;
      }
      const Eigen::Vector3f& offset = plan.offset[s];
      Eigen::Array3f color = Eigen::Array3f::Zero();
      const float depth = axis.dot(offset);
      const Eigen::Vector3f normal = s < plan.normal.size() ? plan.normal[s] : Eigen::Vector3f::Zero();
      const float facing = normal.dot(offset);
      float contained = 0;  // share of the weights whose photos contain the point
      for (std::size_t i = 0; i < k; ++i) {
        const std::int32_t camera = plan.camera[s * k + i];
        if (camera < 0) continue;
        const auto j = static_cast<std::size_t>(camera);
        const float px = offset.x() - r.dx[j], py = offset.y() - r.dy[j], pz = offset.z() - r.dz[j];
        const float w = r.m[6][j] * px + r.m[7][j] * py + r.m[8][j] * pz;
        const float u = (r.m[0][j] * px + r.m[1][j] * py + r.m[2][j] * pz) / w;
        const float v = (r.m[3][j] * px + r.m[4][j] * py + r.m[5][j] * pz) / w;
        if (ends && !(w > 0 && u >= 0 && v >= 0 && u <= r.width_px[j] && v <= r.height_px[j])) continue;
        const float weight = plan.weight[s * k + i];
        contained += weight;
        color += weight * radiance(j, u, v, [&] {
                   const float of_photo = normal.x() * px + normal.y() * py + normal.z() * pz;
                   return Footprint(r.focal_px[j] / setup.focal_px, FacingRatio(of_photo, facing), depth / w);
                 });
      }
      if (fading && additive) {  // the other photos take over its share
        if (!(contained > kLeastContained)) {
          out[0] = out[1] = out[2] = out[3] = 0;
          continue;
        }
        color /= contained;
      }
      // With field of view off, what is missing is a hole, neither black nor made up for by the others.
      color *= alpha;
      out[0] = color[0];
      out[1] = color[1];
      out[2] = color[2];
      out[3] = fading ? alpha : alpha * std::clamp(contained, 0.0F, 1.0F);  // the optimum's weights may be negative
    }
  }
}

}  // namespace

void BlendColor(const FramePlan& plan, const ViewSetup& setup, const std::vector<Photo>& photos,
                const std::vector<float>& gains, ImageF& image, std::span<const int> seen) {
  const RelativeSources& r = setup.sources;
  Blend(plan, setup, image, [&](std::size_t j, float u, float v, const auto& footprint) {
    const float asked = setup.settings.prefilter ? LevelOf(footprint()) : 0.0F;
    float level = asked;
    // So that it does not matter whether the photo is held finer.
    if (const float least = seen.empty() ? 0.0F : static_cast<float>(seen[j]); asked <= least + kLevelZero && least > 0)
      level = least;
    const float scale = (gains.empty() ? 1.0F : gains[j]) / 255.0F;
    return Eigen::Array3f(scale * SamplePhoto(photos[j], u / r.width_px[j], v / r.height_px[j], level));
  });
}

void BlendConstants(const FramePlan& plan, const ViewSetup& setup, const std::vector<Eigen::Vector3f>& colors,
                    ImageF& image) {
  Blend(plan, setup, image, [&](std::size_t j, float, float, const auto&) { return colors[j].array(); });
}

}  // namespace lumi
