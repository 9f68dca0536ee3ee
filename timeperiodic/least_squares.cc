#include "timeperiodic/least_squares.h"

#include <cmath>

#include "scene/geometry/dense_solvers.h"

namespace lumi {

Eigen::MatrixXd OrthonormalSpan(const Eigen::MatrixXd& A) {
  Eigen::MatrixXd Q(A.rows(), A.cols());
  Eigen::Index kept = 0;
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    Eigen::VectorXd v = A.col(j);
    const double length = v.norm();
    if (!(length > 0)) continue;
    for (int round = 0; round < 2; ++round) v -= Q.leftCols(kept) * (Q.leftCols(kept).transpose() * v);
    if (v.norm() < 1e-9 * length) continue;
    Q.col(kept++) = v.normalized();
  }
  return Q.leftCols(kept);
}

PolynomialFit FitPolynomial(const Eigen::VectorXd& t, const Eigen::VectorXd& y, const Eigen::VectorXd& weight,
                            int degree) {
  const Eigen::Index m = degree + 1;
  Eigen::MatrixXd B(t.size(), m);
  for (Eigen::Index k = 0; k < m; ++k) B.col(k) = t.array().pow(static_cast<double>(k));
  const Eigen::MatrixXd WB = weight.asDiagonal() * B;
  const Eigen::MatrixXd G = B.transpose() * WB;
  PolynomialFit fit;
  fit.coefficient = SolveSymmetric(G, WB.transpose() * y);
  fit.sigma = Eigen::VectorXd::Zero(m);
  if (t.size() <= m) return fit;
  const Eigen::VectorXd rest = y - B * fit.coefficient;
  const double s2 = rest.dot(weight.asDiagonal() * rest) / static_cast<double>(t.size() - m);
  const Eigen::MatrixXd inverse = SolveSymmetric(G, Eigen::MatrixXd::Identity(m, m));
  for (Eigen::Index k = 0; k < m; ++k) fit.sigma[k] = std::sqrt(std::max(0.0, s2 * inverse(k, k)));
  return fit;
}

}  // namespace lumi
