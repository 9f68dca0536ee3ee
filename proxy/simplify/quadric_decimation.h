// Fewer faces, as near to the surface as they can be: quadric decimation (Garland and Heckbert, Surface simplification
// using quadric error metrics, SIGGRAPH 1997) with OpenMesh. Whole vertices go, each onto the neighbour that costs
// least; at the end each vertex that is left moves to where its quadric, the sum of all planes that it stands for, is
// least, which takes back most of what choosing among old vertices costs. Borders count as planes that stand upright on
// their faces. Parts and their genus stay as they are. Distances and areas are the world's, or pixels of the photos.
//
// Nothing is kept on one side: silhouettes shrink here and grow there. progressive_hull.h is the way that covers them.
#pragma once

#include <cstddef>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/program/progress.h"

namespace lumi {

struct DecimatedMesh {
  Mesh mesh;
  double seconds = 0;   // from the start to this number of faces
  bool reached = true;  // false: no vertex is left that may go, there are more faces than wanted
};

// One mesh for each of `faces`, in the same order, all from one run. mesh: 2-manifold, oriented (MakeManifold sees to
// it), open or closed. Faces without area go first and even where there is nothing else to do. `scale`: what a world
// unit at each face counts (PixelScale), > 0; empty: 1 everywhere. Throws Interrupted.
std::vector<DecimatedMesh> Decimate(const Mesh& mesh, const std::vector<std::size_t>& faces, ProgressSink& progress,
                                    const std::vector<double>& scale = {});

}  // namespace lumi
