#include "scene/model/plumb_bob.h"

#include <Eigen/LU>
#include <cmath>

namespace lumi {
namespace {

constexpr int kMaxNewtonSteps = 60;
constexpr double kStepEnd = 1e-12;  // on z = 1

Eigen::Vector2d Distorted(const PlumbBobCamera& c, const Eigen::Vector2d& x) {
  Eigen::Vector2d d;
  Distort(c.k1, c.k2, c.p1, c.p2, c.k3, x.x(), x.y(), &d.x(), &d.y());
  return d;
}

Eigen::Matrix2d PlumbBobJacobian(const PlumbBobCamera& c, const Eigen::Vector2d& u) {
  const double x = u.x(), y = u.y(), r2 = u.squaredNorm();
  const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  const double slope = 2 * (c.k1 + r2 * (2 * c.k2 + 3 * r2 * c.k3));
  Eigen::Matrix2d J;
  J << radial + x * slope * x + 2 * c.p1 * y + 6 * c.p2 * x, x * slope * y + 2 * c.p1 * x + 2 * c.p2 * y,
      x * slope * y + 2 * c.p2 * y + 2 * c.p1 * x, radial + y * slope * y + 2 * c.p2 * x + 6 * c.p1 * y;
  return J;
}

}  // namespace

PlumbBobCamera PlumbBobCamera::Scaled(int new_width_px, int new_height_px) const {
  const double sx = static_cast<double>(new_width_px) / width_px, sy = static_cast<double>(new_height_px) / height_px;
  PlumbBobCamera scaled = *this;
  scaled.width_px = new_width_px;
  scaled.height_px = new_height_px;
  scaled.fx *= sx, scaled.cx *= sx, scaled.skew *= sx;
  scaled.fy *= sy, scaled.cy *= sy;
  return scaled;
}

Eigen::Vector2d Project(const PlumbBobCamera& c, const Eigen::Vector2d& x) {
  const Eigen::Vector2d d = Distorted(c, x);
  return {c.fx * d.x() + c.skew * d.y() + c.cx, c.fy * d.y() + c.cy};
}

std::optional<Eigen::Vector2d> Unproject(const PlumbBobCamera& c, const Eigen::Vector2d& pixel) {
  const double yd = (pixel.y() - c.cy) / c.fy;
  const Eigen::Vector2d target((pixel.x() - c.cx - c.skew * yd) / c.fx, yd);
  // Outwards from the centre, in steps that do not leap over the fold: the Jacobian's determinant is positive up to it.
  Eigen::Vector2d u = target;
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    const Eigen::Matrix2d J = PlumbBobJacobian(c, u);
    if (!(J.determinant() > 0)) {
      u *= 0.5;
      continue;
    }
    const Eigen::Vector2d step = J.inverse() * (Distorted(c, u) - target);
    u -= step;
    if (step.norm() <= kStepEnd * (1 + u.norm())) {
      const bool valid = (Distorted(c, u) - target).norm() < 1e-9 * (1 + target.norm()) && PlumbBobJacobian(c, u).determinant() > 0 && IsInsideFold(c.k1, c.k2, c.k3, u.squaredNorm());
      return valid ? std::optional(u) : std::nullopt;
    }
  }
  return std::nullopt;
}

// d(r radial)/dr in s = r^2 is a cubic; its least value is at an end or where its slope is 0.
bool IsInsideFold(double k1, double k2, double k3, double s_end) {
  const auto slope = [&](double s) { return 1 + s * (3 * k1 + s * (5 * k2 + s * 7 * k3)); };
  const auto positive = [&](double s) { return !(s > 0 && s < s_end) || slope(s) > 0; };
  if (!(slope(s_end) > 0)) return false;
  const double a = 21 * k3, b = 10 * k2, d = 3 * k1;  // a s^2 + b s + d = 0, the roots without cancellation
  const double discriminant = b * b - 4 * a * d;
  if (discriminant < 0) return true;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  return (a == 0 || positive(q / a)) && (q == 0 || positive(d / q));
}

std::optional<std::string> Validate(const PlumbBobCamera& c) {
  if (c.width_px <= 0 || c.height_px <= 0) return "image size is not positive";
  for (const double x : {c.fx, c.fy, c.cx, c.cy, c.skew, c.k1, c.k2, c.p1, c.p2, c.k3})
    if (!std::isfinite(x)) return "a parameter is not a finite number";
  if (!(c.fx > 0) || !(c.fy > 0)) return "focal length is not positive";
  return std::nullopt;
}

}  // namespace lumi
