// Points from their images in several views with the cameras held (thesis sec. 2.5): linear (DLT on normalised rays),
// then Gauss-Newton on the reprojection error.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "scene/geometry/projection.h"

namespace lumi {

struct TriangulatedPoint {
  Eigen::Vector3d x_in_world = Eigen::Vector3d::Zero();
  double rms_px = 0;         // reprojection error
  double max_angle_rad = 0;  // largest angle between two rays at the point: what makes it well-conditioned
};

// nullopt: fewer than two views, rays parallel to rounding, or the point is not in front of every camera.
std::optional<TriangulatedPoint> Triangulate(const std::vector<Matrix34d>& P, const std::vector<Eigen::Vector2d>& x_px);

}  // namespace lumi
