#include "proxy/delaunay/surface.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "scene/geometry/disjoint_sets.h"

namespace lumi {
namespace {

struct BoundaryFacet {
  std::int32_t cell;  // the free one
  int facet;
};

std::uint64_t EdgeKey(std::int32_t a, std::int32_t b) {
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32) |
         static_cast<std::uint32_t>(std::max(a, b));
}

// Turns through the free cells around the edge (a, b) from a boundary facet to the next one: the other side of the
// wedge of free space.
BoundaryFacet OtherSide(const Tetrahedra& tets, const std::vector<std::uint8_t>& free, BoundaryFacet start,
                        std::int32_t a, std::int32_t b) {
  std::int32_t cell = start.cell;
  int from = start.facet;
  for (;;) {
    const Tetrahedra::Cell& c = tets.cells[static_cast<std::size_t>(cell)];
    // The facets at the edge are those opposite the two vertices that are not on it; one we came through.
    int to = 0;
    while (to == from || c.vertex[static_cast<std::size_t>(to)] == a || c.vertex[static_cast<std::size_t>(to)] == b)
      ++to;
    const std::int32_t next = c.neighbor[static_cast<std::size_t>(to)];
    if (!free[static_cast<std::size_t>(next)]) return {cell, to};
    const Tetrahedra::Cell& n = tets.cells[static_cast<std::size_t>(next)];
    from = 0;
    while (n.neighbor[static_cast<std::size_t>(from)] != cell) ++from;
    cell = next;
  }
}

// Where several fans of faces meet at a vertex each gets one of its own, at the same place: 2-manifold. Each edge must
// lie in two faces, in opposite directions.
void SeparateFans(Mesh& mesh) {
  DisjointSets fans(3 * mesh.faces.size());  // of each face's corners
  std::unordered_map<std::uint64_t, std::size_t>
      first;  // corner at the lesser vertex, corner at the greater one: of one face
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      std::size_t low = 3 * f + k, high = 3 * f + (k + 1) % 3;
      const std::int32_t a = mesh.faces[f][k], b = mesh.faces[f][(k + 1) % 3];
      if (a > b) std::swap(low, high);
      const auto [it, added] = first.try_emplace(EdgeKey(a, b), low);
      if (added) continue;
      // Its face's other corner on the edge lies on the other side there, as the two run in opposite directions.
      const std::size_t other = it->second / 3 * 3;
      const std::int32_t greater = std::max(a, b);
      std::size_t match = other;
      while (mesh.faces[other / 3][match - other] != greater) ++match;
      fans.Join(low, it->second);
      fans.Join(high, match);
    }
  std::vector<std::size_t> owner(mesh.vertices.size(), 3 * mesh.faces.size());  // the fan that keeps the vertex
  std::unordered_map<std::size_t, std::int32_t> fresh;
  for (std::size_t i = 0; i < 3 * mesh.faces.size(); ++i) {
    std::int32_t& v = mesh.faces[i / 3][i % 3];
    const std::size_t fan = fans.Find(i);
    std::size_t& keeps = owner[static_cast<std::size_t>(v)];
    if (keeps == 3 * mesh.faces.size()) keeps = fan;
    if (keeps == fan) continue;
    const auto [it, added] = fresh.try_emplace(fan, static_cast<std::int32_t>(mesh.vertices.size()));
    if (added) mesh.vertices.push_back(Eigen::Vector3d(mesh.vertices[static_cast<std::size_t>(v)]));
    v = it->second;
  }
}

}  // namespace

Mesh ExtractSurface(const Tetrahedra& tets, const std::vector<std::uint8_t>& free) {
  Mesh mesh;
  std::vector<BoundaryFacet> facets;
  std::vector<std::array<std::int32_t, 3>> corners;  // vertices of the tetrahedralisation, seen from the free side
  std::unordered_map<std::uint64_t, int> faces_at;
  for (std::size_t c = 0; c < tets.cells.size(); ++c) {
    if (!free[c]) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      if (free[static_cast<std::size_t>(tets.cells[c].neighbor[i])]) continue;
      std::array<std::int32_t, 3> v{};
      for (std::size_t k = 0; k < 3; ++k)
        v[k] = tets.cells[c].vertex[static_cast<std::size_t>(kFacetCorners[i][2 - k])];
      for (std::size_t k = 0; k < 3; ++k) ++faces_at[EdgeKey(v[k], v[(k + 1) % 3])];
      facets.push_back({static_cast<std::int32_t>(c), static_cast<int>(i)});
      corners.push_back(v);
    }
  }

  std::vector<std::int32_t> index(tets.vertices.size(), -1);
  const auto vertex = [&](std::int32_t v) {
    std::int32_t& i = index[static_cast<std::size_t>(v)];
    if (i < 0) {
      i = static_cast<std::int32_t>(mesh.vertices.size());
      mesh.vertices.push_back(tets.vertices[static_cast<std::size_t>(v)]);
    }
    return i;
  };
  // Middles of edges where several sheets meet, by the boundary facet and edge that ask; both sides of a wedge share
  // one.
  std::unordered_map<std::uint64_t, std::int32_t> middles;
  const auto middle_key = [](const BoundaryFacet& f, std::int32_t a, std::int32_t b, const Tetrahedra::Cell& cell) {
    // The edge within the cell: by the two corners that are not on it (6 combinations), and the facet.
    std::uint64_t mask = 0;
    for (std::size_t k = 0; k < 4; ++k)
      if (cell.vertex[k] == a || cell.vertex[k] == b) mask |= std::uint64_t{1} << k;
    return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(f.cell)) << 8) |
           (static_cast<std::uint64_t>(f.facet) << 4) | mask;
  };
  const auto middle = [&](const BoundaryFacet& f, std::int32_t a, std::int32_t b) {
    const BoundaryFacet other = OtherSide(tets, free, f, a, b);
    const std::uint64_t key = std::min(middle_key(f, a, b, tets.cells[static_cast<std::size_t>(f.cell)]),
                                       middle_key(other, a, b, tets.cells[static_cast<std::size_t>(other.cell)]));
    const auto [it, added] = middles.try_emplace(key, static_cast<std::int32_t>(mesh.vertices.size()));
    if (added) {
      mesh.vertices.push_back(
          0.5 * (tets.vertices[static_cast<std::size_t>(a)] + tets.vertices[static_cast<std::size_t>(b)]));
    }
    return it->second;
  };

  mesh.faces.reserve(facets.size());
  for (std::size_t f = 0; f < facets.size(); ++f) {
    std::array<std::int32_t, 3> v{}, m{};  // corners; middle of the edge that starts at each, or -1
    int split = 0;
    for (std::size_t k = 0; k < 3; ++k) v[k] = vertex(corners[f][k]);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t a = corners[f][k], b = corners[f][(k + 1) % 3];
      m[k] = faces_at[EdgeKey(a, b)] > 2 ? middle(facets[f], a, b) : -1;
      split += m[k] >= 0;
    }
    auto& faces = mesh.faces;
    if (split == 0) {
      faces.push_back(v);
    } else if (split == 3) {
      faces.push_back({m[0], m[1], m[2]});
      for (std::size_t k = 0; k < 3; ++k) faces.push_back({v[k], m[k], m[(k + 2) % 3]});
    } else {
      // Turn it so that edge 0 is split and edge 2 is not.
      std::size_t k = 0;
      while (!(m[k] >= 0 && m[(k + 2) % 3] < 0)) ++k;
      const std::int32_t a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3], ab = m[k], bc = m[(k + 1) % 3];
      faces.push_back({a, ab, c});
      if (bc < 0) {
        faces.push_back({ab, b, c});
      } else {
        faces.push_back({ab, b, bc});
        faces.push_back({ab, bc, c});
      }
    }
  }
  SeparateFans(mesh);
  return mesh;
}

}  // namespace lumi
