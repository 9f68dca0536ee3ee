// The cameras and points of a metric scene seen from above, as an SVG element.
#pragma once

#include <set>
#include <string>

#include "scene/model/scene.h"

namespace lumi {

// Views named in `held_out` are marked. Colours are CSS classes (camera, held-out, point), so that a page's light and
// dark themes hold. Empty for a scene without cameras or in another frame.
std::string CamerasFromAboveSvg(const Scene& scene, const std::set<std::string>& held_out);

}  // namespace lumi
