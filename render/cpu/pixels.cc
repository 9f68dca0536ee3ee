#include "render/cpu/pixels.h"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <mutex>

#include "render/comparators/comparators.h"
#include "render/cpu/blend.h"
#include "scene/program/parallel.h"

namespace lumi {

int PixelTiles(int width, int height) {
  return ((width + kPixelTileWidth - 1) / kPixelTileWidth) * ((height + kPixelTileHeight - 1) / kPixelTileHeight);
}

std::vector<float> RelativeGains(const Sources& sources, const ViewSetup& setup) {
  std::vector<float> gains;
  bool alike = true;
  for (const RenderView& v : sources.views) {
    gains.push_back(static_cast<float>(setup.desired.gain / v.gain));
    alike = alike && gains.back() == 1;
  }
  if (!setup.settings.exposure || alike) gains.clear();
  return gains;
}

OptimumCounts ForPixelTiles(const ViewSetup& setup, const ProxyTracer& proxy, const VisibilityMaps* visibility,
                            const std::function<bool()>& stop, const Eigen::Vector2i& size_px,
                            const std::function<void(FramePlan&)>& body) {
  const int width = size_px.x(), height = size_px.y();
  const int columns = (width + kPixelTileWidth - 1) / kPixelTileWidth;
  OptimumCounts all;
  std::mutex counting;
  ParallelFor(static_cast<std::size_t>(PixelTiles(width, height)), 1, [&](std::size_t begin, std::size_t end) {
    FramePlan plan;
    WeighScratch scratch;
    OptimumCounts counts;
    for (std::size_t tile = begin; tile < end && !stop(); ++tile) {
      const int x = static_cast<int>(tile) % columns * kPixelTileWidth,
                y = static_cast<int>(tile) / columns * kPixelTileHeight;
      const PixelWindow window{x, y, std::min(kPixelTileWidth, width - x), std::min(kPixelTileHeight, height - y)};
      PlanPixels(setup, proxy, visibility, window, plan, scratch);
      counts += plan.optimum;
      body(plan);
    }
    const std::lock_guard lock(counting);
    all += counts;
  });
  return all;
}

ViewSetup Weighed(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy) {
  ViewSetup weighed = setup;
  if (setup.settings.method != Algorithm::kUlr && !setup.method) weighed.method = MakeComparator(sources, proxy, setup);
  return weighed;
}

OptimumCounts RenderPixels(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy,
                           const VisibilityMaps* visibility, const PixelSources& blended,
                           const std::function<bool()>& stop, ImageF& image) {
  const ViewSetup weighed = Weighed(sources, setup, proxy);
  const std::vector<float> gains = RelativeGains(sources, weighed);
  return ForPixelTiles(weighed, proxy, visibility, stop, {image.width, image.height}, [&](const FramePlan& plan) {
    if (blended.colors != nullptr)
      BlendConstants(plan, weighed, *blended.colors, image);
    else
      BlendColor(plan, weighed, *blended.photos, gains, image);
  });
}

std::vector<std::int32_t> CamerasOfPixels(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy,
                                          const VisibilityMaps* visibility, const std::function<bool()>& stop,
                                          const Eigen::Vector2i& size_px) {
  std::vector<std::atomic<int>> blended(sources.views.size());  // by tiles
  ForPixelTiles(setup, proxy, visibility, stop, size_px, [&](const FramePlan& plan) {
    std::vector<std::int32_t> here = plan.camera;
    std::ranges::sort(here);
    here.erase(std::unique(here.begin(), here.end()), here.end());
    for (const std::int32_t camera : here)
      if (camera >= 0) blended[static_cast<std::size_t>(camera)].fetch_add(1, std::memory_order_relaxed);
  });
  std::vector<std::int32_t> cameras;
  for (std::size_t j = 0; j < blended.size(); ++j)
    cameras.insert(cameras.end(), static_cast<std::size_t>(blended[j]), static_cast<std::int32_t>(j));
  return cameras;
}

}  // namespace lumi
