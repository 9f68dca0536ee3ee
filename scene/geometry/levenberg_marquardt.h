// One damped least-squares loop (Levenberg 1944, Marquardt 1963) for the small dense problems of this suite: a point, a
// camera, a transformation, a plane at infinity. A problem adds up its own normal equations, its robust weights with
// them, so that no Jacobian of all residuals is stored. ceres::TinySolver stores one, and knows neither weights nor
// homogeneous unknowns; what is large or sparse is Ceres'.
//
//   const auto cost = [&](const Eigen::Vector3d& x, NormalEquations<3>* normal) {
//     ...; if (normal) normal->Add(J, r, weight); ...; return sum;
//   };
//   const LeastSquaresSummary summary = MinimiseSquares<3>({.max_iterations = 10}, cost, x);
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"

namespace lumi {

struct LeastSquaresOptions {
  int max_iterations = 20;  // steps that are taken
  int max_attempts = 5;     // at one step, each damped more than the one before; 1: Gauss-Newton
  double tolerance = 1e-8;  // the last step: one that lowers the cost by less than this part
  double damping = 1e-6;    // at first, of the normal matrix' mean diagonal element; 0 stays 0
  double min_damping = 1e-12;
  double damping_fall = 0.1;  // factor after a step that is taken ...
  double damping_rise = 100;  // ... and after one that is not
  bool homogeneous = false;   // x has length 1 and any scale: no step is spent along it
};

enum class LeastSquaresStop {
  kConverged,  // a step lowered the cost by less than the tolerance, or the cost is 0
  kNoGain,  // no step lowers the cost, however damped: x is a minimum to rounding, or the equations do not determine a
            // step
  kMaxIterations,
  kNotFinite,  // the cost of the start, or a derivative, is not a number; x is the last that had a cost
};

struct LeastSquaresSummary {
  LeastSquaresStop stop = LeastSquaresStop::kMaxIterations;
  int iterations = 0;  // steps taken
  double start_cost = 0, cost = 0;
};

// Sums over residuals r with derivatives J by the unknowns: A = J^T w J, g = J^T w r.
template <int N>
struct NormalEquations {
  explicit NormalEquations(Eigen::Index n) { A.setZero(n, n), g.setZero(n); }
  template <typename Derivatives, typename Residual>
  void Add(const Eigen::MatrixBase<Derivatives>& J, const Eigen::MatrixBase<Residual>& r, double weight = 1) {
    A.noalias() += weight * J.transpose() * J;
    g.noalias() += weight * J.transpose() * r;
  }
  Eigen::Matrix<double, N, N> A;
  Eigen::Matrix<double, N, 1> g;
};

// Cauchy's loss of a squared residual, and the weight in the normal equations that goes with it. scale2: the square of
// a residual that counts half; 0: least squares.
struct RobustLoss {
  double cost, weight;
};
inline RobustLoss Cauchy(double squared, double scale2) {
  if (!(scale2 > 0)) return {squared, 1};
  return {scale2 * std::log1p(squared / scale2), 1 / (1 + squared / scale2)};
}

// Lowers cost(x, nullptr) from x on. cost(x, &normal) adds to the equations too; a cost that is infinite or no number
// is refused.
template <int N, typename Cost>
LeastSquaresSummary MinimiseSquares(const LeastSquaresOptions& options, const Cost& cost,
                                    Eigen::Matrix<double, N, 1>& x) {
  LeastSquaresSummary summary;
  const auto stop = [&](LeastSquaresStop why) {
    summary.stop = why;
    return summary;
  };
  if (options.homogeneous) x.normalize();
  for (double damping = options.damping; summary.iterations < options.max_iterations;) {
    NormalEquations<N> normal(x.size());
    const double now = cost(x, &normal), size = normal.A.trace() / static_cast<double>(x.size());
    if (summary.iterations == 0) summary.start_cost = now;
    summary.cost = now;
    if (!std::isfinite(now) || !std::isfinite(size) || !normal.g.allFinite()) return stop(LeastSquaresStop::kNotFinite);
    if (now == 0) return stop(LeastSquaresStop::kConverged);
    if (options.homogeneous) normal.A += size * x * x.transpose();  // the direction without weight
    for (int attempt = 0; attempt < options.max_attempts && !(summary.cost < now); ++attempt) {
      Eigen::Matrix<double, N, N> damped = normal.A;
      damped.diagonal().array() += damping * size;
      Eigen::Matrix<double, N, 1> next = x - SolveSymmetric(damped, normal.g);
      if (options.homogeneous) next.normalize();
      const double then = next.allFinite() ? cost(next, nullptr) : std::numeric_limits<double>::infinity();
      if (then < now) {
        x = next;
        summary.cost = then;
        damping = std::max(options.damping_fall * damping, std::min(options.damping, options.min_damping));
      } else {
        damping *= options.damping_rise;
      }
    }
    if (!(summary.cost < now)) return stop(LeastSquaresStop::kNoGain);
    ++summary.iterations;
    if (now - summary.cost < options.tolerance * now) return stop(LeastSquaresStop::kConverged);
  }
  return summary;
}

}  // namespace lumi
