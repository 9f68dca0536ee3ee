// From projective to Euclidean with known intrinsics (Pollefeys et al. 1999; thesis sec. 2.5). With one camera brought
// to [I | 0], a Euclidean frame is the plane at infinity p, three numbers: A_i - a_i p^T must be a rotation times a
// scale for every camera [A_i | a_i]. Starting points are the dual absolute quadric (linear) and essential matrices of
// single pairs; each is refined on all cameras, and of those that fit equally the one with the points in front is
// taken. Constant orientation is no special case: A_i is then known but for p.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruct/factorization/projective_model.h"
#include "scene/geometry/rigid3.h"

namespace lumi {

struct Upgrade {
  bool found = false;                               // false: fewer than two cameras, or nothing finite
  Eigen::Matrix4d H = Eigen::Matrix4d::Identity();  // P H ~ K [R | t]
  std::vector<Rigid3> cam_from_world;               // one a frame, where placed
  double residual = 0;     // rms deviation of the cameras' left blocks from rotations, 0 ... about 1
  double front_share = 0;  // of the inlier sights: in front of their camera
  double condition = 0;    // largest over smallest singular value of the residuals' derivative by p
  double plane_sigma = 0;  // standard deviation of p in its worst direction, times the points' median
                           // depth: about the relative error of depths. infinity: not determined
};

// K_normalised: one a frame, normalised image point ~ K (x, y, 1) of the camera frame.
Upgrade UpgradeToEuclidean(const ImagePoints& points, const ProjectiveModel& model,
                           const std::vector<Eigen::Matrix3d>& K_normalised);

// The rms deviation from pure translation under one unknown K: 0 where some plane at infinity makes every camera's left
// block a multiple of the first's, in pixels of all frames alike. Constant orientation leaves unknown intrinsics
// undetermined.
double DeviationFromConstantOrientation(const ImagePoints& points, const ProjectiveModel& model);

}  // namespace lumi
