// What two frames say about each other: the fundamental matrix by RANSAC (Hartley & Zisserman, sec. 11.6; seven points,
// and plane plus parallax where one plane holds most points), the homography that explains most, and which of the two
// is the truth. Where a homography explains everything there is no parallax: the frames show one plane, or the camera
// only turned, and no projective structure follows from them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace lumi {

struct TwoViewOptions {
  double inlier_px = 2.0;     // distance to the epipolar line (Sampson) or to the homography's image
  int max_iterations = 4000;  // RANSAC rounds; fewer where many agree
  std::uint64_t seed = 0;
};

enum class TwoViewKind {
  kTooFew,      // fewer than 16 shared points, or fewer than 12 that agree
  kHomography,  // no parallax
  kGeneral,
};

struct TwoView {
  TwoViewKind kind = TwoViewKind::kTooFew;
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();  // b^T F a = 0, rank 2 (kGeneral)
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  // b ~ H a
  std::vector<char> inlier;                     // of F (kGeneral) or H (kHomography)
  int inlier_count = 0;
  int off_plane_count = 0;  // inliers of F that H does not explain
  double noise_px = 0;      // robust standard deviation of the distance to the epipolar lines
  double parallax_px = 0;   // 80th percentile of the inliers' distance to H's image
};

// a, b: the points of two frames, normalised, with their frame's pixels per unit.
TwoView EstimateTwoView(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b,
                        double px_per_unit_a, double px_per_unit_b, const TwoViewOptions& options);

// Camera b beside [I | 0] that has this fundamental matrix. Of the four free numbers the choice is the one for which
// camera b's left block is nearest to the identity (quasi-Euclidean; Beardsley et al. 1997).
Eigen::Matrix<double, 3, 4> CanonicalCamera(const Eigen::Matrix3d& F);

}  // namespace lumi
