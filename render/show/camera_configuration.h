// The capture seen from outside, after Fig. 4-3 of the thesis: photos' cameras in blue, the proxy in grey, the scene's
// points in their colours, and the virtual view in red; from above, from the side and obliquely.
#pragma once

#include "scene/geometry/mesh.h"
#include "scene/model/image.h"
#include "scene/model/scene.h"

namespace lumi {

// Three square panels of side_px beside one another, RGB on white. Metric frames; `desired` in world.
Image8 DrawCameraConfiguration(const Scene& scene, const Mesh& proxy, const RenderView& desired, int side_px);

}  // namespace lumi
