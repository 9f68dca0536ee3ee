#include "render/show/proxy_picture.h"

#include <array>
#include <cmath>

#include "render/radiance/frame_plan.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {

ImageF DrawProxy(const Sources& sources, const Mesh& proxy, const RenderView& desired) {
  const ProxyTracer tracer(proxy, sources.normalized_from_world);
  const ViewSetup setup = MakeViewSetup(sources, desired, {}, {});
  const int width = desired.size_px.x(), height = desired.size_px.y();
  ImageF image(width, height, 4);
  constexpr std::array<std::array<float, 2>, 4> kSubpixels{
      {{0.125F, 0.375F}, {0.625F, 0.125F}, {0.875F, 0.625F}, {0.375F, 0.875F}}};
  constexpr std::array<float, 3> kFront{0.86F, 0.87F, 0.90F}, kBack{0.85F, 0.38F, 0.33F};
  constexpr float kAmbient = 0.18F;
  ParallelFor(static_cast<std::size_t>(height), 4, [&](std::size_t begin, std::size_t end) {
    std::vector<Eigen::Vector3f> direction(static_cast<std::size_t>(width)), normal(direction.size());
    std::vector<float> t(direction.size());
    for (std::size_t y = begin; y < end; ++y) {
      if (InterruptRequested()) return;
      for (const auto& [dx, dy] : kSubpixels) {
        for (int x = 0; x < width; ++x)
          direction[static_cast<std::size_t>(x)] =
              (setup.ray_from_pixel * Eigen::Vector3d(static_cast<double>(x) + static_cast<double>(dx),
                                                      static_cast<double>(y) + static_cast<double>(dy), 1))
                  .normalized()
                  .cast<float>();
        tracer.Trace(setup.desired.centre.cast<float>(), direction, t, normal);
        for (std::size_t x = 0; x < direction.size(); ++x) {
          if (!std::isfinite(t[x]) || !(t[x] > 0) || !(normal[x].squaredNorm() > 0)) continue;
          const float facing = normal[x].normalized().dot(direction[x]);
          const auto& base = facing < 0 ? kFront : kBack;
          const float shade = kAmbient + (1 - kAmbient) * std::abs(facing);
          float* out = image.data.data() + 4 * (y * static_cast<std::size_t>(width) + x);
          for (std::size_t c = 0; c < 3; ++c) out[c] += base[c] * shade / kSubpixels.size();
          out[3] += 1.0F / kSubpixels.size();
        }
      }
    }
  });
  CheckInterrupted();
  return image;
}

}  // namespace lumi
