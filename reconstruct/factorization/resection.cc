#include "reconstruct/factorization/resection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

Matrix34d CameraFromRows(const Vector12d& p) { return Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(p.data()); }

double CameraErrorPx2(const Matrix34d& P, const Eigen::Vector4d& X, const Eigen::Vector2d& x, double unit) {
  const Eigen::Vector3d q = P * X;
  const double e = (q.head<2>() / q.z() - x).squaredNorm() * unit * unit;
  return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

Matrix34d SixPoint(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x, const std::size_t* s) {
  Eigen::Matrix<double, 12, 11> At;
  for (int i = 0; i < 11; ++i) {
    const std::size_t k = s[i / 2];
    if (i % 2 == 0)
      At.col(i) << X[k], Eigen::Vector4d::Zero(), -x[k].x() * X[k];
    else
      At.col(i) << Eigen::Vector4d::Zero(), X[k], -x[k].y() * X[k];
  }
  return CameraFromRows(PerpendicularColumns(At));
}

Matrix34d LinearCamera(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x, const std::vector<char>& use,
    const Matrix34d& about) {
  Matrix12d gram = Matrix12d::Zero();
  for (std::size_t i = 0; i < X.size(); ++i) {
    if (!use[i]) continue;
    // Divided by the depth of the last estimate: the algebraic error is then the image's.
    const double w = about.row(2).dot(X[i]);
    const Eigen::Vector4d Xw = X[i] / w;
    Eigen::Matrix<double, 2, 12> r;
    r << Xw.transpose(), Eigen::RowVector4d::Zero(), -x[i].x() * Xw.transpose(), Eigen::RowVector4d::Zero(), Xw.transpose(),
        -x[i].y() * Xw.transpose();
    gram.noalias() += r.transpose() * r;
  }
  return CameraFromRows(LeastDirection(gram / gram.trace()));
}

}  // namespace

Matrix34d RefineCamera(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x, const std::vector<char>& use,
                       double px_per_unit, double scale_px, Matrix34d P) {
  P.normalize();
  const auto loss = [&](const Matrix34d& Q) {
    double sum = 0;
    for (std::size_t i = 0; i < X.size(); ++i) {
      if (!use[i]) continue;
      const double e = CameraErrorPx2(Q, X[i], x[i], px_per_unit);
      sum += scale_px > 0 ? scale_px * scale_px * std::log1p(e / (scale_px * scale_px)) : e;
    }
    return sum;
  };
  double best = loss(P), damping = 1e-6;
  for (int round = 0; round < 10 && std::isfinite(best); ++round) {
    Matrix12d A = Matrix12d::Zero();
    Vector12d g = Vector12d::Zero();
    for (std::size_t i = 0; i < X.size(); ++i) {
      if (!use[i]) continue;
      const Eigen::Vector3d q = P * X[i];
      const Eigen::Vector2d y = q.head<2>() / q.z();
      const Eigen::Vector2d r = (y - x[i]) * px_per_unit;
      const double w = scale_px > 0 ? 1 / (1 + r.squaredNorm() / (scale_px * scale_px)) : 1.0;
      const Eigen::Vector4d Xw = X[i] * (px_per_unit / q.z());
      Eigen::Matrix<double, 2, 12> J;
      J << Xw.transpose(), Eigen::RowVector4d::Zero(), -y.x() * Xw.transpose(), Eigen::RowVector4d::Zero(), Xw.transpose(),
          -y.y() * Xw.transpose();
      A.noalias() += w * J.transpose() * J;
      g.noalias() += w * J.transpose() * r;
    }
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = P;
    const Vector12d p = Eigen::Map<const Vector12d>(rows.data());
    const double size = A.trace() / 12;
    bool better = false;
    for (int attempt = 0; attempt < 5 && !better; ++attempt) {
      // The scale of P is free: its direction is filled in.
      const Matrix12d damped = A + size * (p * p.transpose() + damping * Matrix12d::Identity());
      const Matrix34d Q = CameraFromRows(p - SolveSymmetric(damped, g)).normalized();
      const double c = Q.allFinite() ? loss(Q) : std::numeric_limits<double>::infinity();
      if (c < best) {
        better = true;
        const bool done = best - c < 1e-8 * best;
        P = Q;
        best = c;
        damping = std::max(damping * 0.1, 1e-12);
        if (done) return P;
      } else {
        damping *= 100;
      }
    }
    if (!better) break;
  }
  return P;
}

std::optional<Resection> Resect(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x, double px_per_unit,
                                const ResectionOptions& options) {
  const std::size_t n = X.size();
  if (n < static_cast<std::size_t>(std::max(6, options.min_inliers))) return std::nullopt;
  std::mt19937_64 random(options.seed);
  const double limit2 = options.inlier_px * options.inlier_px;
  Resection result;
  double best = static_cast<double>(n) * limit2;
  const double worst = best;
  const auto collect = [&](const Matrix34d& P, std::vector<char>& inlier) {
    int count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      inlier[i] = CameraErrorPx2(P, X[i], x[i], px_per_unit) < limit2;
      count += inlier[i];
    }
    return count;
  };
  const auto score_of = [&](const Matrix34d& P, double limit) {
    double score = 0;
    for (std::size_t i = 0; i < n && score < limit; ++i) score += std::min(limit2, CameraErrorPx2(P, X[i], x[i], px_per_unit));
    return score;
  };
  std::vector<char> inlier(n);
  for (int round = 0, needed = options.max_iterations; round < needed; ++round) {
    std::size_t s[6];
    for (int i = 0; i < 6; ++i) {
      do s[i] = random() % n;
      while (std::find(s, s + i, s[i]) != s + i);
    }
    Matrix34d P = SixPoint(X, x, s);
    double score = score_of(P, best);
    if (!(score < best)) continue;
    // A few points carry their noise far: what agrees is fitted before it is counted.
    for (int again = 0; again < 2; ++again) {
      if (collect(P, inlier) < 8) break;
      const Matrix34d Q = LinearCamera(X, x, inlier, P);
      const double fitted = Q.allFinite() ? score_of(Q, score) : score;
      if (!(fitted < score)) break;
      P = Q;
      score = fitted;
    }
    best = score;
    result.P = P;
    const double share = collect(P, inlier) / static_cast<double>(n), all = std::pow(share, 6);
    if (all > 1e-9) needed = static_cast<int>(std::min<double>(options.max_iterations, std::max(20.0,
        std::ceil(std::log(1e-4) / std::log1p(-std::min(all, 1 - 1e-9))))));
  }
  if (!(best < worst)) return std::nullopt;
  result.inlier.resize(n);
  for (int again = 0; again < 2; ++again) {
    if (collect(result.P, result.inlier) < options.min_inliers) return std::nullopt;
    result.P = RefineCamera(X, x, result.inlier, px_per_unit, options.inlier_px / 2, result.P);
  }
  result.inlier_count = collect(result.P, result.inlier);
  if (result.inlier_count < options.min_inliers) return std::nullopt;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i)
    if (result.inlier[i]) sum += CameraErrorPx2(result.P, X[i], x[i], px_per_unit);
  result.rms_px = std::sqrt(sum / result.inlier_count);
  return result;
}

}  // namespace lumi
