#include "render/radiance/optimum/dense_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "render/radiance/dissimilarity.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {

Eigen::MatrixXd SimilarityMatrix(const FallingLeaves& leaves, double alpha, const DenseSystem& s) {
  const Eigen::Index n = s.f.size();
  const double unit = 2 * leaves.r_max_rad();
  const double reach = alpha * std::numbers::pi > unit ? 2 * std::sin(0.5 * unit / alpha) : 2.0;
  Eigen::MatrixXd S = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = j + 1; i < n; ++i) {
      const Eigen::Vector3d a = s.u.col(i), b = s.u.col(j);
      const double chord = (a - b).norm();
      if (chord > reach * (1 + 1e-15)) continue;
      // Kahan: no digits are lost at either end.
      double h = alpha * 2 * std::atan2(chord, (a + b).norm());
      for (Eigen::Index c = 0; c < s.channel.cols(); ++c) h = WithTerm(h, unit, s.channel(i, c), s.channel(j, c));
      S(i, j) = S(j, i) = s.f[i] * s.f[j] * leaves.PSame(h);
    }
  return S;
}

DenseResult SolveDense(const Eigen::MatrixXd& S, const Eigen::VectorXd& y, const Eigen::VectorXd& f, bool also_z) {
  DenseResult out;
  Eigen::MatrixXd A = S;
  for (; out.nugget <= kLargestNugget * 1.5; out.nugget *= 10) {
    A.diagonal() = S.diagonal().array() + out.nugget;
    const Eigen::LLT<Eigen::MatrixXd> factor(A);
    if (factor.info() != Eigen::Success) continue;
    out.w = factor.solve(y);
    if (also_z) out.z = factor.solve(f);
    return out;
  }
  const SymmetricEigen eigen = EigenOfSymmetric(S);
  out.clipped = true;
  const Eigen::VectorXd inverse = eigen.values.cwiseMax(kSmallestEigenvalue).cwiseInverse();
  const Eigen::MatrixXd& V = eigen.vectors;
  out.w = V * (inverse.asDiagonal() * (V.transpose() * y));
  if (also_z) out.z = V * (inverse.asDiagonal() * (V.transpose() * f));
  return out;
}

}  // namespace lumi
