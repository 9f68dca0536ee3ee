// Parts of a mesh that are too small to be kept. Decimation leaves each closed part four faces at least, and dense
// meshes of fur or leaves have thousands of parts that float about and are a few pixels large in any photo.
#pragma once

#include <cstddef>
#include <vector>

#include "scene/geometry/mesh.h"

namespace lumi {

// A surface with the least number of faces that its handles allow (mesh_topology.h, least_faces) has nothing of its
// shape left: it is given so many times as many, or all that it has.
inline constexpr std::size_t kFacesPerLeast = 4;

struct SmallParts {
  std::size_t removed = 0;  // 0: the mesh is what it was, else vertices without a face are gone
  std::size_t least = 0;    // faces that the rest can be reduced to: so many as keep its handles' shape, and its parts
};
// Removes parts of a 2-manifold, those first that the photos show smallest, until what is left can keep its shape with
// `faces` faces (kFacesPerLeast). The largest part always stays, and so does each whose area in the photos is four
// times the mean of a face, were the mesh reduced to `faces`: where those alone have too many handles, all smaller
// parts go. `scale`: pixels a unit at each face (PixelScale), > 0.
SmallParts RemoveSmallParts(Mesh& mesh, std::size_t faces, const std::vector<double>& scale);

}  // namespace lumi
