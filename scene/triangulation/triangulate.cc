#include "scene/triangulation/triangulate.h"

#include <Eigen/Dense>
#include <cmath>

#include "scene/geometry/angle.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

// Rays closer to parallel than this leave no depth in double: sqrt of epsilon times a safety of 10.
constexpr double kMinAngleRad = 1e-7;
constexpr int kMostSteps = 15;

}  // namespace

std::optional<TriangulatedPoint> Triangulate(const std::vector<Matrix34d>& P, const std::vector<Eigen::Vector2d>& x_px) {
  const std::size_t n = P.size();
  if (n < 2 || x_px.size() != n) return std::nullopt;

  // Midpoint of the rays, in the frame of the first centre: well scaled wherever the scene lies, and w stays 1.
  std::vector<Eigen::Vector3d> centre(n), direction(n);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector4d c = CentreOfProjection(P[i]);
    const auto d = RayDirection(P[i], x_px[i]);
    if (!d || !(c.w() > 0)) return std::nullopt;
    centre[i] = c.hnormalized();
    direction[i] = d->normalized();
  }
  TriangulatedPoint result;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double spread = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Matrix3d N = Eigen::Matrix3d::Identity() - direction[i] * direction[i].transpose();
    A += N;
    b += N * (centre[i] - centre[0]);
    for (std::size_t j = 0; j < i; ++j) spread = std::max(spread, AngleBetween(direction[i], direction[j]));
  }
  if (!(spread > kMinAngleRad)) return std::nullopt;
  Eigen::Vector3d x = centre[0] + SolveSymmetric(A, b);

  // Gauss-Newton on the reprojection error, stopped where it no longer falls.
  const auto cost = [&](const Eigen::Vector3d& p, double* sum) {
    *sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const auto q = Project(P[i], p);
      if (!q) return false;
      *sum += (*q - x_px[i]).squaredNorm();
    }
    return true;
  };
  double best;
  if (!cost(x, &best)) return std::nullopt;
  for (int it = 0; it < kMostSteps; ++it) {
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d q = P[i] * x.homogeneous();
      Eigen::Matrix<double, 2, 3> J;
      for (int r = 0; r < 2; ++r) J.row(r) = (P[i].row(r).head<3>() - q[r] / q.z() * P[i].row(2).head<3>()) / q.z();
      H += J.transpose() * J;
      g += J.transpose() * (Eigen::Vector2d(q.hnormalized()) - x_px[i]);
    }
    const Eigen::Vector3d candidate = x - SolveSymmetric(H, g);
    double c;
    if (!candidate.allFinite() || !cost(candidate, &c) || !(c < best)) break;
    const bool done = best - c < 1e-12 * best;
    x = candidate;
    best = c;
    if (done) break;
  }
  result.x_in_world = x;
  result.rms_px = std::sqrt(best / static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j)
      result.max_angle_rad = std::max(result.max_angle_rad, AngleBetween(centre[i] - x, centre[j] - x));
  return result;
}

}  // namespace lumi
