#include "render/radiance/sparse/sparse_proxy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>
#include <unordered_map>

namespace lumi {
namespace {

// Of the proxy's extent: how far a face's corners may lie off a facet's plane.
constexpr double kCoplanar = 1e-7;

std::uint64_t Key(std::int32_t a, std::int32_t b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32) | static_cast<std::uint32_t>(b);
}

}  // namespace

bool Facet::Contains(const Eigen::Vector3d& x) const {
  const Eigen::Vector2d p(axis_u.dot(x), axis_v.dot(x));
  int winding = 0;
  for (const auto& [a, b] : border) {
    if ((a.y() <= p.y()) == (b.y() <= p.y())) continue;
    const double side = (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
    if (b.y() > a.y() ? side > 0 : side < 0) winding += b.y() > a.y() ? 1 : -1;
  }
  return winding != 0;
}

SparseProxy::SparseProxy(const Mesh& mesh, const Similarity3& normalized_from_world) {
  if (const auto problem = Validate(mesh)) throw std::invalid_argument("SparseProxy: " + *problem);
  std::map<std::array<double, 3>, std::int32_t> welded;
  std::vector<std::int32_t> id(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const auto& v = mesh.vertices[i];
    const auto [at, fresh] = welded.try_emplace({v.x(), v.y(), v.z()}, static_cast<std::int32_t>(vertices_.size()));
    if (fresh) vertices_.push_back(normalized_from_world * v);
    id[i] = at->second;
  }
  vertex_normals_.assign(vertices_.size(), Eigen::Vector3f::Zero());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    std::array<std::int32_t, 3> face;
    for (std::size_t i = 0; i < 3; ++i) face[i] = id[static_cast<std::size_t>(mesh.faces[f][i])];
    const auto at = [&](std::size_t i) -> const Eigen::Vector3d& {
      return vertices_[static_cast<std::size_t>(face[i])];
    };
    const Eigen::Vector3d normal = (at(1) - at(0)).cross(at(2) - at(0));
    if (!(normal.squaredNorm() > 0)) continue;
    faces_.push_back(face);
    face_ids_.push_back(static_cast<std::int32_t>(f));
    for (const std::int32_t v : face) vertex_normals_[static_cast<std::size_t>(v)] += normal.cast<float>();
  }
  for (auto& n : vertex_normals_) n = n.squaredNorm() > 0 ? Eigen::Vector3f(n.normalized()) : Eigen::Vector3f::Zero();
  FindFacets();
}

void SparseProxy::FindFacets() {
  double extent = 0;
  for (const auto& v : vertices_) extent = std::max(extent, (v - vertices_.front()).norm());
  const double tolerance = kCoplanar * extent;
  const auto at = [&](std::int32_t v) -> const Eigen::Vector3d& { return vertices_[static_cast<std::size_t>(v)]; };

  std::unordered_multimap<std::uint64_t, std::int32_t> face_of_edge;  // directed
  face_of_edge.reserve(3 * faces_.size());
  std::vector<double> area(faces_.size());
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const auto& c = faces_[f];
    area[f] = (at(c[1]) - at(c[0])).cross(at(c[2]) - at(c[0])).norm();
    for (std::size_t i = 0; i < 3; ++i) face_of_edge.emplace(Key(c[i], c[(i + 1) % 3]), static_cast<std::int32_t>(f));
  }
  // The largest first: its plane is the best known.
  std::vector<std::int32_t> order(faces_.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    const double x = area[static_cast<std::size_t>(a)], y = area[static_cast<std::size_t>(b)];
    return x != y ? x > y : a < b;
  });

  std::vector<bool> taken(faces_.size(), false);
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  std::size_t edge_count = 0;
  for (const std::int32_t seed : order) {
    if (taken[static_cast<std::size_t>(seed)]) continue;
    if (facets_.size() == kMaxFacets || edge_count > kMaxFacetEdges) {
      facets_.clear();
      return;
    }
    const auto& c = faces_[static_cast<std::size_t>(seed)];
    Facet facet;
    facet.normal = (at(c[1]) - at(c[0])).cross(at(c[2]) - at(c[0])).normalized();
    facet.offset = facet.normal.dot(at(c[0]) + at(c[1]) + at(c[2])) / 3;
    facet.face = face_ids_[static_cast<std::size_t>(seed)];
    const auto coplanar = [&](std::int32_t f) {
      const auto& g = faces_[static_cast<std::size_t>(f)];
      for (const std::int32_t v : g)
        if (std::abs(facet.normal.dot(at(v)) - facet.offset) > tolerance) return false;
      return facet.normal.dot((at(g[1]) - at(g[0])).cross(at(g[2]) - at(g[0]))) > 0;
    };
    std::vector<std::int32_t> members{seed};
    taken[static_cast<std::size_t>(seed)] = true;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const auto g = faces_[static_cast<std::size_t>(members[i])];
      for (std::size_t e = 0; e < 3; ++e) {
        const auto range = face_of_edge.equal_range(Key(g[(e + 1) % 3], g[e]));
        for (auto n = range.first; n != range.second; ++n)
          if (!taken[static_cast<std::size_t>(n->second)] && coplanar(n->second)) {
            taken[static_cast<std::size_t>(n->second)] = true;
            members.push_back(n->second);
          }
      }
    }
    std::map<std::pair<std::int32_t, std::int32_t>, int> directed;  // net count, by ascending vertices
    for (const std::int32_t m : members) {
      const auto& g = faces_[static_cast<std::size_t>(m)];
      for (std::size_t e = 0; e < 3; ++e) {
        const std::int32_t a = g[e], b = g[(e + 1) % 3];
        directed[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
      }
    }
    facet.axis_u = facet.normal.unitOrthogonal();
    facet.axis_v = facet.normal.cross(facet.axis_u);
    const auto in_plane = [&](std::int32_t v) {
      return Eigen::Vector2d(facet.axis_u.dot(at(v)), facet.axis_v.dot(at(v)));
    };
    std::set<std::int32_t> on_border;
    for (const auto& [edge, net] : directed) {
      if (net == 0) continue;
      const auto [a, b] = net > 0 ? edge : std::pair(edge.second, edge.first);
      for (int i = 0; i < std::abs(net); ++i) {
        facet.border.push_back({in_plane(a), in_plane(b)});
        facet.border_vertices.push_back({a, b});
      }
      on_border.insert({a, b});
      edges.insert(edge);
    }
    facet.vertices.assign(on_border.begin(), on_border.end());
    edge_count += facet.border.size();
    facets_.push_back(std::move(facet));
  }
#ifdef LUMI_NO_CGAL
  coarse_ = false;  // nothing here triangulates facets
#else
  coarse_ = edge_count <= kMaxFacetEdges;
#endif
  if (!coarse_) facets_.clear();
  if (coarse_)
    for (const auto& [a, b] : edges) edges_.push_back({a, b});
}

}  // namespace lumi
