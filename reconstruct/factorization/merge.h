// Two reconstructions in one projective frame (thesis sec. 2.5): the 4x4 transformation between them from the cameras
// and points they share, robustly, refined on the reprojection error.
#pragma once

#include <cstdint>

#include "reconstruct/factorization/projective_model.h"
#include "reconstruct/factorization/windows.h"
#include "scene/geometry/levenberg_marquardt.h"

namespace lumi {

struct MergeOptions {
  double inlier_px = 4.0;
  int max_iterations = 200;  // RANSAC rounds over five shared points
  int min_shared_tracks = 8;
  double min_inlier_share = 0.5;  // of the shared tracks' sights
  std::uint64_t seed = 0;
};

struct MergeSummary {
  bool merged = false;
  int shared_frames = 0, shared_tracks = 0;
  double inlier_share = 0;
  double rms_px = 0;            // of the part's shared points in the whole's cameras, inliers only
  LeastSquaresSummary refined;  // of the transformation
};

// Adds a window's model (local numbers) to the whole's (those of `points`). Frames and tracks that both have keep the
// whole's camera and point. Nothing is changed unless merged.
MergeSummary Merge(const ImagePoints& points, ProjectiveModel& whole, const FrameWindow& window,
                   const ProjectiveModel& part, const MergeOptions& options);

}  // namespace lumi
