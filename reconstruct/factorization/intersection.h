// A point from its images with the cameras held, in any projective frame: linear, then Gauss-Newton on the unit sphere
// of its homogeneous coordinates, so that a point at infinity is a point like any other.
#pragma once

#include <cstdint>

#include "reconstruct/factorization/projective_model.h"

namespace lumi {

struct IntersectionOptions {
  double inlier_px = 4.0;
  int min_inliers = 2;
  std::uint64_t seed = 0;
};

// Solves one track from its sights in placed frames and marks which of them agree (sights in frames not placed count as
// agreeing). Sets model.X, model.solved and model.inlier of the track; false, and not solved, where fewer than
// min_inliers agree.
bool IntersectTrack(const ImagePoints& points, ProjectiveModel& model, std::size_t track,
                    const IntersectionOptions& options);

}  // namespace lumi
