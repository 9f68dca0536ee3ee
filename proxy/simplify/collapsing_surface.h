// A closed surface whose edges are collapsed one by one: neighbours of vertices, the planes of the faces, and what the
// surface's shape allows. The derived class decides which edge goes, and where its ends become one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "proxy/simplify/mesh_topology.h"
#include "scene/geometry/mesh.h"

namespace lumi {

class CollapsingSurface {
 public:
  // mesh: closed, 2-manifold.
  explicit CollapsingSurface(const Mesh& mesh);
  std::size_t face_count() const { return face_count_; }
  Mesh Result() const;

 protected:
  using Vector3d = Eigen::Vector3d;
  using VertexIndex = std::int32_t;
  using FaceIndex = std::int32_t;
  static constexpr std::size_t kMostNeighbours = 48;
  // A face of a fan without its apex, and what it was before: a vertex moves, or two become one.
  struct FanSide {
    Vector3d p, q, apex, normal;
  };

  static std::size_t Index(std::int32_t i) { return static_cast<std::size_t>(i); }
  const Vector3d& At(VertexIndex v) const { return x_[Index(v)]; }
  double SideLength(std::size_t f, std::size_t side) const {
    return (At(faces_[f][side]) - At(faces_[f][(side + 1) % 3])).squaredNorm();
  }
  bool Has(FaceIndex f, VertexIndex v) const {
    const auto& t = faces_[Index(f)];
    return t[0] == v || t[1] == v || t[2] == v;
  }
  // The vertices around v, each once.
  template <typename Visit>
  void ForEachNeighbour(VertexIndex v, Visit visit) const {
    for (const FaceIndex f : around_[Index(v)]) {
      const auto& t = faces_[Index(f)];
      visit(t[0] == v ? t[1] : t[1] == v ? t[2] : t[0]);
    }
  }
  // Would the surface still be a manifold of the same genus? The two ends must have the edge's two wings in common and
  // nothing else, and no vertex may be left with fewer than three faces.
  bool Linked(VertexIndex a, VertexIndex b) const;
  // Both ends at x: no new face turned over against the one it replaces, none a sliver unless those before were worse.
  bool FanIsSound(VertexIndex a, VertexIndex b, const Vector3d& x) const;
  // The faces around v that do not touch `other`.
  void AddFan(VertexIndex v, VertexIndex other, std::vector<FanSide>& fan, double& size2, double& worst_before) const;
  void MoveTo(VertexIndex v, const Vector3d& x);
  // b becomes a, at x; the vertices that a was not beside before.
  std::vector<VertexIndex> Merge(VertexIndex a, VertexIndex b, const Vector3d& x);

  NormalisedFrame frame_;
  std::vector<Vector3d> x_;
  std::vector<std::array<VertexIndex, 3>> faces_;
  std::vector<std::vector<FaceIndex>> around_;  // of each vertex; empty: the vertex is gone
  std::vector<Vector3d> normal_;                // of length 1; 0 for a face without area
  std::vector<double> area2_;                   // twice the area; 0 for a face without
  std::vector<bool> alive_;
  std::size_t face_count_ = 0;

 private:
  void UpdatePlane(FaceIndex f);
};

}  // namespace lumi
