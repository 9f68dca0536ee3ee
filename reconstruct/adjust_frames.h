// Keyframes, points and lens adjusted with what other frames of the video see of the points.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "reconstruct/colmap_program.h"
#include "scene/model/scene.h"

namespace lumi {

struct PlacedFrame {
  bool ok = false;
  int inliers = 0;
  Rigid3 cam_from_world;
  std::vector<std::pair<std::int32_t, Eigen::Vector2d>> observations;  // point, pixel; of those that agree
};

// `scene` has the keyframes only, before and after, and one camera. Of the frames that are placed, evenly taken, so
// many take part that there are 150 cameras with the keyframes; sightings far off have none. Points that are outliers,
// or that COLMAP lets go, lose their tracks. Where the adjustment is of no use (PolishCameras), nothing changes.
void AdjustWithFrames(Scene& scene, const std::vector<PlacedFrame>& placed, bool lens_known, const ColmapJob& job);

}  // namespace lumi
