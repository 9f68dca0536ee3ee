// Meshes made elsewhere as meshes that a proxy may be: no vertex that is no number, no two at one place, no face twice
// or without area, 2-manifold and consistently turned. What was mended is counted; nothing else is changed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scene/geometry/mesh.h"

namespace lumi {

struct MeshFlaws {
  std::size_t not_finite_vertices = 0;    // their faces are left out
  std::size_t duplicate_vertices = 0;     // at exactly one place with another, in a mesh that is not closed: merged
  std::size_t duplicate_faces = 0;        // of the same three vertices, whichever way round: one stays
  std::size_t zero_area_faces = 0;        // collapsed, or replaced by what their neighbour has of them
  std::size_t non_manifold_edges = 0;     // more than two faces: cut apart there
  std::size_t non_manifold_vertices = 0;  // several fans of faces: one vertex for each
  std::size_t turned_faces = 0;           // against the way round of the others of their part: the fewer are turned
  std::size_t inside_out_parts = 0;       // turned as a whole (OrientParts)
  bool none() const;
  std::string Describe() const;  // "2 vertices that are no numbers, 1 face without area", or "none"
};

struct RepairedMesh {
  Mesh mesh;                       // may be without faces
  std::vector<std::int32_t> part;  // of each face: connected by edges
  std::int32_t parts = 0;
  std::size_t faces_lost = 0;  // less than there were, but for duplicates and those without area
  MeshFlaws flaws;
};
// Deterministic. Colours stay with their vertices. Throws std::invalid_argument for a face that names no vertex.
RepairedMesh RepairMesh(const Mesh& mesh);

// Turns each part so that its front is what `votes` saw of it: votes[part] is fronts seen less backs. A part without
// votes that is closed turns its front outwards; an open one stays. Counts in flaws.inside_out_parts.
void OrientParts(RepairedMesh& repaired, const std::vector<long>& votes);

}  // namespace lumi
