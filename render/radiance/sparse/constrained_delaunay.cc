#include "render/radiance/sparse/constrained_delaunay.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Constrained_triangulation_face_base_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_data_structure_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

namespace lumi {

void TriangulateConstrained(std::span<const Eigen::Vector2d> points,
                            std::span<const std::array<Eigen::Vector2d, 2>> segments, PlanarTriangulation& out) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Vertex = CGAL::Triangulation_vertex_base_with_info_2<std::int32_t, Kernel>;
  using Face = CGAL::Triangulation_face_base_with_info_2<std::int32_t, Kernel,
                                                         CGAL::Constrained_triangulation_face_base_2<Kernel>>;
  // A crossing's coordinates are rounded; its place in the triangulation is decided exactly.
  using Triangulation =
      CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Vertex, Face>,
                                                 CGAL::Exact_predicates_tag>;
  const auto at = [](const Eigen::Vector2d& x) { return Kernel::Point_2(x.x(), x.y()); };
  Triangulation t;
  for (const auto& p : points) t.insert(at(p));
  for (const auto& s : segments) {
    const auto a = t.insert(at(s[0])), b = t.insert(at(s[1]));
    if (a != b) t.insert_constraint(a, b);
  }
  out.points.clear();
  out.triangles.clear();
  out.neighbour.clear();
  if (t.dimension() < 2) return;
  for (auto v = t.finite_vertices_begin(); v != t.finite_vertices_end(); ++v) {
    v->info() = static_cast<std::int32_t>(out.points.size());
    out.points.emplace_back(v->point().x(), v->point().y());
  }
  std::int32_t count = 0;
  for (auto f = t.finite_faces_begin(); f != t.finite_faces_end(); ++f) f->info() = count++;
  for (auto f = t.finite_faces_begin(); f != t.finite_faces_end(); ++f) {
    auto& corners = out.triangles.emplace_back();
    auto& across = out.neighbour.emplace_back();
    for (int i = 0; i < 3; ++i) {
      const auto s = static_cast<std::size_t>(i);
      corners[s] = f->vertex(i)->info();
      across[s] = f->is_constrained(i) || t.is_infinite(f->neighbor(i)) ? -1 : f->neighbor(i)->info();
    }
  }
}

}  // namespace lumi
