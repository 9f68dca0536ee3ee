// One plane that faces the views, at the robust depth of the points: the least a lumigraph can stand on.
#pragma once

#include <string>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"

namespace lumi {

struct PlaneOptions {
  PointSelectionOptions points;
  double far_factor = 20;  // rays nearly along the plane are cut off at this many times the plane's depth
  double margin = 0.05;    // of the quad's size, added on each side
};
std::string Validate(const PlaneOptions& options);  // empty, or what is wrong

struct PlaneSummary {
  double depth = 0;                                  // of the plane before the mean eye, in world units
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // unit, towards the views
  std::size_t points_used = 0;
  std::size_t clamped_rays = 0;  // frustum corners that look along or away from the plane
};

// A quad whose front faces the views and that covers what each view sees of the plane. Throws DataError without points
// and without two cameras apart (no length to go by).
Mesh BuildPlaneProxy(const Scene& scene, const PlaneOptions& options, PlaneSummary* summary = nullptr);

}  // namespace lumi
