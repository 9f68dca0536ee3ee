// The surface of an implicit solid on a sparse grid of cubes, closed and 2-manifold by construction: marching cubes
// (Lorensen & Cline 1987) with a table made here, so that three things hold which the published tables lack.
// - Two cubes agree on the face they share: a face's segments depend on its four signs only. Where they are ambiguous
// the
//   solid's corners are joined, never cut apart: a conservative solid.
// - No diagonal lies in a face of a cube: a neighbour could draw the same one, and four triangles would meet at it.
// - Every cube that the surface enters is there: where one is missing, found by its neighbour's crossed edges, it is
// added.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "scene/geometry/mesh.h"

namespace lumi {

struct GridFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // of corner (0, 0, 0)
  double cell = 1;                                   // a cube's edge
  std::array<int, 3> cells{};                        // each at most kMaxCells
  static constexpr int kMaxCells = (1 << 20) - 2;
  Eigen::Vector3d Corner(int i, int j, int k) const { return origin + cell * Eigen::Vector3d(i, j, k); }
};

// solid(x, cube) < 0 inside; called from several threads, with a point of the given cube: its position among those
// given, or -1 for one found. The grid's own boundary counts as outside.
using Solid = std::function<float(const Eigen::Vector3d& x, std::int32_t cube)>;

// cubes: those that the surface may enter, by the index of their least corner; others are found from them. Vertices lie
// where `solid` changes sign along a cube's edge, to a thousandth of it, but nearer than a hundredth to no corner, so
// that no face is degenerate. Faces are counter-clockwise seen from outside.
Mesh Contour(const GridFrame& grid, const std::vector<std::array<int, 3>>& cubes, const Solid& solid);

// One cube's surface: triangles of edge numbers; kCentre + n stands for the centre of the cube's n-th loop.
struct CubeCase {
  static constexpr int kCentre = 12;
  std::vector<std::array<std::int8_t, 3>> triangles;
  std::vector<std::vector<std::int8_t>> centres;  // the edges whose mean a centre is
};
// bit c of `inside`: corner c = x + 2 y + 4 z. Edges: 4 * axis + the number of their corner among those of the other
// two axes.
const CubeCase& CaseOf(unsigned inside);

}  // namespace lumi
