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
  bool reached = true;   // false: there are more faces than wanted. No edge is left that may go, or with kInPixels its
                         // parts and holes need them (small_parts.h)
  bool wrapped = false;  // of a wrap of the mesh (tight_wrap.h): with kQuadric large meshes full of handles, and with
                         // kKeepHull those that lose most of their faces
  std::size_t removed_parts = 0;  // with kInPixels (small_parts.h)
};

// What to tell the user of a mesh that has more faces than wanted (`reached`).
std::string FacesLeft(std::size_t faces, std::size_t wanted, SimplifyMethod method);

// One for each of `faces`, in the same order, from runs that they share: `seconds` are from the start of a run.
// Vertices at one place are merged where that closes gaps. Throws UsageError for fewer faces than 1, and than 4 of a
// closed mesh; `views`: for kInPixels. DataError where the mesh is no surface, where its parts and their holes need
// more faces than wanted (naming how many; not for kInPixels, which then leaves more), and for kKeepHull where it is
// open or inside out; Interrupted.
std::vector<SimplifiedMesh> Simplify(const Mesh& mesh, const std::vector<std::size_t>& faces, SimplifyMethod method,
                                     ProgressSink& progress, const std::vector<ProxyView>& views = {});

}  // namespace lumi
