// The projective map between the worlds of two reconstructions of the same frames: all that two windows of a film have
// in common.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "scene/geometry/projection.h"

namespace lumi {

struct WorldMap {
  Eigen::Matrix4d a_from_b =
      Eigen::Matrix4d::Identity();  // up to scale; P_a a_from_b X_b lies where P_b X_b does, w > 0 in front
  double rms = 0;                   // of that, units of the images; of what is within three times its median
};

// a, b: the matrices of the same frames in either world, of norm 1, in units (FilmedScene), worlds balanced. points_b:
// a frame's points, whose images are compared. Linear in the cameras, then Gauss-Newton on the images, robust (Huber).
// None where they do not tell: fewer than three frames, or no point in front of both.
std::optional<WorldMap> MapBetweenWorlds(const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b,
                                         const std::vector<std::vector<Eigen::Vector4d>>& points_b);

}  // namespace lumi
