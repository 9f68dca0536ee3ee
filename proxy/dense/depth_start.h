// Where stereo starts from: planes through the sparse points that a photo sees, triangulated in its image.
#pragma once

#include <optional>
#include <vector>

#include "proxy/dense/depth_map.h"
#include "proxy/dense/stereo_camera.h"
#include "scene/model/scene.h"

namespace lumi {

// Inverse depths within which a surface is looked for: those of the view's own points with room on both sides.
struct DepthRange {
  float nearest_w = 0, farthest_w = 0;
};
// None where the view sees fewer than this many points: nothing says where to look.
inline constexpr std::size_t kFewestPoints = 8;
std::optional<DepthRange> RangeOf(const Scene& scene, ViewId view);

// Of the camera's size; every pixel has a plane within the range.
DepthMap StartingPlanes(const Scene& scene, ViewId view, const StereoCamera& camera, const DepthRange& range);

}  // namespace lumi
