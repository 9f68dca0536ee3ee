// Whether a mesh bounds a solid, judged by CGAL's exact predicates.
#pragma once

#include <cstddef>
#include <string>

#include "scene/geometry/mesh.h"

namespace lumi {

struct Soundness {
  bool manifold = false;  // 2-manifold and consistently oriented
  bool closed = false;
  bool outward = false;  // the front faces of each part look outwards
  std::size_t degenerate_faces = 0;
  std::size_t parts = 0;  // connected components
  bool IsSolid() const { return manifold && closed && outward && degenerate_faces == 0; }
  std::string Describe() const;  // "closed, 2-manifold, front faces outwards, no degenerate face", or what is wrong
};
Soundness CheckSoundness(const Mesh& mesh);

}  // namespace lumi
