#include "render/world/vanishing_point.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

// Of depths about 1. A hundredth of the smallest leaf (r_min): no angle that counts.
constexpr double kSameCentre = 1e-7;
// Farther away floats hold no angle, and the camera is as good as at infinity.
constexpr double kFarthestCentre = 1e6;

}  // namespace

Eigen::Matrix3d NominalCalibration(const Eigen::Vector2i& size_px, double focal_px) {
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K(0, 0) = K(1, 1) = focal_px;
  K(0, 2) = 0.5 * size_px.x();
  K(1, 2) = 0.5 * size_px.y();
  return K;
}

double NominalFocalPx(const Eigen::Vector2i& size_px) {
  constexpr double kOfLongerSide = 1.2;
  return kOfLongerSide * size_px.maxCoeff();
}

std::optional<VanishingPointFrame> VanishingPointFrame::Make(const Matrix34d& P, const Plane& at_infinity,
                                                             const Eigen::Matrix3d& K0, double unit_kappa) {
  VanishingPointFrame f;
  f.K0_ = K0;
  f.K0_inverse_ = K0.inverse();
  // Normalised for the inverse: its condition then depends on the scene, not on the arbitrary scales of P and the
  // plane.
  const Matrix34d rays = f.K0_inverse_ * P;
  const double ray_length = rays.norm(), plane_length = at_infinity.norm();
  if (!(ray_length > 0) || !(plane_length > 0) || !(unit_kappa > 0) || !rays.allFinite() || !at_infinity.allFinite())
    return std::nullopt;
  Eigen::Matrix4d A;
  A << rays / ray_length, at_infinity.transpose() / plane_length;
  const auto inverse = InverseOf(A, 1e3 * std::numeric_limits<double>::epsilon());
  if (!inverse) return std::nullopt;
  // x = s rays X / (pi . X), s = unit_kappa: a point with that kappa has depth 1.
  f.unit_kappa_ = unit_kappa;
  const double rays_scale = unit_kappa * ray_length / plane_length;
  f.frame_from_world_ = A;
  f.frame_from_world_.topRows<3>() *= rays_scale;
  f.world_from_frame_ = *inverse;
  f.world_from_frame_.leftCols<3>() /= rays_scale;
  return f;
}

Matrix34d VanishingPointFrame::P() const {
  Matrix34d P = Matrix34d::Zero();
  P.leftCols<3>() = K0_;
  return P;
}

std::optional<VanishingPointFrame::Moved> VanishingPointFrame::MoveCamera(const Matrix34d& P) const {
  Moved m;
  m.P = P * world_from_frame_;
  m.P /= m.P.row(2).head<3>().norm();
  const Eigen::Matrix3d M = m.P.leftCols<3>();
  // The determinant's sign is the side of the plane that the centre is on: 0 on it, negative beyond.
  if (!m.P.allFinite() || !(M.determinant() > 0)) return std::nullopt;
  const auto inverse = InverseOf(M, 1e3 * std::numeric_limits<double>::epsilon());
  if (!inverse) return std::nullopt;
  m.centre = -(*inverse * m.P.col(3));
  if (!(m.centre.norm() < kFarthestCentre)) return std::nullopt;
  if (m.centre.norm() < kSameCentre) {
    m.centre.setZero();
    m.P.col(3).setZero();
  }
  return m;
}

Eigen::Vector3d VanishingPointFrame::At(const Eigen::Vector2d& x_px, double kappa) const {
  return K0_inverse_ * x_px.homogeneous() * (unit_kappa_ / kappa);
}

}  // namespace lumi
