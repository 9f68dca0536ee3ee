#include "proxy/delaunay/tetrahedra.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Delaunay_triangulation_cell_base_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_cell_base_with_info_3.h>
#include <CGAL/Triangulation_vertex_base_with_info_3.h>

#include <Eigen/Geometry>
#include <utility>

namespace lumi {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_3<std::int32_t, Kernel>;
using CellBase =
    CGAL::Triangulation_cell_base_with_info_3<std::int32_t, Kernel, CGAL::Delaunay_triangulation_cell_base_3<Kernel>>;
using Triangulation =
    CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;

void SetPlanes(Tetrahedra& tets) {
  tets.planes.resize(tets.cells.size());
  for (std::size_t c = 0; c < tets.cells.size(); ++c) {
    const Tetrahedra::Cell& cell = tets.cells[c];
    if (!cell.finite()) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto corner = [&](int j) -> const Eigen::Vector3d& {
        const auto k = static_cast<std::size_t>(kFacetCorners[i][static_cast<std::size_t>(j)]);
        return tets.vertices[static_cast<std::size_t>(cell.vertex[k])];
      };
      const Eigen::Vector3d n = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      const double norm = n.norm();
      Tetrahedra::FacetPlane& plane = tets.planes[c][i];
      if (norm > 0) plane.n = n / norm;
      plane.offset = plane.n.dot(corner(0));
    }
  }
}

void SetIncidence(Tetrahedra& tets) {
  std::vector<std::int32_t>& first = tets.first_cell;
  first.assign(tets.vertices.size() + 1, 0);
  for (const Tetrahedra::Cell& cell : tets.cells) {
    for (const std::int32_t v : cell.vertex)
      if (v >= 0) ++first[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  tets.incident.resize(static_cast<std::size_t>(first.back()));
  std::vector<std::int32_t> next(first.begin(), first.end() - 1);
  for (std::size_t c = 0; c < tets.cells.size(); ++c) {
    for (const std::int32_t v : tets.cells[c].vertex) {
      if (v < 0) continue;
      tets.incident[static_cast<std::size_t>(next[static_cast<std::size_t>(v)]++)] = static_cast<std::int32_t>(c);
    }
  }
}

}  // namespace

std::optional<LocatedTetrahedra> Tetrahedralize(const std::vector<Eigen::Vector3d>& points,
                                                const std::vector<Eigen::Vector3d>& queries) {
  std::vector<std::pair<Kernel::Point_3, std::int32_t>> input;
  input.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    input.emplace_back(Kernel::Point_3(points[i].x(), points[i].y(), points[i].z()), static_cast<std::int32_t>(i));
  Triangulation triangulation(input.begin(), input.end());  // sorts spatially inside
  if (triangulation.dimension() < 3) return std::nullopt;

  LocatedTetrahedra result;
  Tetrahedra& tets = result.tetrahedra;
  tets.vertices = points;
  std::int32_t count = 0;
  for (auto it = triangulation.all_cells_begin(); it != triangulation.all_cells_end(); ++it) it->info() = count++;
  tets.cells.resize(static_cast<std::size_t>(count));
  for (auto it = triangulation.all_cells_begin(); it != triangulation.all_cells_end(); ++it) {
    Tetrahedra::Cell& cell = tets.cells[static_cast<std::size_t>(it->info())];
    for (int i = 0; i < 4; ++i) {
      const auto vertex = it->vertex(i);
      cell.vertex[static_cast<std::size_t>(i)] = triangulation.is_infinite(vertex) ? -1 : vertex->info();
      cell.neighbor[static_cast<std::size_t>(i)] = it->neighbor(i)->info();
    }
  }
  SetPlanes(tets);
  SetIncidence(tets);

  result.query_cell.reserve(queries.size());
  for (const Eigen::Vector3d& q : queries)
    result.query_cell.push_back(triangulation.locate(Kernel::Point_3(q.x(), q.y(), q.z()))->info());
  return result;
}

}  // namespace lumi
