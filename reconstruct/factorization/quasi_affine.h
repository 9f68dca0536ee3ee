// From projective to quasi-affine (Hartley 1993; Hartley et al. 1999; thesis sec. 6.2.1): signs so that w > 0 in front
// of every camera, and a plane at infinity that no point or camera centre lies beyond, as far from all of them as can
// be.
//
// The cheirality inequalities, with the signs fixed and centres as signed minors: pi . X_j > 0, delta pi . C_i > 0,
// delta the sign of the transformation's determinant. One linear program for each delta, in pi and the margin. Its
// margin is measured between unit vectors, which depends on the frame: once in the balanced projective frame, then in
// the frame found (points moved to their centre and scaled to unit covariance) until it no longer grows. The plane
// hangs on the outermost points, which are the least certain: where 0.5 % of the points, the farthest, keep it near,
// they are left out.
#pragma once

#include <Eigen/Core>

#include "reconstruct/factorization/projective_model.h"

namespace lumi {

struct QuasiAffine {
  bool solved = false;     // false: the inequalities contradict each other
  int sign_conflicts = 0;  // sights whose point would lie behind their camera whatever the signs; marked as outliers
  int sights = 0;          // all inlier sights
  double margin = 0;       // of the last linear program; > 0
  int left_out = 0;        // points that alone kept the plane near: they are solved no more
  bool mirrored = false;   // delta < 0
  Eigen::Vector4d plane_at_infinity = Eigen::Vector4d(0, 0, 0, 1);  // in the model's new frame: (0, 0, 0, 1)
};

// Changes the model's frame and signs: P X has w > 0 at every inlier sight, X = (x, 1) / norm with norm > 0, points'
// centre at the origin. Unless solved the model keeps its frame (its signs may change).
QuasiAffine SolveQuasiAffine(const ImagePoints& points, ProjectiveModel& model);

}  // namespace lumi
