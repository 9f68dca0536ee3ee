// How far two surfaces are from each other.
#pragma once

#include <cstddef>

#include "scene/geometry/mesh.h"

namespace lumi {

struct Deviation {
  double mean = 0, max = 0;  // in world units
};
// From points of each mesh to the nearest of the other: `samples` of either, evenly over its area. The larger of the
// two means, of the two largest. Both meshes have faces.
Deviation MeasureDeviation(const Mesh& a, const Mesh& b, std::size_t samples = 20000);

}  // namespace lumi
