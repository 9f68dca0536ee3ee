#include "reconstruct/factorization/resection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "reconstruct/factorization/ransac.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

constexpr int kFewestFitted = 8;  // points that a camera is fitted to: two more than fix it

Matrix34d CameraFromRows(const Vector12d& p) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(p.data());
}

double CameraErrorPx2(const Matrix34d& P, const Eigen::Vector4d& X, const Eigen::Vector2d& x, double unit) {
  const Eigen::Vector3d q = P * X;
  const double e = (q.head<2>() / q.z() - x).squaredNorm() * unit * unit;
  return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

Matrix34d SixPoint(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x,
                   const std::array<std::size_t, 6>& sample) {
  Eigen::Matrix<double, 12, 11> At;
  for (int i = 0; i < 11; ++i) {
    const std::size_t k = sample[static_cast<std::size_t>(i / 2)];
    if (i % 2 == 0)
      At.col(i) << X[k], Eigen::Vector4d::Zero(), -x[k].x() * X[k];
    else
      At.col(i) << Eigen::Vector4d::Zero(), X[k], -x[k].y() * X[k];
  }
  return CameraFromRows(PerpendicularColumns(At));
}

Matrix34d LinearCamera(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x,
                       const std::vector<char>& use, const Matrix34d& about) {
  Matrix12d gram = Matrix12d::Zero();
  for (std::size_t i = 0; i < X.size(); ++i) {
    if (!use[i]) continue;
    // Divided by the depth of the last estimate: the algebraic error is then the image's.
    const double w = about.row(2).dot(X[i]);
    const Eigen::Vector4d Xw = X[i] / w;
    Eigen::Matrix<double, 2, 12> r;
    r << Xw.transpose(), Eigen::RowVector4d::Zero(), -x[i].x() * Xw.transpose(), Eigen::RowVector4d::Zero(),
        Xw.transpose(), -x[i].y() * Xw.transpose();
    gram.noalias() += r.transpose() * r;
  }
  return CameraFromRows(LeastDirection(gram / gram.trace()));
}

}  // namespace

LeastSquaresSummary RefineCamera(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x,
                                 const std::vector<char>& use, double px_per_unit, double scale_px, Matrix34d& P) {
  const auto cost = [&](const Vector12d& p, NormalEquations<12>* normal) {
    const Matrix34d Q = CameraFromRows(p);
    double sum = 0;
    for (std::size_t i = 0; i < X.size(); ++i) {
      if (!use[i]) continue;
      const Eigen::Vector3d q = Q * X[i];
      const Eigen::Vector2d y = q.head<2>() / q.z(), r = (y - x[i]) * px_per_unit;
      const RobustLoss loss = Cauchy(r.squaredNorm(), scale_px * scale_px);
      sum += loss.cost;
      if (!normal) continue;
      const Eigen::RowVector4d Xw = X[i].transpose() * (px_per_unit / q.z());
      Eigen::Matrix<double, 2, 12> J;
      J << Xw, Eigen::RowVector4d::Zero(), -y.x() * Xw, Eigen::RowVector4d::Zero(), Xw, -y.y() * Xw;
      normal->Add(J, r, loss.weight);
    }
    return sum;
  };
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = P;
  Vector12d p = Eigen::Map<const Vector12d>(rows.data());
  const LeastSquaresSummary summary = MinimiseSquares<12>({.max_iterations = 10, .homogeneous = true}, cost, p);
  P = CameraFromRows(p);
  return summary;
}

std::optional<Resection> Resect(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x,
                                double px_per_unit, const ResectionOptions& options) {
  const std::size_t n = X.size();
  if (n < static_cast<std::size_t>(std::max(6, options.min_inliers))) return std::nullopt;
  const double limit2 = options.inlier_px * options.inlier_px;
  const auto error = [&](const Matrix34d& P, std::size_t i) { return CameraErrorPx2(P, X[i], x[i], px_per_unit); };
  Consensus<Matrix34d, decltype(error)> consensus(n, limit2, error);
  const auto propose = [&](const std::array<std::size_t, 6>& sample) {
    if (!consensus.Offer(SixPoint(X, x, sample))) return false;
    // A few points carry their noise far: what agrees is fitted before it is counted.
    for (int again = 0; again < 2 && consensus.InlierCount() >= kFewestFitted; ++again)
      if (!consensus.Offer(LinearCamera(X, x, consensus.Inliers(), consensus.best()))) break;
    return true;
  };
  std::mt19937_64 random(options.seed);
  DrawModels<6>({.min_trials = 20, .max_trials = options.max_iterations}, n, random, consensus, propose);
  if (!consensus.found()) return std::nullopt;
  Resection result;
  result.P = consensus.best();
  for (int again = 0; again < 3; ++again) {
    result.inlier.assign(n, 0);
    result.inlier_count = 0;
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const double e = error(result.P, i);
      if (!(e < limit2)) continue;
      result.inlier[i] = 1;
      ++result.inlier_count;
      sum += e;
    }
    if (result.inlier_count < options.min_inliers) return std::nullopt;
    result.rms_px = std::sqrt(sum / result.inlier_count);
    if (again < 2) result.refined = RefineCamera(X, x, result.inlier, px_per_unit, options.inlier_px / 2, result.P);
  }
  return result;
}

}  // namespace lumi
