// Pixels between a sight and P X, by all numbers of P and X, for Ceres: X homogeneous of N numbers, P of shape (3, N),
// row after row. Directions have three (homographies), points in space four (beside which tests hold our own
// adjustment). Fails on the principal plane.
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <cmath>

namespace lumi {

template <int N>
class ReprojectionCost final : public ceres::SizedCostFunction<2, 3 * N, N> {
 public:
  ReprojectionCost(const Eigen::Vector2d& x, double px_per_unit) : x_(x), unit_(px_per_unit) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Matrix<double, 3, N, Eigen::RowMajor>> P(parameters[0]);
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> X(parameters[1]);
    const Eigen::Vector3d q = P * X;
    const double s = unit_ / q.z();
    if (!std::isfinite(s)) return false;
    const Eigen::Vector2d y = q.head<2>() / q.z();
    Eigen::Map<Eigen::Vector2d>(residuals, 2) = (y - x_) * unit_;
    if (!jacobians) return true;
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, 2, 3 * N, Eigen::RowMajor>> J(jacobians[0]);
      J.setZero();
      for (int r = 0; r < 2; ++r) {
        J.template block<1, N>(r, N * r) = s * X.transpose();
        J.template block<1, N>(r, 2 * N) = -s * y[r] * X.transpose();
      }
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, 2, N, Eigen::RowMajor>> J(jacobians[1]);
      for (int r = 0; r < 2; ++r) J.row(r) = s * (P.row(r) - y[r] * P.row(2));
    }
    return true;
  }

 private:
  Eigen::Vector2d x_;
  double unit_;
};

}  // namespace lumi
