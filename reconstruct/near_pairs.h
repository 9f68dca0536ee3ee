// Which photos are worth matching where the cameras are known: those that stand near one another and look the same way.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace lumi {

struct KnownStand {
  Eigen::Vector3d centre_in_world, axis_in_world;  // the camera's centre, its optical axis (a unit vector)
};

// Each camera with the 12 nearest of those whose axes lie within 60 degrees of its own, and with some farther ones for
// a wider base (the 16th nearest, the 24th, 36th ... up to the 80th). (a, b) with a < b, sorted. O(n^2).
std::vector<std::pair<int, int>> NearPairs(const std::vector<KnownStand>& cameras);

}  // namespace lumi
