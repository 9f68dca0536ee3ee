// 3x4 projection matrices, with the sign kept: w > 0 in front of the camera (Hartley & Zisserman, sec. 6.2; thesis
// sec. 2.2). x_px ~ P * x_in_world, pixel centres at (i + 0.5, j + 0.5).
#pragma once

#include <Eigen/Core>
#include <optional>

#include "scene/geometry/rigid3.h"

namespace lumi {

using Matrix34d = Eigen::Matrix<double, 3, 4>;

// K: pixels from camera rays; w of the product is the depth along the camera's z axis.
Matrix34d ProjectionMatrix(const Eigen::Matrix3d& K, const Rigid3& cam_from_world);

// The sign of P fixed so that w > 0 for `x_in_front` (homogeneous, its own w >= 0). Throws std::invalid_argument when
// x_in_front lies on the camera's principal plane: it does not say which side is front.
Matrix34d WithSign(const Matrix34d& P, const Eigen::Vector4d& x_in_front);

// Pixel of a point (homogeneous, w >= 0); nullopt where it is on or behind the principal plane.
std::optional<Eigen::Vector2d> Project(const Matrix34d& P, const Eigen::Vector4d& x_in_world);
inline std::optional<Eigen::Vector2d> Project(const Matrix34d& P, const Eigen::Vector3d& x_in_world) {
  return Project(P, Eigen::Vector4d(x_in_world.homogeneous()));
}

// Centre of projection, homogeneous, unit norm, w >= 0 (w = 0: an affine camera): the null space of P, from the cross
// products of its rows (exact for finite cameras, no iteration).
Eigen::Vector4d CentreOfProjection(const Matrix34d& P);

// Direction (not normalised, pointing forward) of the ray through a pixel of a finite camera; nullopt where the left
// 3x3 block is singular.
std::optional<Eigen::Vector3d> RayDirection(const Matrix34d& P, const Eigen::Vector2d& x_px);

// A plane n . x + d = 0 as (n, d).
using Plane = Eigen::Vector4d;

// Inverse projection onto a plane (thesis sec. 2.2.4): the point of `plane` seen at x_px, homogeneous with w >= 0, so
// that rays parallel to the plane give a point at infinity. nullopt where the plane passes through the centre of
// projection (P_aug singular: condition beyond 1 / (1e3 epsilon)) or where the point lies behind the camera.
std::optional<Eigen::Vector4d> InverseProject(const Matrix34d& P, const Plane& plane, const Eigen::Vector2d& x_px);

// Homography x_target ~ H x_source induced by a plane (thesis sec. 2.2.4). nullopt as InverseProject.
std::optional<Eigen::Matrix3d> PlaneHomography(const Matrix34d& P_target, const Matrix34d& P_source,
                                               const Plane& plane);

// Image of the centre of `other` in the camera P: homogeneous, whatever the sign of w (w < 0: the centre is behind the
// camera and the ray through the epipole, extended backwards, meets it; it sees the same radiance). nullopt where the
// two centres coincide to rounding.
std::optional<Eigen::Vector3d> Epipole(const Matrix34d& P, const Matrix34d& other);

}  // namespace lumi
