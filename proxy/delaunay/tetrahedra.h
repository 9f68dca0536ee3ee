// A Delaunay tetrahedralisation as flat arrays: what the visibility walk and the cut need, without CGAL's types.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lumi {

struct Tetrahedra {
  struct Cell {
    std::array<std::int32_t, 4> vertex{};    // positively oriented; -1 is the vertex at infinity
    std::array<std::int32_t, 4> neighbor{};  // neighbor[i] is across the facet opposite vertex[i]
    bool finite() const { return vertex[0] >= 0 && vertex[1] >= 0 && vertex[2] >= 0 && vertex[3] >= 0; }
  };
  // Outward plane of a facet: n . x = offset, |n| = 1.
  struct FacetPlane {
    Eigen::Vector3d n = Eigen::Vector3d::Zero();
    double offset = 0;
  };

  std::vector<Eigen::Vector3d> vertices;
  std::vector<Cell> cells;
  std::vector<std::array<FacetPlane, 4>> planes;  // a cell; zero normals for infinite cells
  std::vector<std::int32_t> first_cell;           // cells around vertex v: incident[first_cell[v] .. first_cell[v + 1])
  std::vector<std::int32_t> incident;

  std::span<const std::int32_t> CellsAround(std::int32_t vertex) const {
    const auto begin = static_cast<std::size_t>(first_cell[static_cast<std::size_t>(vertex)]);
    const auto end = static_cast<std::size_t>(first_cell[static_cast<std::size_t>(vertex) + 1]);
    return {incident.data() + begin, end - begin};
  }
};

// Corners of the facet opposite corner i of a positively oriented cell, counter-clockwise seen from outside the cell.
inline constexpr std::array<std::array<int, 3>, 4> kFacetCorners = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

struct LocatedTetrahedra {
  Tetrahedra tetrahedra;
  std::vector<std::int32_t> query_cell;  // the cell that holds each query point (the smallest index where on a border)
};

// Exact predicates. nullopt: the points are coplanar (no tetrahedron). Coincident points must have been merged before:
// a vertex keeps its index in `points`.
std::optional<LocatedTetrahedra> Tetrahedralize(const std::vector<Eigen::Vector3d>& points,
                                                const std::vector<Eigen::Vector3d>& queries);

// A walk along a straight line through the cells, from a vertex towards a target point. At each facet that is crossed
// before the target, `on_facet(cell, facet, distance)` is called: the line leaves `cell` through its facet `facet` at
// `distance` from the vertex; it returns false to stop. Returns the last cell (the one that holds the target, or where
// the walk was stopped), or -1 when the line leaves the hull.
template <typename OnFacet>
std::int32_t WalkFromVertex(const Tetrahedra& tets, std::int32_t vertex, const Eigen::Vector3d& target,
                            const OnFacet& on_facet) {
  const Eigen::Vector3d origin = tets.vertices[static_cast<std::size_t>(vertex)];
  const double length = (target - origin).norm();
  const Eigen::Vector3d d = (target - origin) / length;

  // The first cell is the one around the vertex whose cone holds the direction: the worst of its three side facets is
  // turned away from it the most. A minimum always exists, so rounding cannot leave the walk without a start.
  std::int32_t cell = -1;
  int entry = -1;
  double best = 2;
  for (const std::int32_t candidate : tets.CellsAround(vertex)) {
    const Tetrahedra::Cell& c = tets.cells[static_cast<std::size_t>(candidate)];
    if (!c.finite()) continue;
    double worst = -2;
    for (int i = 0; i < 4; ++i) {
      if (c.vertex[static_cast<std::size_t>(i)] == vertex) continue;
      worst = std::max(worst, tets.planes[static_cast<std::size_t>(candidate)][static_cast<std::size_t>(i)].n.dot(d));
    }
    if (worst < best) {
      best = worst;
      cell = candidate;
    }
  }
  if (cell < 0) return -1;

  double travelled = 0;
  bool first = true;
  // A line crosses each cell once; the bound only ends a walk that rounding sent round in circles among slivers.
  for (std::size_t step = 0; step < tets.cells.size(); ++step) {
    const Tetrahedra::Cell& c = tets.cells[static_cast<std::size_t>(cell)];
    if (!c.finite()) return -1;
    // Clip the line against the convex cell: it leaves through the nearest plane that it approaches from inside.
    int exit = -1;
    double exit_distance = 0;
    for (int i = 0; i < 4; ++i) {
      if (i == entry) continue;
      if (first && c.vertex[static_cast<std::size_t>(i)] != vertex) continue;  // side facets pass through the vertex
      const Tetrahedra::FacetPlane& plane = tets.planes[static_cast<std::size_t>(cell)][static_cast<std::size_t>(i)];
      const double approach = plane.n.dot(d);
      if (approach <= 1e-14) continue;
      const double distance = (plane.offset - plane.n.dot(origin)) / approach;
      if (exit < 0 || distance < exit_distance) {
        exit = i;
        exit_distance = distance;
      }
    }
    if (exit < 0) {  // flat to rounding and parallel to the line: go on through any facet
      exit = entry == 0 ? 1 : 0;
      exit_distance = travelled;
    }
    travelled = std::max(travelled, exit_distance);
    if (travelled >= length) return cell;
    if (!on_facet(cell, exit, travelled)) return cell;
    const std::int32_t next = c.neighbor[static_cast<std::size_t>(exit)];
    const Tetrahedra::Cell& n = tets.cells[static_cast<std::size_t>(next)];
    entry = 0;
    while (entry < 3 && n.neighbor[static_cast<std::size_t>(entry)] != cell) ++entry;
    cell = next;
    first = false;
  }
  return -1;
}

}  // namespace lumi
