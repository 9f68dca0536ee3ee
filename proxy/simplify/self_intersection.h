#pragma once

#include "scene/geometry/mesh.h"

namespace lumi {

// Does the surface run through itself (CGAL, exact predicates)? mesh: 2-manifold.
bool IntersectsItself(const Mesh& mesh);

}  // namespace lumi
