#include "scene/geometry/projection.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

// Condition beyond which a point on a plane is rounding rather than geometry.
constexpr double kSingular = 1e3 * std::numeric_limits<double>::epsilon();

// Homogeneous coordinates with w >= 0.
Eigen::Vector4d Oriented(const Eigen::Vector4d& x) { return x.w() < 0 ? Eigen::Vector4d(-x) : x; }

}  // namespace

Matrix34d ProjectionMatrix(const Eigen::Matrix3d& K, const Rigid3& cam_from_world) {
  return K * cam_from_world.Matrix();
}

Matrix34d WithSign(const Matrix34d& P, const Eigen::Vector4d& x_in_front) {
  const double w = P.row(2).dot(x_in_front);
  if (!(std::abs(w) > kSingular * P.row(2).norm() * x_in_front.norm()))
    throw std::invalid_argument("WithSign: the point lies on the principal plane");
  return w > 0 ? P : Matrix34d(-P);
}

std::optional<Eigen::Vector2d> Project(const Matrix34d& P, const Eigen::Vector4d& x_in_world) {
  const Eigen::Vector3d x = P * x_in_world;
  if (!(x.z() > 0)) return std::nullopt;
  return Eigen::Vector2d(x.hnormalized());
}

Eigen::Vector4d CentreOfProjection(const Matrix34d& P) {
  // Rows scaled to unit length first, so that the minors do not overflow with pixel-sized entries.
  Matrix34d Q = P;
  for (int i = 0; i < 3; ++i) {
    const double n = Q.row(i).norm();
    if (n > 0) Q.row(i) /= n;
  }
  Eigen::Vector4d c;
  for (int k = 0; k < 4; ++k) {
    Eigen::Matrix3d minor;
    for (int j = 0, col = 0; j < 4; ++j)
      if (j != k) minor.col(col++) = Q.col(j);
    c[k] = (k % 2 == 0 ? 1.0 : -1.0) * minor.determinant();
  }
  const double n = c.norm();
  if (n > 0) c /= n;
  return Oriented(c);
}

std::optional<Eigen::Vector3d> RayDirection(const Matrix34d& P, const Eigen::Vector2d& x_px) {
  const Eigen::Matrix3d M = P.leftCols<3>();
  const auto inverse = InverseOf(M, kSingular);
  if (!inverse) return std::nullopt;
  Eigen::Vector3d d = *inverse * x_px.homogeneous();
  // Forward: w of the point at infinity in direction d is positive.
  if (M.row(2).dot(d) < 0) d = -d;
  return d;
}

std::optional<Eigen::Vector4d> InverseProject(const Matrix34d& P, const Plane& plane, const Eigen::Vector2d& x_px) {
  // Along the ray c + s d (homogeneous) the plane is met where plane . (c + s d) = 0. This is P_aug^-1 (x, 0) without
  // forming the inverse, and names the degenerate case: plane . c = 0.
  const Eigen::Vector4d c = CentreOfProjection(P);
  const double at_centre = plane.dot(c);
  if (!(std::abs(at_centre) > kSingular * plane.norm())) return std::nullopt;
  // A second point of the ray: the pseudo-inverse of P.
  const Eigen::Matrix3d gram = P * P.transpose();
  const Eigen::Vector4d b = P.transpose() * SolveSymmetric(gram, Eigen::Vector3d(x_px.homogeneous()));
  Eigen::Vector4d x = at_centre * b - plane.dot(b) * c;
  const double n = x.norm();
  if (!(n > 0) || !x.allFinite()) return std::nullopt;
  x = Oriented(x / n);
  // Behind the camera, or the ray is parallel to the plane and meets it at infinity on the backward side.
  if (!(P.row(2).dot(x) > 0)) return std::nullopt;
  return x;
}

std::optional<Eigen::Matrix3d> PlaneHomography(const Matrix34d& P_target, const Matrix34d& P_source,
                                               const Plane& plane) {
  Eigen::Matrix4d P_aug;
  P_aug << P_source, plane.transpose();
  // Rows of unit length: the condition then speaks of geometry, not of pixels against metres.
  Eigen::Vector4d row_scale;
  for (int i = 0; i < 4; ++i) {
    row_scale[i] = P_aug.row(i).norm();
    if (!(row_scale[i] > 0)) return std::nullopt;
    P_aug.row(i) /= row_scale[i];
  }
  const auto inverse = InverseOf(P_aug, kSingular);
  if (!inverse) return std::nullopt;
  // x_world = P_aug^-1 (x, y, w, 0); the scaling of the rows goes into the right-hand side.
  Eigen::Matrix<double, 4, 3> rhs = Eigen::Matrix<double, 4, 3>::Zero();
  for (int i = 0; i < 3; ++i) rhs(i, i) = 1.0 / row_scale[i];
  return Eigen::Matrix3d(P_target * *inverse * rhs);
}

std::optional<Eigen::Vector3d> Epipole(const Matrix34d& P, const Matrix34d& other) {
  const Eigen::Vector4d c = CentreOfProjection(other);
  const Eigen::Vector3d e = P * c;
  if (!(e.norm() > kSingular * P.norm())) return std::nullopt;
  return e;
}

}  // namespace lumi
