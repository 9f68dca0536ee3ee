// Fewer faces that still enclose the same body: the progressive hull of Sander, Gu, Gortler, Hoppe and Snyder
// (Silhouette Clipping, SIGGRAPH 2000, section 4), as the thesis simplifies its car (section 5.3.4).
//
// An edge is collapsed to the point that adds the least volume of all points outside the planes of every face around
// the edge: a linear program. Each of those faces then spans a tetrahedron of positive volume with the new vertex, and
// what lies between old and new surface is the sum of them: the number of times that the surface winds around a point
// never falls, wherever the point is. So every silhouette of the result covers that of the input, even where the
// surface should run through itself.
#pragma once

#include <cstddef>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/program/progress.h"

namespace lumi {

struct KeptHull {
  Mesh mesh;
  double seconds = 0;   // from the start to this number of faces
  bool reached = true;  // false: no edge is left that may be collapsed, there are more faces than wanted
};

struct ProgressiveHullSummary {
  std::size_t collapses = 0;
  std::size_t programs = 0;  // edges whose place was sought, again wherever their neighbourhood had changed
  double volume_before = 0;  // cubic world units
  double evaluate_s = 0;     // seconds of the parallel part
  bool fell_back = false;    // drawing vertices inwards left something outside: done again without
};

// One mesh for each of `faces`, in the same order, all from one run. mesh: closed, 2-manifold, front faces outwards
// (connected fans at vertices too; MakeManifold sees to it). Parts and their genus stay as they are. Faces without area
// go first and even where there is nothing else to do. Throws DataError for a mesh that is open or encloses nothing;
// Interrupted.
std::vector<KeptHull> KeepHull(const Mesh& mesh, const std::vector<std::size_t>& faces, ProgressSink& progress,
                               ProgressiveHullSummary* summary = nullptr);

}  // namespace lumi
