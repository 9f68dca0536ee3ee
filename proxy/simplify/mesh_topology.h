// Meshes as edge collapses need them, and what can be known of the outcome beforehand.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/geometry/mesh.h"

namespace lumi {

// Coordinates in which a mesh is about 1 across, around its middle. The factor is a power of two: nothing is rounded by
// it, so that a mesh near the origin comes back bit by bit.
class NormalisedFrame {
 public:
  explicit NormalisedFrame(const Mesh& mesh);
  Eigen::Vector3d ToLocal(const Eigen::Vector3d& x) const { return (x - middle_) * scale_; }
  Eigen::Vector3d ToWorld(const Eigen::Vector3d& x) const { return x / scale_ + middle_; }
  double world_length() const { return 1 / scale_; }  // of a local unit

 private:
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();  // 0 where the mesh is within a few sizes of the origin
  double scale_ = 1;
};

struct MeshRepair {
  std::size_t merged_vertices = 0;  // at the very same place, where that closes gaps
  std::size_t dropped_faces = 0;    // naming a vertex twice
  std::size_t split_vertices = 0;   // where fans of faces touch in one vertex only
};
// A 2-manifold, oriented, with or without borders, of the same faces. Unused vertices and colours are dropped. Throws
// DataError, saying how many, where edges have more than two faces or faces that disagree about the front.
Mesh MakeManifold(const Mesh& mesh, MeshRepair* repair = nullptr);

struct MeshParts {
  std::size_t parts = 0;
  std::size_t closed_parts = 0;
  std::size_t handles = 0;  // of the closed parts together; a torus has one
  std::size_t least_faces =
      0;  // that surfaces like these can have: 4 a sphere, 14 a torus (Heawood's bound), 1 an open part
};
// Of a 2-manifold.
MeshParts CountParts(const Mesh& mesh);

struct MeshPart {
  bool closed = true;
  std::size_t faces = 0;
  std::size_t handles = 0;      // of a closed one
  std::size_t least_faces = 0;  // as above
};
struct LabelledParts {
  std::vector<MeshPart> parts;
  std::vector<std::int32_t> of_face;  // the part that each face belongs to
};
// Of a 2-manifold: what CountParts adds up.
LabelledParts LabelParts(const Mesh& mesh);

}  // namespace lumi
