// Directions in a regular triangular grid over the sphere: an octahedron's faces, each side in n parts. For methods
// that store values for all directions from which a surface may be seen.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace lumi {

class SphereGrid {
 public:
  explicit SphereGrid(int parts);  // >= 1; 4 parts^2 + 2 nodes

  std::size_t size() const { return directions_.size(); }
  const Eigen::Vector3d& Direction(std::size_t node) const { return directions_[node]; }  // unit
  const std::vector<std::pair<std::int32_t, std::int32_t>>& edges() const { return edges_; }

  // The triangle around a direction: nodes and their barycentric weights, which are at least 0 and sum to 1.
  std::array<std::pair<std::int32_t, double>, 3> Around(const Eigen::Vector3d& direction) const;

 private:
  std::int32_t NodeAt(const Eigen::Vector3i& lattice) const;  // |x| + |y| + |z| = parts
  int parts_;
  std::vector<std::int32_t> index_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<std::pair<std::int32_t, std::int32_t>> edges_;
};

}  // namespace lumi
