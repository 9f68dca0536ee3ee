// Feature tracks before and after (thesis Figs. 6-6, 6-8, 6-10).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "stabilize/filmed_scene.h"

namespace lumi {

// SVG: the longest tracks as they were seen, black, and as `P` sees them, red dots; the focus of expansion
// (homogeneous, pixels) as a circle where it lies near the picture, as an arrow towards it elsewhere; points of `fixed`
// as crosses. P in units from the balanced world.
std::string TrackPlot(const FilmedScene& film, const std::vector<Matrix34d>& P,
                      const std::optional<Eigen::Vector3d>& focus_of_expansion_px,
                      const std::vector<std::int32_t>& fixed);

}  // namespace lumi
