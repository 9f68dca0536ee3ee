// Which cameras may see a part of a small piece of the proxy: only these are ranked at the rays that meet it, so that a
// frame's cost grows with the photos that see the same things, and hardly with all photos.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "render/radiance/sources.h"

namespace lumi {

// Replaces `seeing`, ascending: no camera left out has a field-of-view value above 0 at any point of the box (relative
// to the desired centre, normalised units), whatever a float's rounding. Some of those listed may have none either.
void CamerasInSight(const RelativeSources& sources, const Eigen::AlignedBox3f& box, std::vector<std::int32_t>& seeing);

}  // namespace lumi
