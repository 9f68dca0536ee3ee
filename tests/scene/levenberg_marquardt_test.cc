#include "scene/geometry/levenberg_marquardt.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace lumi {
namespace {

using Eigen::Vector2d;

// Residuals 10 (y - x^2) and 1 - x: a bent valley, its minimum 0 at (1, 1).
double Rosenbrock(const Vector2d& x, NormalEquations<2>* normal) {
  const Vector2d r(10 * (x.y() - x.x() * x.x()), 1 - x.x());
  if (normal) {
    Eigen::Matrix2d J;
    J << -20 * x.x(), 10, -1, 0;
    normal->Add(J, r);
  }
  return r.squaredNorm();
}

TEST(MinimiseSquares, GoesDownRosenbrocksValleyAndSaysThatItConverged) {
  Vector2d x(-1.2, 1);
  const LeastSquaresSummary s = MinimiseSquares<2>({.max_iterations = 100, .tolerance = 1e-12}, Rosenbrock, x);
  EXPECT_NEAR((x - Vector2d(1, 1)).norm(), 0, 1e-7);
  EXPECT_TRUE(s.stop == LeastSquaresStop::kConverged || s.stop == LeastSquaresStop::kNoGain) << s.iterations;
  EXPECT_NEAR(s.start_cost, 24.2, 1e-12);
  EXPECT_LT(s.cost, 1e-14);
  EXPECT_GT(s.iterations, 5);
  EXPECT_LT(s.iterations, 100);
}

TEST(MinimiseSquares, OfUnknownsWhoseNumberIsKnownWhenItRunsIsTheSame) {
  const auto cost = [](const Eigen::VectorXd& x, NormalEquations<Eigen::Dynamic>* normal) {
    NormalEquations<2> two(2);
    const double c = Rosenbrock(x, normal ? &two : nullptr);
    if (normal) normal->A = two.A, normal->g = two.g;
    return c;
  };
  Vector2d fixed(-1.2, 1);
  Eigen::VectorXd x = fixed;
  const LeastSquaresOptions options{.max_iterations = 100, .tolerance = 1e-12};
  EXPECT_EQ(MinimiseSquares<Eigen::Dynamic>(options, cost, x).iterations,
            MinimiseSquares<2>(options, Rosenbrock, fixed).iterations);
  EXPECT_EQ((x - fixed).norm(), 0);
}

TEST(MinimiseSquares, StopsWhereItWasToldTo) {
  Vector2d x(-1.2, 1);
  const LeastSquaresSummary s = MinimiseSquares<2>({.max_iterations = 3}, Rosenbrock, x);
  EXPECT_EQ(s.stop, LeastSquaresStop::kMaxIterations);
  EXPECT_EQ(s.iterations, 3);
  EXPECT_EQ(s.cost, Rosenbrock(x, nullptr));
}

TEST(MinimiseSquares, AtAMinimumWithACostNothingIsGained) {
  // x = -1 and x = 1 wanted at once.
  const auto cost = [](const Vector2d& x, NormalEquations<2>* normal) {
    const Vector2d r(x.x() - 1, x.x() + 1);
    Eigen::Matrix2d J;
    J << 1, 0, 1, 0;
    if (normal) normal->Add(J, r);
    return r.squaredNorm();
  };
  Vector2d x(0, 3);
  const LeastSquaresSummary s = MinimiseSquares<2>({}, cost, x);
  EXPECT_EQ(s.stop, LeastSquaresStop::kNoGain);
  EXPECT_EQ(s.iterations, 0);
  // A singular problem: what it does not depend on stays as it was.
  x = {0.7, 3};
  const LeastSquaresSummary moved = MinimiseSquares<2>({}, cost, x);
  EXPECT_NEAR(x.x(), 0, 1e-6);
  EXPECT_EQ(x.y(), 3);
  EXPECT_NEAR(moved.cost, 2, 1e-12);
}

TEST(MinimiseSquares, WithoutAnyDerivativeNothingIsGained) {
  Vector2d x(1, 2);
  const LeastSquaresSummary s = MinimiseSquares<2>(
      {}, [](const Vector2d&, NormalEquations<2>*) { return 1.0; }, x);
  EXPECT_EQ(s.stop, LeastSquaresStop::kNoGain);
  EXPECT_EQ(x, Vector2d(1, 2));
}

TEST(MinimiseSquares, WhatIsNoNumberIsNamedAndLeftAlone) {
  for (const double bad : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    Vector2d x(1, 2);
    const LeastSquaresSummary s = MinimiseSquares<2>(
        {}, [bad](const Vector2d&, NormalEquations<2>*) { return bad; }, x);
    EXPECT_EQ(s.stop, LeastSquaresStop::kNotFinite);
    EXPECT_EQ(x, Vector2d(1, 2));
  }
}

TEST(MinimiseSquares, AStepToWhereThereIsNoCostIsTakenBack) {
  // 1 / x - 2 for x > 0: Gauss-Newton from 3 leads far below 0.
  const auto cost = [](const Eigen::Matrix<double, 1, 1>& x, NormalEquations<1>* normal) {
    if (!(x[0] > 0)) return std::numeric_limits<double>::infinity();
    const Eigen::Matrix<double, 1, 1> r(1 / x[0] - 2), J(-1 / (x[0] * x[0]));
    if (normal) normal->Add(J, r);
    return r.squaredNorm();
  };
  Eigen::Matrix<double, 1, 1> x(3.0);
  MinimiseSquares<1>({.max_iterations = 50, .max_attempts = 10}, cost, x);
  EXPECT_NEAR(x[0], 0.5, 1e-6);
}

TEST(MinimiseSquares, AHomogeneousUnknownKeepsItsLength) {
  // The direction that is perpendicular to three rays in a plane.
  const std::vector<Eigen::Vector3d> rays{{1, 0, 0.2}, {0, 1, -0.1}, {1, 1, 0.1}};
  const auto cost = [&](const Eigen::Vector3d& x, NormalEquations<3>* normal) {
    double sum = 0;
    for (const Eigen::Vector3d& ray : rays) {
      const Eigen::Matrix<double, 1, 1> r(ray.dot(x));
      sum += r.squaredNorm();
      if (normal) normal->Add(ray.transpose(), r);
    }
    return sum;
  };
  Eigen::Vector3d x(0.5, 0.5, 4);
  MinimiseSquares<3>({.max_iterations = 50, .homogeneous = true}, cost, x);
  EXPECT_NEAR(x.norm(), 1, 1e-15);
  EXPECT_LT(cost(x, nullptr), 1e-20);
}

TEST(Cauchy, CountsAnOutlierLessAndNoneAsLeastSquares) {
  EXPECT_EQ(Cauchy(9, 0).cost, 9);
  EXPECT_EQ(Cauchy(9, 0).weight, 1);
  EXPECT_EQ(Cauchy(4, 4).weight, 0.5);
  // The weight is the cost's slope.
  constexpr double kStep = 1e-6;
  EXPECT_NEAR((Cauchy(7 + kStep, 4).cost - Cauchy(7 - kStep, 4).cost) / (2 * kStep), Cauchy(7, 4).weight, 1e-8);
}

}  // namespace
}  // namespace lumi
