// Zhang, "A flexible new technique for camera calibration" (PAMI 2000): intrinsics in closed form from the homographies
// of a plane seen in three poses or more, and each pose from its homography. No distortion, no noise model: the start
// of a refinement.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "scene/geometry/rigid3.h"

namespace lumi {

// x_px ~ H (X, Y, 1), normalised DLT (Hartley), w > 0 on the points. nullopt where fewer than four points or collinear
// ones leave it open.
std::optional<Eigen::Matrix3d> PlaneHomography(const std::vector<Eigen::Vector2d>& on_plane,
                                               const std::vector<Eigen::Vector2d>& pixels);

// The calibration matrix (upper triangular, 1 at its end). with_skew: five unknowns, at least three homographies;
// otherwise skew is 0 and two do. nullopt where the homographies do not determine one (parallel planes; B not
// definite).
std::optional<Eigen::Matrix3d> ClosedFormCalibration(const std::vector<Eigen::Matrix3d>& homographies, bool with_skew,
                                                     int width_px, int height_px);

// cam_from_board, the rotation the nearest to K^-1 H; the board in front of the camera. nullopt where H or K is
// singular.
std::optional<Rigid3> PoseFromHomography(const Eigen::Matrix3d& K, const Eigen::Matrix3d& H);

}  // namespace lumi
