// Robust metric bundle adjustment: six numbers a camera, homogeneous points on a sphere (one at infinity is a point
// like any other), intrinsics shared by all frames and held or free.
#pragma once

#include <vector>

#include "reconstruct/factorization/projective_bundle.h"
#include "reconstruct/factorization/projective_model.h"
#include "scene/geometry/rigid3.h"

namespace lumi {

enum class FreeIntrinsics {
  kNone,            // held as given
  kFocal,           // one focal length (the aspect is held)
  kFocalAndCentre,  // focal length and principal point
};

struct MetricModel {
  Eigen::Vector4d intrinsics_px = Eigen::Vector4d::Zero();  // fx, fy, cx, cy, of all frames
  std::vector<Rigid3> cam_from_world;                       // one a frame
  std::vector<Eigen::Vector4d> X;                           // one a track, norm 1
};

// Which frames, tracks and sights take part stands in `used` (placed, solved, inlier). The first placed camera stays
// where it is; the scale of the world is free.
BundleSummary AdjustMetric(const ImagePoints& points, const ProjectiveModel& used, MetricModel& model,
                           FreeIntrinsics free, const BundleOptions& options);

// The same cameras as normalised projection matrices: what Cull and RmsPx read. P keeps w > 0 in front, X is oriented
// so that most of its sights are in front of their cameras.
void ToProjective(const ImagePoints& points, const MetricModel& metric, ProjectiveModel& model);

}  // namespace lumi
