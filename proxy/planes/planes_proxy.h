// A few planes as a proxy (thesis sec. 5.3.2: ground and backdrop): found in the sparse points by robust fitting, or
// given.
//
// Planes are found one after the other (random samples, local in space, scored by points within their own uncertainty),
// refitted, merged where one explains both, and cut where they meet, so that a ground and a backdrop join at their
// crease. A plane that has the whole scene on its cameras' side reaches as far as the views see; one amid the scene
// ends where its points end.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"

namespace lumi {

struct PlanesOptions {
  PointSelectionOptions points;
  int max_planes = 6;
  double tolerance = 0.01;     // of the median depth: a point this near to a plane is on it, beside its own uncertainty
  double min_share = 0.05;     // of the reliable points: fewer make no plane
  int trials = 600;            // random samples a plane
  double merge_angle_deg = 8;  // planes nearer than this in direction are tried as one
  bool backdrop = true;    // a plane behind everything where the others leave more than 2 % of the views' rays empty
  double far_factor = 20;  // of the median depth: how far a plane reaches where rays run along it
  std::uint64_t seed = 0;
};
std::string Validate(const PlanesOptions& options);  // empty, or what is wrong

struct FittedPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit, towards most of the cameras
  double offset = 0;                                  // normal . x = offset, world
  std::vector<std::int32_t> points;                   // into the selection; empty: given, or the backdrop
  double rms = 0;                                     // of its points, in world units
};

struct PlanesSummary {
  std::vector<FittedPlane> planes;
  std::size_t points = 0, points_on_planes = 0;
  bool backdrop_added = false;
  double coverage = 0;  // of the views' rays
};

// `given`: planes to use instead of looking for some (their normals may point either way). Front faces look at the
// cameras. Throws DataError where no plane is found.
Mesh BuildPlanesProxy(const Scene& scene, const PlanesOptions& options, const std::vector<FittedPlane>& given = {},
                      PlanesSummary* summary = nullptr);

}  // namespace lumi
