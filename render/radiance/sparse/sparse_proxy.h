// The proxy as the sparse plans read it, made once a proxy. Few planar facets (coplanar neighbours merged): the view is
// cut along their projected borders. Many: its vertices are the samples (thesis Examples #4 and #5).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/geometry/similarity3.h"

namespace lumi {

// A proxy of more planar facets, or more border edges, is sampled at its vertices.
constexpr std::size_t kMaxFacets = 200;
constexpr std::size_t kMaxFacetEdges = 4000;

struct Facet {
  Eigen::Vector3d normal;  // unit; n . x = offset, normalised frame
  double offset = 0;
  std::int32_t face = -1;              // one of its faces
  std::vector<std::int32_t> vertices;  // on its border, each once
  // Border, directed, as points in the plane's own axes: what winds around a point decides whether it lies in the
  // facet.
  Eigen::Vector3d axis_u, axis_v;
  std::vector<std::array<Eigen::Vector2d, 2>> border;
  std::vector<std::array<std::int32_t, 2>> border_vertices;  // the same edges by vertex

  // Whether a point of the plane (normalised frame) lies in it.
  bool Contains(const Eigen::Vector3d& x) const;
};

class SparseProxy {
 public:
  // Throws std::invalid_argument for a mesh that is not Validate()'s.
  SparseProxy(const Mesh& mesh, const Similarity3& normalized_from_world);

  bool coarse() const { return coarse_; }
  // Normalised frame; vertices at the same place are one.
  const std::vector<Eigen::Vector3d>& vertices() const { return vertices_; }
  // Faces with an area; `face_ids` are their places in the mesh.
  const std::vector<std::array<std::int32_t, 3>>& faces() const { return faces_; }
  const std::vector<std::int32_t>& face_ids() const { return face_ids_; }
  const std::vector<Eigen::Vector3f>& vertex_normals() const { return vertex_normals_; }  // unit, or zero
  // Coarse proxies only.
  const std::vector<Facet>& facets() const { return facets_; }
  // The facets' border edges, each once.
  struct Edge {
    std::int32_t a, b;
  };
  const std::vector<Edge>& edges() const { return edges_; }

 private:
  void FindFacets();

  bool coarse_ = false;
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::array<std::int32_t, 3>> faces_;
  std::vector<std::int32_t> face_ids_;
  std::vector<Eigen::Vector3f> vertex_normals_;
  std::vector<Facet> facets_;
  std::vector<Edge> edges_;
};

}  // namespace lumi
