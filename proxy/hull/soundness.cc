#include "proxy/hull/soundness.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/shape_predicates.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <vector>

namespace lumi {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using SoundKernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using SoundMesh = CGAL::Surface_mesh<SoundKernel::Point_3>;

}  // namespace

std::string Soundness::Describe() const {
  if (!manifold) return "not 2-manifold and oriented";
  std::string text = closed ? "closed, 2-manifold" : "open, 2-manifold";
  if (closed) text += outward ? ", front faces outwards" : ", inside out";
  return text + (degenerate_faces == 0 ? ", no degenerate face"
                                       : ", " + std::to_string(degenerate_faces) + " degenerate faces");
}

Soundness CheckSoundness(const Mesh& mesh) {
  Soundness s;
  std::vector<SoundKernel::Point_3> points;
  for (const Eigen::Vector3d& v : mesh.vertices) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<std::vector<std::size_t>> faces;
  for (const auto& f : mesh.faces)
    faces.push_back({static_cast<std::size_t>(f[0]), static_cast<std::size_t>(f[1]), static_cast<std::size_t>(f[2])});
  s.manifold = PMP::is_polygon_soup_a_polygon_mesh(faces);
  if (!s.manifold) return s;
  SoundMesh surface;
  PMP::polygon_soup_to_polygon_mesh(points, faces, surface);
  s.closed = CGAL::is_closed(surface) && !mesh.faces.empty();
  std::vector<SoundMesh::Face_index> degenerate;
  PMP::degenerate_faces(surface, std::back_inserter(degenerate));
  s.degenerate_faces = degenerate.size();
  auto part = surface.add_property_map<SoundMesh::Face_index, std::size_t>("f:part", 0).first;
  s.parts = PMP::connected_components(surface, part);
  if (!s.closed) return s;
  // The signed volume of each part, relative to a point of its own: hulls have parts beside each other, never within.
  std::vector<double> six(s.parts, 0);
  std::vector<SoundKernel::Point_3> origin(s.parts);
  std::vector<bool> seen(s.parts, false);
  for (const SoundMesh::Face_index f : surface.faces()) {
    const SoundMesh::Halfedge_index h = surface.halfedge(f);
    const auto& a = surface.point(surface.source(h));
    const auto& b = surface.point(surface.target(h));
    const auto& c = surface.point(surface.target(surface.next(h)));
    if (!seen[part[f]]) origin[part[f]] = a;
    seen[part[f]] = true;
    const auto& o = origin[part[f]];
    six[part[f]] += CGAL::scalar_product(a - o, CGAL::cross_product(b - o, c - o));
  }
  s.outward = std::ranges::all_of(six, [](double v) { return v > 0; });
  return s;
}

}  // namespace lumi
