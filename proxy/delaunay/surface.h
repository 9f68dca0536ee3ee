// The surface between free and full tetrahedra.
#pragma once

#include <cstdint>
#include <vector>

#include "proxy/delaunay/tetrahedra.h"
#include "scene/geometry/mesh.h"

namespace lumi {

// Counter-clockwise seen from the free side. Closed and 2-manifold: where more than two faces meet at an edge, it is
// split at its middle once for each free wedge, so that each half edge belongs to one sheet; where several sheets meet
// at a vertex, each has its own there.
Mesh ExtractSurface(const Tetrahedra& tets, const std::vector<std::uint8_t>& free);

}  // namespace lumi
