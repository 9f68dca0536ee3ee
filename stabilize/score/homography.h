// The homography that most of a set of correspondences agree on, and what it does to a picture: how the stabilisation
// literature compares a stabilised frame with its original (Liu, Yuan, Tan, Sun: Bundled camera paths for video
// stabilization, SIGGRAPH 2013, section 5.1).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace lumi::score {

struct PointPair {
  Eigen::Vector2d from_px, to_px;
};

struct FittedHomography {
  Eigen::Matrix3d to_from = Eigen::Matrix3d::Identity();  // pixels, (2, 2) is 1
  int inliers = 0;
};

// RANSAC within threshold_px, then all inliers; always the same for the same pairs. None with fewer than 8 inliers or a
// fifth of the pairs, or where the result mirrors or collapses the picture.
std::optional<FittedHomography> FitHomography(const std::vector<PointPair>& pairs, double threshold_px);

// The same of a frame and the next, where little turns and nothing tilts: RANSAC of a similarity, which cannot bend
// until it fits the background and half of what moves before it; then a homography through what agrees.
std::optional<FittedHomography> FitStep(const std::vector<PointPair>& pairs, double threshold_px);

// So far from the homography a point may be, in a picture of this size: a little parallax is not to make it jump from
// one plane of the scene to another, and what moves by itself is not to be part of it.
double InlierThresholdPx(const Eigen::Vector2i& size_px);

// Of a frame's homography from the input to the output. Both sizes may differ.
struct PictureChange {
  // Relative size of the output over the scale of the homography's affine part about the pictures' middles (the root of
  // its determinant): 1 = nothing lost, 0.8 = 80 % of width and height are left. Above 1 where more than the input is
  // shown.
  double cropping = 1;
  // Smaller over larger singular value of the affine part: 1 = neither sheared nor stretched. (The literature says
  // eigenvalues; of a rotated shear they are complex and their moduli equal.)
  double distortion = 1;
  double kept_area = 1;  // share of the input's area that the output shows
};
// None where the output's corners are not all in front of the input's plane.
std::optional<PictureChange> ChangeOf(const Eigen::Matrix3d& output_from_input, const Eigen::Vector2i& input_px,
                                      const Eigen::Vector2i& output_px);

// The movement of a picture by a homography of a frame to the next: of its middle, and the rotation there (of the
// Jacobian's nearest similarity, clockwise as y is down).
struct Movement {
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
  double rotation_rad = 0;
};
Movement MovementOf(const Eigen::Matrix3d& next_from_this, const Eigen::Vector2i& size_px);

}  // namespace lumi::score
