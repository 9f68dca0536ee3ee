// Depth maps of many photos made one cloud of points: what photos agree on stays, once.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "proxy/dense/depth_map.h"
#include "proxy/dense/stereo_camera.h"
#include "proxy/points.h"

namespace lumi {

struct FusionOptions {
  // Other photos whose maps must agree, >= 1; where fewer look there, all of those.
  int agree = 2;
  double max_error_px = 1;         // there and back again
  double max_depth_error = 0.005;  // share of the depth
  double max_cost = 0.4;           // 1 - correlation
};

// A photo's map as fusion reads it; no map: it has none.
struct FusionMap {
  StereoCamera camera;  // of the map's size
  std::shared_ptr<const DepthMap> map;
};

// Views as in Scene::views. Maps are loaded when they are needed.
struct FusionInput {
  std::vector<std::vector<std::int32_t>> partners;  // of a view: those that may agree with it
  std::function<FusionMap(std::int32_t)> load;
};

// Each point has the views that agree on it, its finest pixel as footprint, and a standard deviation along its rays
// that follows from how well they agree and the angle between them. In order of views and pixels, whatever the threads.
std::vector<ProxyPoint> FuseDepths(const FusionInput& input, const FusionOptions& options,
                                   const std::function<void()>& on_view);

}  // namespace lumi
