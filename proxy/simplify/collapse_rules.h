// What both ways of simplifying ask of a triangle before an edge is collapsed.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>

namespace lumi {

struct TriangleShape {
  Eigen::Vector3d area_vector = Eigen::Vector3d::Zero();  // along the normal, twice the area long
  double area2 = 0;
  double quality = 0;  // height over the longest side: 0.87 equilateral, 0 without area
};
inline TriangleShape ShapeOf(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  TriangleShape s;
  s.area_vector = (b - a).cross(c - a);
  s.area2 = s.area_vector.norm();
  const double longest2 = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  s.quality = longest2 > 0 ? s.area2 / longest2 : 0;
  return s;
}

// Below, a face has no plane to speak of: its normal is good to 1e-16 / quality at best.
inline constexpr double kDegenerateQuality = 1e-9;
// No collapse makes a face flatter than this, unless one that goes was flatter still.
inline constexpr double kLeastQuality = 0.01;
// No face turns farther than 78 degrees at once: at 90 it folds over.
inline constexpr double kLeastTurnCosine = 0.2;

}  // namespace lumi
