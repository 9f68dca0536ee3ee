// A mesh with fewer faces, either way.
//
//   const SimplifiedMesh hull = Simplify(mesh, {500}, SimplifyMethod::kKeepHull, progress).front();
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"
#include "scene/program/progress.h"

namespace lumi {

enum class SimplifyMethod {
  kQuadric,   // nearest to the surface (quadric_decimation.h)
  kInPixels,  // the same, distances and areas as the photos show them (pixel_scale.h)
  kKeepHull,  // encloses the former (progressive_hull.h)
};
std::string Name(SimplifyMethod method);

struct SimplifiedMesh {
  Mesh mesh;
  double seconds = 0;
  bool reached = true;   // false: no edge is left that may go, there are more faces than wanted
  bool wrapped = false;  // of a wrap of the mesh (tight_wrap.h): large meshes full of handles, and with kKeepHull those
                         // that lose most of their faces
};

// One for each of `faces`, in the same order, from runs that they share: `seconds` are from the start of a run.
// Vertices at one place are merged where that closes gaps. Throws UsageError for fewer faces than 1, and than 4 of a
// closed mesh; `views`: for kInPixels. DataError where the mesh is no surface, where its parts and their holes need
// more faces than wanted (naming how many), and for kKeepHull where it is open or inside out; Interrupted.
std::vector<SimplifiedMesh> Simplify(const Mesh& mesh, const std::vector<std::size_t>& faces, SimplifyMethod method,
                                     ProgressSink& progress, const std::vector<ProxyView>& views = {});

}  // namespace lumi
