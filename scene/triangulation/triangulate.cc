#include "scene/triangulation/triangulate.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "scene/geometry/angle.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/levenberg_marquardt.h"

namespace lumi {
namespace {

// Rays closer to parallel than this leave no depth in double: sqrt of epsilon times a safety of 10.
constexpr double kMinAngleRad = 1e-7;

}  // namespace

std::optional<TriangulatedPoint> Triangulate(const std::vector<Matrix34d>& P,
                                             const std::vector<Eigen::Vector2d>& x_px) {
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

  // On the reprojection error; a point behind a camera is none.
  const auto cost = [&](const Eigen::Vector3d& p, NormalEquations<3>* normal) {
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Eigen::Vector3d q = P[i] * p.homogeneous();
      if (!(q.z() > 0)) return std::numeric_limits<double>::infinity();
      const Eigen::Vector2d y = q.hnormalized(), r = y - x_px[i];
      sum += r.squaredNorm();
      if (!normal) continue;
      Eigen::Matrix<double, 2, 3> J;
      for (int k = 0; k < 2; ++k) J.row(k) = (P[i].row(k).head<3>() - y[k] * P[i].row(2).head<3>()) / q.z();
      normal->Add(J, r);
    }
    return sum;
  };
  const LeastSquaresSummary refined =
      MinimiseSquares<3>({.max_iterations = 15, .max_attempts = 1, .tolerance = 1e-12, .damping = 0}, cost, x);
  if (refined.stop == LeastSquaresStop::kNotFinite) return std::nullopt;
  result.x_in_world = x;
  result.rms_px = std::sqrt(refined.cost / static_cast<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < i; ++j)
      result.max_angle_rad = std::max(result.max_angle_rad, AngleBetween(centre[i] - x, centre[j] - x));
  return result;
}

}  // namespace lumi
