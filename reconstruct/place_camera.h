// One camera's pose from points whose places are known, under a lens that is known: RANSAC over P3P, then
// Levenberg-Marquardt over the points that agree (thesis sec. 2.5's bundle adjustment with everything else held).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

using Sighting =
    std::pair<std::int32_t, Eigen::Vector2d>;  // point, and the pixel (of the distorted photo) that shows it

// A camera is placed by at least so many points that agree within the error (COLMAP's own bound is 30 of 12 px).
constexpr int kMinPointsOfPose = 20;
constexpr double kMaxPoseErrorPx = 4;

struct PlacedCamera {
  bool ok = false;
  int inliers = 0;
  Rigid3 cam_from_world;
  std::vector<Sighting> observations;  // those that agree
};

PlacedCamera PlaceCamera(const std::vector<Sighting>& seen, const std::vector<Point>& points, const Camera& camera);
// The same from a pose nearby, without RANSAC.
PlacedCamera PlaceCameraNear(const std::vector<Sighting>& seen, const std::vector<Point>& points, const Camera& camera,
                             const Rigid3& start);

}  // namespace lumi
