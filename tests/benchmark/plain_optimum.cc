// This file alone is compiled for this machine: its Eigen has another name, so that no inline function of it is taken
// for one of the rest of the program, whose alignment is another.
#define Eigen EigenOfThisMachine
#include "tests/benchmark/plain_optimum.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace lumi::test {

double SolvePlainly(const PlainSample& s, const FallingLeaves& leaves) {
  const Eigen::Index n = s.photos;
  const auto row = [n](const float* values) { return Eigen::Map<const Eigen::RowVectorXf>(values, n).cast<double>(); };
  Eigen::Matrix3Xd u(3, n);
  u << row(s.dx), row(s.dy), row(s.dz);
  u.colwise() -= Eigen::Map<const Eigen::Vector3d>(s.point);
  u.colwise().normalize();
  Eigen::MatrixXd S = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd y(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto fj = static_cast<double>(s.f[j]);
    y[j] = fj * leaves.PSame(static_cast<double>(s.theta[j]));
    for (Eigen::Index k = j + 1; k < n; ++k)
      S(k, j) = fj * static_cast<double>(s.f[k]) * leaves.PSameCubic(std::acos(std::min(1.0, u.col(j).dot(u.col(k)))));
  }
  S.diagonal().array() += s.nugget;
  return S.llt().solve(y).sum();
}

}  // namespace lumi::test
