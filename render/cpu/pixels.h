// A picture with weights at every pixel, tile by tile and in parallel: for CpuRenderer, and for callers that must be
// able to stop.
#pragma once

#include <functional>
#include <vector>

#include "render/photos/photo_set.h"
#include "render/radiance/frame_plan.h"
#include "scene/model/image.h"

namespace lumi {

// Size of the window that one thread plans and blends at a time: its plan (about 60 KB) stays in cache.
constexpr int kPixelTileWidth = 64;
constexpr int kPixelTileHeight = 16;
int PixelTiles(int width, int height);
// body(plan) for each tile of a picture of this size, on all threads; the plan may be changed, and does not last.
// stop() is asked before every tile; once it says true, the remaining tiles are left out.
OptimumCounts ForPixelTiles(const ViewSetup& setup, const ProxyTracer& proxy, const VisibilityMaps* visibility,
                            const std::function<bool()>& stop, const Eigen::Vector2i& size_px,
                            const std::function<void(FramePlan&)>& body);

// What is blended: the photos, or a constant colour each (false colour).
struct PixelSources {
  const std::vector<Photo>* photos = nullptr;
  const std::vector<Eigen::Vector3f>* colors = nullptr;
};

// Photos' exposures divided out, the view's own applied: a factor a view; empty where exposure is off or all are alike.
std::vector<float> RelativeGains(const Sources& sources, const ViewSetup& setup);

// `setup` with the published method that the settings name, if they name one.
ViewSetup Weighed(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy);

// Fills `image` (RGBA, the view's size). stop() is called before every tile, from several threads; after it returns
// true, the remaining tiles are left as they were. `visibility`: nullptr where it is off.
OptimumCounts RenderPixels(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy,
                           const VisibilityMaps* visibility, const PixelSources& blended,
                           const std::function<bool()>& stop, ImageF& image);

// The cameras that RenderPixels would blend, once for each tile, ascending; only plans, blends nothing. `setup`: from
// Weighed.
std::vector<std::int32_t> CamerasOfPixels(const Sources& sources, const ViewSetup& setup, const ProxyTracer& proxy,
                                          const VisibilityMaps* visibility, const std::function<bool()>& stop,
                                          const Eigen::Vector2i& size_px);

}  // namespace lumi
