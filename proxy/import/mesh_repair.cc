#include "proxy/import/mesh_repair.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "scene/geometry/disjoint_sets.h"

namespace lumi {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using RepairKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Face = std::array<std::int32_t, 3>;

std::size_t At(std::int32_t i) { return static_cast<std::size_t>(i); }

std::uint64_t UndirectedEdge(std::int32_t a, std::int32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32 | static_cast<std::uint32_t>(std::max(a, b));
}

void DropNotFinite(Mesh& mesh, MeshFlaws& flaws) {
  const auto bad = [&](std::int32_t v) { return !mesh.vertices[At(v)].allFinite(); };
  for (const Eigen::Vector3d& v : mesh.vertices) flaws.not_finite_vertices += !v.allFinite();
  std::erase_if(mesh.faces, [&](const Face& f) { return bad(f[0]) || bad(f[1]) || bad(f[2]); });
}

void MergeVertices(Mesh& mesh, MeshFlaws& flaws) {
  struct Hash {
    std::size_t operator()(const std::array<std::uint64_t, 3>& k) const {
      return static_cast<std::size_t>((k[0] * 0x9e3779b97f4a7c15ULL ^ k[1]) * 0xbf58476d1ce4e5b9ULL ^
                                      k[2] * 0x94d049bb133111ebULL);
    }
  };
  std::unordered_map<std::array<std::uint64_t, 3>, std::int32_t, Hash> first;
  std::vector<std::int32_t> to(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    to[i] = static_cast<std::int32_t>(i);
    const Eigen::Vector3d v = mesh.vertices[i].array() + 0.0;  // -0 is 0
    if (!v.allFinite()) continue;
    const auto [it, added] = first.try_emplace(
        {std::bit_cast<std::uint64_t>(v.x()), std::bit_cast<std::uint64_t>(v.y()), std::bit_cast<std::uint64_t>(v.z())},
        to[i]);
    to[i] = it->second;
    flaws.duplicate_vertices += !added;
  }
  for (Face& f : mesh.faces)
    for (std::int32_t& v : f) v = to[At(v)];
}

void DropFolded(Mesh& mesh, MeshFlaws& flaws) {
  const std::size_t before = mesh.faces.size();
  std::erase_if(mesh.faces, [](const Face& f) { return f[0] == f[1] || f[1] == f[2] || f[2] == f[0]; });
  flaws.zero_area_faces += before - mesh.faces.size();
}

std::size_t DropDuplicateFaces(Mesh& mesh) {
  std::set<Face> seen;
  const std::size_t before = mesh.faces.size();
  std::erase_if(mesh.faces, [&](Face f) {
    std::ranges::sort(f);
    return !seen.insert(f).second;
  });
  return before - mesh.faces.size();
}

// The corner that lies between the other two, for three collinear ones; else -1.
int MiddleCorner(const Mesh& mesh, const Face& f) {
  const auto point = [&](std::size_t k) {
    const Eigen::Vector3d& v = mesh.vertices[At(f[k])];
    return RepairKernel::Point_3(v.x(), v.y(), v.z());
  };
  const std::array<RepairKernel::Point_3, 3> p{point(0), point(1), point(2)};
  if (!CGAL::collinear(p[0], p[1], p[2])) return -1;
  for (int k = 0; k < 3; ++k)
    if (CGAL::collinear_are_ordered_along_line(p[At((k + 1) % 3)], p[At(k)], p[At((k + 2) % 3)])) return k;
  return 0;
}

// A face without area is a seam: its longest edge runs along two shorter ones. The face across the longest edge is
// split at the corner in the middle, which closes the seam; where there is none, nothing is lost with it.
void CollapseZeroArea(Mesh& mesh, MeshFlaws& flaws) {
  for (std::size_t round = 0; round < 64; ++round) {
    std::vector<std::pair<std::size_t, int>> flat;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f)
      if (const int middle = MiddleCorner(mesh, mesh.faces[f]); middle >= 0) flat.emplace_back(f, middle);
    if (flat.empty()) return;
    std::unordered_map<std::uint64_t, std::vector<std::size_t>> faces_at;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f)
      for (std::size_t k = 0; k < 3; ++k)
        faces_at[UndirectedEdge(mesh.faces[f][k], mesh.faces[f][(k + 1) % 3])].push_back(f);
    std::vector<bool> gone(mesh.faces.size(), false), touched(mesh.faces.size(), false);
    std::vector<Face> more;
    for (const auto& [f, middle] : flat) {
      if (touched[f]) continue;
      const std::int32_t m = mesh.faces[f][At(middle)], a = mesh.faces[f][At((middle + 1) % 3)],
                         b = mesh.faces[f][At((middle + 2) % 3)];
      const auto& across = faces_at[UndirectedEdge(a, b)];
      std::size_t other = mesh.faces.size();
      if (across.size() == 2) other = across[0] == f ? across[1] : across[0];
      if (other < mesh.faces.size() && touched[other]) continue;  // in the next round
      touched[f] = gone[f] = true;
      ++flaws.zero_area_faces;
      if (other == mesh.faces.size()) continue;
      touched[other] = gone[other] = true;
      Face g = mesh.faces[other];
      while (g[0] == a || g[0] == b) std::rotate(g.begin(), g.begin() + 1, g.end());
      if (g[0] == m) continue;  // the same three: a fold
      more.push_back({g[0], g[1], m});
      more.push_back({g[0], m, g[2]});
    }
    std::vector<Face> kept;
    for (std::size_t f = 0; f < mesh.faces.size(); ++f)
      if (!gone[f]) kept.push_back(mesh.faces[f]);
    kept.insert(kept.end(), more.begin(), more.end());
    mesh.faces = std::move(kept);
    DropDuplicateFaces(mesh);  // a split may have made one that was there
  }
  // Seams upon seams: what is left of them is taken out.
  const std::size_t before = mesh.faces.size();
  std::erase_if(mesh.faces, [&](const Face& f) { return MiddleCorner(mesh, f) >= 0; });
  flaws.zero_area_faces += before - mesh.faces.size();
}

struct OrientationVisitor : PMP::Default_orientation_visitor {
  std::set<std::pair<std::size_t, std::size_t>>* edges;
  std::set<std::size_t>* vertices;
  std::vector<std::size_t>* source;  // of each vertex that was added
  void non_manifold_edge(std::size_t a, std::size_t b, std::size_t) { edges->insert(std::minmax(a, b)); }
  void non_manifold_vertex(std::size_t v, std::size_t) { vertices->insert(v); }
  void duplicated_vertex(std::size_t from, std::size_t) {
    source->push_back(from < source->size() ? (*source)[from] : from);
  }
};

// Cut apart where it is no manifold, and turned one way in each part.
void OrientSoup(Mesh& mesh, MeshFlaws& flaws) {
  std::vector<RepairKernel::Point_3> points;
  for (const Eigen::Vector3d& v : mesh.vertices) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<std::vector<std::size_t>> soup;
  for (const Face& f : mesh.faces) soup.push_back({At(f[0]), At(f[1]), At(f[2])});
  std::set<std::pair<std::size_t, std::size_t>> edges;
  std::set<std::size_t> vertices;
  std::vector<std::size_t> source(mesh.vertices.size());
  std::iota(source.begin(), source.end(), std::size_t{0});
  OrientationVisitor visitor;
  visitor.edges = &edges;
  visitor.vertices = &vertices;
  visitor.source = &source;
  PMP::orient_polygon_soup(points, soup, CGAL::parameters::visitor(visitor));
  flaws.non_manifold_edges += edges.size();
  flaws.non_manifold_vertices += vertices.size();
  source.resize(points.size());
  const bool colored = !mesh.colors.empty();
  for (std::size_t v = mesh.vertices.size(); v < points.size(); ++v) {
    mesh.vertices.push_back(mesh.vertices[source[v]]);
    if (colored) mesh.colors.push_back(mesh.colors[source[v]]);
  }
  for (std::size_t f = 0; f < soup.size(); ++f)
    mesh.faces[f] = {static_cast<std::int32_t>(soup[f][0]), static_cast<std::int32_t>(soup[f][1]),
                     static_cast<std::int32_t>(soup[f][2])};
}

// Numbers of parts whose faces are connected by edges.
std::int32_t FindParts(const Mesh& mesh, std::vector<std::int32_t>& part) {
  DisjointSets sets(mesh.faces.size());
  std::unordered_map<std::uint64_t, std::size_t> edge;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [it, added] = edge.try_emplace(UndirectedEdge(mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]), f);
      if (!added) sets.Join(f, it->second);
    }
  std::int32_t parts = 0;
  part.assign(mesh.faces.size(), -1);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) part[f] = sets.Find(f) == f ? parts++ : part[sets.Find(f)];
  return parts;
}

void DropUnused(Mesh& mesh) {
  std::vector<std::int32_t> to(mesh.vertices.size(), -1);
  Mesh out;
  for (const Face& f : mesh.faces)
    for (const std::int32_t v : f) to[At(v)] = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    if (to[i] < 0) continue;
    to[i] = static_cast<std::int32_t>(out.vertices.size());
    out.vertices.push_back(mesh.vertices[i]);
    if (!mesh.colors.empty()) out.colors.push_back(mesh.colors[i]);
  }
  for (const Face& f : mesh.faces) out.faces.push_back({to[At(f[0])], to[At(f[1])], to[At(f[2])]});
  mesh = std::move(out);
}

std::uint64_t Directed(std::int32_t a, std::int32_t b) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32 | static_cast<std::uint32_t>(b);
}

}  // namespace

bool MeshFlaws::none() const {
  return not_finite_vertices + duplicate_vertices + duplicate_faces + zero_area_faces + non_manifold_edges +
             non_manifold_vertices + turned_faces + inside_out_parts ==
         0;
}

std::string MeshFlaws::Describe() const {
  std::string text;
  const auto add = [&](std::size_t n, const char* one, const char* several) {
    if (n > 0) text += (text.empty() ? "" : ", ") + std::to_string(n) + " " + (n == 1 ? one : several);
  };
  add(not_finite_vertices, "vertex that is no number", "vertices that are no numbers");
  add(duplicate_vertices, "vertex twice", "vertices twice");
  add(duplicate_faces, "face twice", "faces twice");
  add(zero_area_faces, "face without area", "faces without area");
  add(non_manifold_edges, "edge with more than two faces", "edges with more than two faces");
  add(non_manifold_vertices, "vertex where parts touch", "vertices where parts touch");
  add(turned_faces, "face turned against its neighbours", "faces turned against their neighbours");
  add(inside_out_parts, "part inside out", "parts inside out");
  return text.empty() ? "none" : text;
}

RepairedMesh RepairMesh(const Mesh& mesh) {
  for (const Face& f : mesh.faces)
    for (const std::int32_t v : f)
      if (v < 0 || At(v) >= mesh.vertices.size()) throw std::invalid_argument("RepairMesh: a face names no vertex");
  RepairedMesh r;
  r.mesh = mesh;
  if (r.mesh.colors.size() != r.mesh.vertices.size()) r.mesh.colors.clear();
  const std::size_t given = r.mesh.faces.size();
  DropNotFinite(r.mesh, r.flaws);
  r.faces_lost = given - r.mesh.faces.size();
  // Where a mesh is closed as it is, vertices at one place are what keeps its parts apart.
  if (!IsClosed(r.mesh)) MergeVertices(r.mesh, r.flaws);
  DropFolded(r.mesh, r.flaws);
  r.flaws.duplicate_faces = DropDuplicateFaces(r.mesh);
  CollapseZeroArea(r.mesh, r.flaws);

  // Which way round most faces of a part were: that stays.
  const Mesh unturned = r.mesh;
  OrientSoup(r.mesh, r.flaws);
  r.parts = FindParts(r.mesh, r.part);
  std::vector<std::size_t> turned(At(r.parts), 0), faces(At(r.parts), 0);
  std::vector<bool> is_turned(r.mesh.faces.size(), false);
  for (std::size_t f = 0; f < r.mesh.faces.size(); ++f) {
    const Face &was = unturned.faces[f], &now = r.mesh.faces[f];
    // Vertices may have been doubled: the corners' places tell the way round, as all of them differ.
    const auto place = [&](std::int32_t v) { return r.mesh.vertices[At(v)]; };
    std::size_t shift = 0;
    while (shift < 3 && place(now[shift]) != unturned.vertices[At(was[0])]) ++shift;
    is_turned[f] = shift < 3 && place(now[(shift + 1) % 3]) != unturned.vertices[At(was[1])];
    ++faces[At(r.part[f])];
    turned[At(r.part[f])] += is_turned[f];
  }
  for (std::size_t f = 0; f < r.mesh.faces.size(); ++f)
    if (const std::size_t p = At(r.part[f]); 2 * turned[p] > faces[p])
      std::swap(r.mesh.faces[f][1], r.mesh.faces[f][2]);
  for (std::size_t p = 0; p < turned.size(); ++p) r.flaws.turned_faces += std::min(turned[p], faces[p] - turned[p]);
  DropUnused(r.mesh);
  return r;
}

void OrientParts(RepairedMesh& r, const std::vector<long>& votes) {
  std::vector<bool> open(At(r.parts), false), turn(At(r.parts), false);
  std::set<std::uint64_t> edges;
  for (const Face& f : r.mesh.faces)
    for (std::size_t k = 0; k < 3; ++k) edges.insert(Directed(f[k], f[(k + 1) % 3]));
  std::vector<double> volume(At(r.parts), 0);
  std::vector<std::int32_t> origin(At(r.parts), -1);
  for (std::size_t f = 0; f < r.mesh.faces.size(); ++f) {
    const Face& v = r.mesh.faces[f];
    const std::size_t p = At(r.part[f]);
    for (std::size_t k = 0; k < 3; ++k)
      if (edges.count(Directed(v[(k + 1) % 3], v[k])) == 0) open[p] = true;
    if (origin[p] < 0) origin[p] = v[0];
    const Eigen::Vector3d& o = r.mesh.vertices[At(origin[p])];
    Eigen::Matrix3d corners;
    for (std::size_t k = 0; k < 3; ++k) corners.col(static_cast<Eigen::Index>(k)) = r.mesh.vertices[At(v[k])] - o;
    volume[p] += corners.determinant();
  }
  for (std::size_t p = 0; p < turn.size(); ++p) {
    const long vote = p < votes.size() ? votes[p] : 0;
    turn[p] = vote < 0 || (vote == 0 && !open[p] && volume[p] < 0);
    r.flaws.inside_out_parts += turn[p];
  }
  for (std::size_t f = 0; f < r.mesh.faces.size(); ++f)
    if (turn[At(r.part[f])]) std::swap(r.mesh.faces[f][1], r.mesh.faces[f][2]);
}

}  // namespace lumi
