// Planes and quads by hand, as JSON:
//
//   { "quads":  [ [[x,y,z], [x,y,z], [x,y,z], [x,y,z]], ... ],          taken as they are, corners in order around
//     "planes": [ { "points": [[x,y,z], [x,y,z], [x,y,z], ...] },       through three points or more (least squares)
//                 { "normal": [x,y,z], "offset": d } ] }                normal . x = d
//
// Coordinates are the scene's. Planes are clipped and cut as those that are found; quads are not.
#pragma once

#include <filesystem>

#include "proxy/planes/planes_proxy.h"

namespace lumi {

struct GivenPlanes {
  std::vector<FittedPlane> planes;
  Mesh quads;
};

// Throws InputError: the file, and in one line what is wrong with it (no JSON, a corner that is no number, a quad whose
// corners do not lie in one plane or that is not convex, points in a line).
GivenPlanes ReadPlanesJson(const std::filesystem::path& file);

}  // namespace lumi
