#include "render/cpu/pixels.h"

#include <algorithm>
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

OptimumCounts RenderPixels(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy,
                           const VisibilityMaps* visibility, const PixelSources& blended,
                           const std::function<bool()>& stop, ImageF& image) {
  if (setup.settings.method != Algorithm::kUlr && !setup.method) {
    ViewSetup published = setup;
    published.method = MakeComparator(sources, proxy, setup);
    return RenderPixels(sources, published, proxy, visibility, blended, stop, image);
  }
  const std::vector<float> gains = RelativeGains(sources, setup);
  const int width = image.width, height = image.height;
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
      if (blended.colors != nullptr)
        BlendConstants(plan, setup, *blended.colors, image);
      else
        BlendColor(plan, setup, *blended.photos, gains, image);
    }
    const std::lock_guard lock(counting);
    all += counts;
  });
  return all;
}

}  // namespace lumi
