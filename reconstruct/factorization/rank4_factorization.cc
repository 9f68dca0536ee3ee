#include "reconstruct/factorization/rank4_factorization.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr Eigen::Index kMinComplete = 8;
constexpr int kSubspaceSteps = 3;  // of the orthogonal iteration; it starts at the last subspace

// Columns to norm 1, frames to equal norm. W and depths scale together.
void Balance(MatrixXd& W) {
  const Eigen::Index frames = W.rows() / 3;
  for (int sweep = 0; sweep < 3; ++sweep) {
    for (Eigen::Index p = 0; p < W.cols(); ++p) {
      const double n = W.col(p).norm();
      if (n > 0) W.col(p) /= n;
    }
    const double target = std::sqrt(static_cast<double>(W.cols()) / static_cast<double>(frames));
    for (Eigen::Index f = 0; f < frames; ++f) {
      const double n = W.middleRows<3>(3 * f).norm();
      if (n > 0) W.middleRows<3>(3 * f) *= target / n;
    }
  }
}

MatrixXd LeadingSubspace(const MatrixXd& W) { return EigenOfSymmetric(W * W.transpose()).vectors.rightCols<4>(); }

// The point nearest to the seen rows of a column, by reprojection in the subspace U: x_f x (U_f X) = 0.
Vector4d PointFrom(const MeasurementMatrix& m, const MatrixXd& U, Eigen::Index p) {
  Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
  for (Eigen::Index f = 0; f < m.seen.rows(); ++f) {
    if (!m.seen(f, p)) continue;
    for (Eigen::Index r = 0; r < 2; ++r) {
      const Eigen::RowVector4d row = m.x(2 * f + r, p) * U.row(3 * f + 2) - U.row(3 * f + r);
      gram.noalias() += row.transpose() * row;
    }
  }
  return LeastDirection(gram);
}

// Column of depth times image point where seen, of the model where not.
void FillColumn(const MeasurementMatrix& m, const MatrixXd& U, const Vector4d& X, Eigen::Index p, MatrixXd& W) {
  for (Eigen::Index f = 0; f < m.seen.rows(); ++f) {
    const Vector3d model = U.middleRows<3>(3 * f) * X;
    if (!m.seen(f, p)) {
      W.col(p).segment<3>(3 * f) = model;
      continue;
    }
    const Vector3d ray(m.x(2 * f, p), m.x(2 * f + 1, p), 1);
    W.col(p).segment<3>(3 * f) = ray * (ray.dot(model) / ray.squaredNorm());
  }
}

double Rms(const MeasurementMatrix& m, const MatrixXd& U, const MatrixXd& X) {
  const MatrixXd model = U * X;
  double sum = 0;
  Eigen::Index n = 0;
  for (Eigen::Index p = 0; p < m.seen.cols(); ++p)
    for (Eigen::Index f = 0; f < m.seen.rows(); ++f) {
      if (!m.seen(f, p)) continue;
      const double w = model(3 * f + 2, p);
      // Truncated: one point near a principal plane shall not decide which iterate is best.
      const double e = std::hypot(model(3 * f, p) / w - m.x(2 * f, p), model(3 * f + 1, p) / w - m.x(2 * f + 1, p));
      sum += e < 1 ? e * e : 1.0;
      ++n;
    }
  return n > 0 ? std::sqrt(sum / static_cast<double>(n)) : 0.0;
}

}  // namespace

Factorisation Factorise(const MeasurementMatrix& m, const MatrixXd& start, const FactoriseOptions& options) {
  Factorisation result;
  const Eigen::Index frames = m.seen.rows(), points = m.seen.cols();
  if (frames < 2 || points < kMinComplete) return result;
  const Eigen::Array<bool, 1, Eigen::Dynamic> complete = m.seen.colwise().all();

  MatrixXd W(3 * frames, points);
  MatrixXd U, A(4, points);
  if (start.rows() == 3 * frames && start.cols() == 4) {
    U = OrthonormalColumns(start);
    for (Eigen::Index p = 0; p < points; ++p) FillColumn(m, U, A.col(p) = PointFrom(m, U, p), p, W);
  } else {
    std::vector<Eigen::Index> whole;
    for (Eigen::Index p = 0; p < points; ++p)
      if (complete[p]) whole.push_back(p);
    if (static_cast<Eigen::Index>(whole.size()) < kMinComplete) return result;
    for (const Eigen::Index p : whole)
      for (Eigen::Index f = 0; f < frames; ++f) W.col(p).segment<3>(3 * f) << m.x(2 * f, p), m.x(2 * f + 1, p), 1;
    MatrixXd seed(3 * frames, static_cast<Eigen::Index>(whole.size()));
    for (std::size_t i = 0; i < whole.size(); ++i) seed.col(static_cast<Eigen::Index>(i)) = W.col(whole[i]);
    Balance(seed);
    U = LeadingSubspace(seed);
    for (Eigen::Index p = 0; p < points; ++p) {
      A.col(p) = PointFrom(m, U, p);
      if (!complete[p]) FillColumn(m, U, A.col(p), p, W);
    }
  }
  result.start_rms = Rms(m, U, A);
  result.rms = result.start_rms;
  result.P = U;
  result.X = A;
  MatrixXd best_W = W;
  Balance(best_W);

  double last = result.start_rms;
  int without_gain = 0;
  for (int it = 0; it < options.max_iterations; ++it) {
    Balance(W);
    for (int k = 0; k < kSubspaceSteps; ++k) U = OrthonormalColumns(W * (W.transpose() * U));
    A.noalias() = U.transpose() * W;
    ++result.iterations;
    const double rms = Rms(m, U, A);
    if (!std::isfinite(rms)) break;
    if (rms < result.rms) {
      result.rms = rms;
      result.P = U;
      result.X = A;
      best_W = W;
    }
    if (rms < 1e-14) break;
    without_gain = rms < last * (1 - options.tolerance) ? 0 : without_gain + 1;
    if (without_gain >= 3) break;
    last = rms;
    // The next depths.
    for (Eigen::Index p = 0; p < points; ++p) {
      if (!complete[p]) {
        FillColumn(m, U, A.col(p), p, W);
        continue;
      }
      Eigen::Matrix4Xd C(4, frames);
      for (Eigen::Index f = 0; f < frames; ++f)
        C.col(f) = U.middleRows<3>(3 * f).transpose() * Vector3d(m.x(2 * f, p), m.x(2 * f + 1, p), 1).normalized();
      const Eigen::VectorXd depth = C.transpose() * EigenOfSymmetric(C * C.transpose()).vectors.col(3);
      // The eigenvector's sign is free: the one that goes on from the last depths.
      double agree = 0;
      for (Eigen::Index f = 0; f < frames; ++f) agree += depth[f] * W(3 * f + 2, p);
      for (Eigen::Index f = 0; f < frames; ++f)
        W.col(p).segment<3>(3 * f) =
            Vector3d(m.x(2 * f, p), m.x(2 * f + 1, p), 1).normalized() * (agree < 0 ? -depth[f] : depth[f]);
    }
  }

  result.depths.resize(frames, points);
  const MatrixXd model = result.P * result.X;
  for (Eigen::Index f = 0; f < frames; ++f) result.depths.row(f) = model.row(3 * f + 2);
  // Quality is read off the complete columns where there are enough: filled entries have rank 4 by construction.
  MatrixXd measured = best_W;
  if (complete.count() >= 2 * kMinComplete) {
    Eigen::Index n = 0;
    for (Eigen::Index p = 0; p < points; ++p)
      if (complete[p]) measured.col(n++) = best_W.col(p);
    measured.conservativeResize(Eigen::NoChange, n);
  }
  const Eigen::VectorXd singular = SingularValues(measured);
  for (Eigen::Index i = 0; i < std::min<Eigen::Index>(8, singular.size()); ++i)
    result.singular_values.push_back(singular[i]);
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const double largest = result.singular_values.front();
  const auto ratio = [&](std::size_t i) {
    if (i >= result.singular_values.size() || !(result.singular_values[i] > 10 * kEpsilon * largest))
      return std::numeric_limits<double>::infinity();
    return result.singular_values[i - 1] / result.singular_values[i];
  };
  result.gap = ratio(4);
  result.rank3_gap = ratio(3);
  result.usable = result.P.allFinite() && result.X.allFinite();
  return result;
}

}  // namespace lumi
