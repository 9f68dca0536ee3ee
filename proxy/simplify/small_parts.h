// Parts of a mesh that are too small to be kept. Decimation leaves each part four faces at least, and dense meshes of
// fur or leaves have thousands of parts that float about and are a few pixels large in any photo.
#pragma once

#include <cstddef>
#include <vector>

#include "scene/geometry/mesh.h"

namespace lumi {

// A surface with the least number of faces that its handles allow (mesh_topology.h, least_faces) has nothing of its
// shape left: it is given so many times as many.
inline constexpr std::size_t kFacesPerLeast = 4;

// Removes parts of a 2-manifold, those first that the photos show smallest, until what is left can keep its shape with
// `faces` faces (kFacesPerLeast). Parts whose surface in the photos is that of four faces or more, were `faces` spread
// evenly, and the largest stay in any case. `scale`: pixels a unit at each face (PixelScale), > 0. Returns how many
// were removed: with 0 the mesh is what it was, else vertices without a face are gone.
std::size_t RemoveSmallParts(Mesh& mesh, std::size_t faces, const std::vector<double>& scale);

}  // namespace lumi
