// Leaves that differ from place to place: a lawn's radiance varies otherwise with direction than a vase's (thesis
// 8.1.1). A grid of nodes over the proxy, each of one of a few kinds of leaves; a ray's weights are the kinds', each by
// its optimum, mixed by the kinds' shares at the proxy point, so that they stay continuous and sum to 1.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "render/radiance/optimum/optimum.h"

namespace lumi {

// RadianceSettings' fields of these names.
struct LeavesKind {
  double r_min_rad = 0, r_max_rad = 0, noise = 0;
};

// Nodes over a box, both corners among them; x runs fastest.
struct NodeGrid {
  Eigen::AlignedBox3d box;                          // in the scene's normalised frame (Sources)
  Eigen::Vector3i count = Eigen::Vector3i::Ones();  // along each axis, >= 1

  int size() const { return count.prod(); }
  // The eight nodes around p, which is moved into the box first, and their trilinear shares, >= 0, sum 1. Nodes may
  // repeat along an axis of one node.
  struct Around {
    int node[8];
    double share[8];
  };
  Around At(const Eigen::Vector3d& p) const;
};

struct LeavesByPlace {
  NodeGrid grid;
  std::vector<std::uint8_t> kind;  // of each node, into `kinds`
  std::vector<LeavesKind> kinds;   // 1 to kMostKinds

  static constexpr std::size_t kMostKinds = 4;
  // share[k] of each kind at p: continuous, >= 0, sum 1. `share`: kinds.size() numbers.
  void Shares(const Eigen::Vector3d& p, std::span<double> share) const;
};

// As WeighOptimal, with `leaves` in place of the settings' own. A ray where several kinds meet counts once a kind.
void WeighByPlace(const LeavesByPlace& leaves, const ViewSetup& setup, const VisibilityMaps* visibility,
                  const RaySamples& rays, WeightTable& table, OptimumCounts& counts);

}  // namespace lumi
