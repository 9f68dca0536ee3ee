// Keyframes, points and lens adjusted with what other frames of the video see of the points.
#pragma once

#include <vector>

#include "reconstruct/colmap_program.h"
#include "reconstruct/place_camera.h"
#include "scene/model/scene.h"

namespace lumi {

// `scene` has the keyframes only, before and after, and one camera. Of the frames that are placed, evenly taken, so
// many take part that there are 150 cameras with the keyframes; sightings far off have none. Points that are outliers,
// or that COLMAP lets go, lose their tracks. Where the adjustment is of no use (PolishCameras), nothing changes.
void AdjustWithFrames(Scene& scene, const std::vector<PlacedCamera>& placed, bool lens_known, const ColmapJob& job);

}  // namespace lumi
