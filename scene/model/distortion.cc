#include "scene/model/distortion.h"

#include <Eigen/LU>
#include <cmath>

namespace lumi {
namespace {

constexpr int kMaxNewtonSteps = 60;
constexpr double kStepEnd = 1e-12;  // on z = 1: 1e-9 px for any real focal length

Eigen::Matrix2d DistortionJacobian(const Distortion& c, const Eigen::Vector2d& u) {
  const double x = u.x(), y = u.y(), r2 = u.squaredNorm();
  const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double slope = 2 * (c.k1 + r2 * (2 * c.k2 + 3 * r2 * c.k3));  // d radial / d x = slope * x
  Eigen::Matrix2d J;
  J << radial + x * slope * x + 2 * c.p1 * y + 6 * c.p2 * x, x * slope * y + 2 * c.p1 * x + 2 * c.p2 * y,
      x * slope * y + 2 * c.p2 * y + 2 * c.p1 * x, radial + y * slope * y + 2 * c.p2 * x + 6 * c.p1 * y;
  return J;
}

// Whether the radial part grows all the way from the centre to the radius whose square is s_end: d(r radial)/dr in s =
// r^2 is a cubic; its least value is at an end or where its slope is 0.
bool IsInsideFold(const Distortion& c, double s_end) {
  const auto slope = [&](double s) { return 1 + s * (3 * c.k1 + s * (5 * c.k2 + s * 7 * c.k3)); };
  const auto positive = [&](double s) { return !(s > 0 && s < s_end) || slope(s) > 0; };
  if (!(slope(s_end) > 0)) return false;
  const double a = 21 * c.k3, b = 10 * c.k2, d = 3 * c.k1;  // a s^2 + b s + d = 0, the roots without cancellation
  const double discriminant = b * b - 4 * a * d;
  if (discriminant < 0) return true;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  return (a == 0 || positive(q / a)) && (q == 0 || positive(d / q));
}

}  // namespace

std::optional<Eigen::Vector2d> Undistort(const Distortion& c, const Eigen::Vector2d& target) {
  // Newton from the distorted point. The Jacobian's determinant is positive from the centre out to the fold.
  Eigen::Vector2d u = target;
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    const Eigen::Matrix2d J = DistortionJacobian(c, u);
    if (!(J.determinant() > 0)) {
      u *= 0.5;  // stepped over the fold: come back towards the centre
      continue;
    }
    const Eigen::Vector2d step = J.inverse() * (Distort(c, u) - target);
    u -= step;
    if (step.norm() <= kStepEnd * (1 + u.norm())) {
      const bool valid = (Distort(c, u) - target).norm() < 1e-9 * (1 + target.norm()) &&
                         DistortionJacobian(c, u).determinant() > 0 && IsInsideFold(c, u.squaredNorm());
      return valid ? std::optional(u) : std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace lumi
