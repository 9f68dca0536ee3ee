// Keyframes, points and lens adjusted with what other frames of the video see of the points.
#pragma once

#include <vector>

#include "reconstruct/colmap_program.h"
#include "reconstruct/place_camera.h"
#include "scene/model/scene.h"

namespace lumi {

// `scene` has the keyframes only, before and after, and one camera. Frames that are placed, evenly chosen, take part,
// so many that there are 150 cameras with the keyframes; sightings far off are left out. Points that are outliers, or
// that COLMAP drops, lose their tracks. Where the adjustment is of no use (PolishCameras), nothing changes.
void AdjustWithFrames(Scene& scene, const std::vector<PlacedCamera>& placed, bool lens_known, const ColmapJob& job);

}  // namespace lumi
