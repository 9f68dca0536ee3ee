// The Delaunay triangulation of points of an integer lattice in a rectangle (Bowyer 1981, Watson 1981), in exact
// arithmetic: whatever the points (cocircular, collinear, a lattice unit apart), the triangles tile the rectangle. By
// hand, as measured (docs/view-triangulation.md): 0.86 ms for 2000 points, where CGAL takes 1.18 and OpenCV's Subdiv2D,
// in floats, 2.47.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lumi {

struct LatticePoint {
  std::int32_t x = 0, y = 0;
  friend bool operator==(const LatticePoint&, const LatticePoint&) = default;
};

// The sign predicates below do not overflow up to this coordinate.
constexpr std::int32_t kMaxLattice = 1 << 28;

// Twice the signed area of a, b, c: positive where they turn from the x axis to the y axis. Exact.
std::int64_t TurnOf(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c);
// Positive where d lies inside the circle through a, b, c (which turn positively), 0 on it. Exact.
int InCircle(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, const LatticePoint& d);

// Triangles that turn positively, as indices into `points`. points[0..3] are the rectangle's corners (0,0), (w,0),
// (w,h), (0,h); the others lie inside it or on its border. Of points at one place the one that is inserted first is a
// vertex, the others are in no triangle. O(n log n) expected; the same input gives the same triangles. Throws
// std::invalid_argument for other input.
std::vector<std::array<std::int32_t, 3>> TriangulateLattice(std::span<const LatticePoint> points);

}  // namespace lumi
