// Rays of a view that meet the proxy, and the weights that photos get there.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lumi {

// A structure of arrays; all in the scene's normalised frame.
struct RaySamples {
  std::vector<Eigen::Vector3f> direction;  // unit, from the desired centre
  std::vector<float> t;                    // distance to the proxy; not finite or <= 0: the ray misses it
  std::vector<Eigen::Vector3f> normal;     // of the proxy there, unit, either side; read by Resolution::kJacobian only
  // Directions in double, if known: rounded to float, one ray seen from two views is no longer the same ray. Empty:
  // `direction` is used.
  std::vector<Eigen::Vector3d> exact_direction = {};
  std::vector<double> exact_t = {};
  // The proxy's triangle that is met, -1: none; read by RayMethods only.
  std::vector<std::int32_t> face = {};
  std::size_t size() const { return direction.size(); }
};

// Sample i's photos and weights are entries first[i] .. first[i + 1]; weights sum to 1 where alpha > 0.
struct WeightTable {
  std::vector<std::int32_t> first;
  std::vector<std::int32_t> camera;  // into Sources::views
  std::vector<float> weight;
  std::vector<float> alpha;  // 0: a hole, no photo sees the point
  std::size_t size() const { return alpha.size(); }
};

}  // namespace lumi
