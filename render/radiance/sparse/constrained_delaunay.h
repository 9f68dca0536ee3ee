// A constrained Delaunay triangulation of a few points in the plane (CGAL, exact predicates). Segments that cross get a
// vertex at their crossing. CGAL stays behind this header.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lumi {

struct PlanarTriangulation {
  std::vector<Eigen::Vector2d> points;                 // distinct; not in the order of the input
  std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise for y up; fill the points' convex hull
  std::vector<std::array<std::int32_t, 3>>
      neighbour;  // across the edge opposite to a corner; -1: outside, or constrained
};

// Any input is legal: coincident and collinear points, segments of no length, segments along one another. Fewer than
// three points, or all on a line: no triangles. Replaces `out`.
void TriangulateConstrained(std::span<const Eigen::Vector2d> points,
                            std::span<const std::array<Eigen::Vector2d, 2>> segments, PlanarTriangulation& out);

}  // namespace lumi
