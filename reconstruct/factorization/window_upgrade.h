// The upgrade to a Euclidean frame window by window: each has a plane at infinity of its own, and known intrinsics make
// each metric up to a similarity, by which neighbours are then joined. A long drive's projective frame bends a little
// from window to window until no one plane is at infinity for all of it; within a window it does not.
#pragma once

#include <vector>

#include "reconstruct/factorization/projective_bundle.h"
#include "reconstruct/factorization/windows.h"

namespace lumi {

struct WindowUpgrade {
  bool found = false;                  // every placed frame is in a window that could be upgraded and joined
  std::vector<Rigid3> cam_from_world;  // one a frame, where placed
  std::vector<Eigen::Vector4d> X;      // one a track, norm 1 where solved
  std::vector<char> solved;            // tracks that some window has solved
  int windows = 0;                     // that were joined
  double plane_sigma = 0;              // Upgrade's, the median of theirs
};

struct WindowUpgradeOptions {
  BundleOptions::Loss loss = BundleOptions::Loss::kCauchy;
  double sigma_px = 0.3;         // noise of one image coordinate
  double max_rms_factor = 1.2;   // a window's metric reprojection error is at most this times its projective one,
  double max_rms_more_px = 0.2;  // and this more
};

// `projective`: of all frames, good within each window at least. intrinsics_px: fx, fy, cx, cy of all frames.
WindowUpgrade UpgradeByWindows(const ImagePoints& points, const ProjectiveModel& projective,
                               const std::vector<FrameWindow>& windows, const Eigen::Vector4d& intrinsics_px,
                               const WindowUpgradeOptions& options);

}  // namespace lumi
