// Small pieces of linear least squares that the stage's parts share.
#pragma once

#include <Eigen/Core>

namespace lumi {

// Orthonormal columns that span A's, its dependent ones left out (to 1e-9 of their length). Gram and Schmidt, twice.
Eigen::MatrixXd OrthonormalSpan(const Eigen::MatrixXd& A);

// y ~ polynomial of t, weighted: coefficients with their standard deviations from the residuals.
struct PolynomialFit {
  Eigen::VectorXd coefficient;  // ascending powers
  Eigen::VectorXd sigma;        // 0 where there are no more points than coefficients
};
PolynomialFit FitPolynomial(const Eigen::VectorXd& t, const Eigen::VectorXd& y, const Eigen::VectorXd& weight,
                            int degree);

}  // namespace lumi
