// The least-squares problem of a path: its derivatives, its frequency response, its held frames.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "stabilize/path_problem.h"
#include "tests/stabilize/walks.h"

namespace lumi {
namespace {

using namespace test;

// Points on a plane in front of a camera [I | 0] that shakes by a shift: a path that every frame can follow exactly.
struct Shifted {
  std::vector<WantedFrame> wanted;
  std::vector<Matrix34d> P;
};
Shifted Shift(int frames, const std::function<Eigen::Vector2d(int)>& shift) {
  Shifted s;
  const auto X = PointsIn({-1, -0.6, 1}, {1, 0.6, 2}, 12, 5);
  for (int t = 0; t < frames; ++t) {
    Matrix34d P = Matrix34d::Zero();
    P.leftCols<3>().setIdentity();
    P.block<2, 1>(0, 2) = shift(t);
    s.P.push_back(P / P.norm());
    WantedFrame& frame = s.wanted.emplace_back();
    for (const Eigen::Vector4d& x : X) frame.points.push_back({x, Eigen::Vector3d(P * x).hnormalized(), 1});
  }
  return s;
}
double ShiftOf(const Matrix34d& P) { return P(0, 2) / P(2, 2); }

TEST(PathProblem, IsTheLowPassItSaysItIs) {
  for (const double cutoff : {0.3, 1.0})
    for (const double hz : {0.05, 0.3, 1.0, 2.0}) {
      constexpr int kFrames = 901, kMiddle = 450;  // ends far from the middle
      const double amplitude = 0.02;
      const Shifted s = Shift(kFrames, [&](int t) {
        return Eigen::Vector2d(amplitude * std::cos(2 * std::numbers::pi * hz * (t - kMiddle) / kFps), 0);
      });
      PathProblemOptions options;
      options.smoothness = SmoothnessOf(cutoff, kFps);
      std::vector<Matrix34d> P = s.P;
      const PathProblemSummary summary = SolvePathProblem(s.wanted, options, P);
      ASSERT_TRUE(summary.usable);
      const double w = 2 - 2 * std::cos(2 * std::numbers::pi * hz / kFps),
                   expected = 1 / (1 + options.smoothness * w * w);
      EXPECT_NEAR(ShiftOf(P[kMiddle]) / amplitude, expected, 2e-3) << cutoff << " " << hz;
    }
  EXPECT_NEAR(1 / (1 + SmoothnessOf(0.3, 30) * std::pow(2 - 2 * std::cos(2 * std::numbers::pi * 0.01), 2)), 0.5, 1e-12);
  EXPECT_NEAR(SmoothnessOf(1000, 30), 1.0 / 16, 1e-12);  // beyond Nyquist: its own
}

// The cost's gradient by finite differences vanishes at the solution, and only there: the analytic derivatives are the
// residuals'.
TEST(PathProblem, EndsWhereFiniteDifferencesSayThatNothingIsToBeGained) {
  const Walk walk = Forward(14);
  const FilmedScene film = ReadWalk(walk);
  std::vector<WantedFrame> wanted;
  std::vector<Matrix34d> P;
  PathProblemOptions options;
  options.smoothness = 30;
  options.max_iterations = 200;
  options.tolerance = 1e-16;
  for (std::size_t t = 0; t < film.frames.size(); ++t) {
    WantedFrame& frame = wanted.emplace_back();
    frame.weight = 1 + 0.2 * static_cast<double>(t);
    frame.parallax = 3;
    frame.alike = 2;
    const Eigen::Vector4d centre = CentreOfProjection(film.frames[t].P);
    for (std::size_t k = 0; k < film.frames[t].sights.size(); k += 5) {
      const Eigen::Vector4d& X = film.X[static_cast<std::size_t>(film.frames[t].sights[k].point)];
      frame.points.push_back({X, film.frames[t].sights[k].x, 1.0 + static_cast<double>(k % 3),
                              k % 2 == 0 ? Eigen::Vector4d(X + 0.3 * X.norm() * centre) : Eigen::Vector4d::Zero(),
                              film.frames[t].sights[k].x});
      frame.bend.emplace_back(1e-3 * std::sin(static_cast<double>(k)), 1e-3);
    }
    P.push_back(film.frames[t].P);
    options.times.push_back(static_cast<double>(t) + (t > 6 ? 3 : 0));
  }
  // (a, b, t) of the similarity of the filmed picture that a picture is nearest to, and how far from it, weighed.
  const auto unlike = [&](const WantedFrame& frame, const Matrix34d& p) {
    Eigen::Matrix4d N = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    double square = 0;
    for (const WantedPoint& point : frame.points) {
      Eigen::Matrix<double, 2, 4> rows;
      rows << point.filmed.x(), -point.filmed.y(), 1, 0, point.filmed.y(), point.filmed.x(), 0, 1;
      const Eigen::Vector2d y = Eigen::Vector3d(p * point.X).hnormalized();
      N += point.share * rows.transpose() * rows;
      right += point.share * rows.transpose() * y;
      square += point.share * y.squaredNorm();
    }
    return square - right.dot(N.inverse() * right);
  };
  const auto cost = [&](const std::vector<Matrix34d>& at) {
    double sum = 0;
    for (std::size_t t = 0; t < at.size(); ++t) {
      double shares = 0;
      for (const WantedPoint& p : wanted[t].points) shares += p.share;
      sum += 0.5 * wanted[t].alike / shares * unlike(wanted[t], at[t]);
      for (std::size_t j = 0; j < wanted[t].points.size(); ++j) {
        const WantedPoint& p = wanted[t].points[j];
        const auto image = [&](std::size_t s) { return Eigen::Vector2d(Eigen::Vector3d(at[s] * p.X).hnormalized()); };
        sum += 0.5 * p.share / shares * wanted[t].weight * (image(t) - p.y).squaredNorm();
        if (!p.Z.isZero())
          sum += 0.5 * p.share / shares * wanted[t].parallax *
                 (image(t) - Eigen::Vector3d(at[t] * p.Z).hnormalized()).squaredNorm();
        if (t == 0 || t + 1 == at.size()) continue;
        const auto D2 = SecondDifference(options.times, t);
        sum += 0.5 * p.share / shares * options.smoothness *
               (D2[0] * image(t - 1) + D2[1] * image(t) + D2[2] * image(t + 1) - wanted[t].bend[j]).squaredNorm();
      }
    }
    return sum;
  };
  const auto gradient = [&](const std::vector<Matrix34d>& at) {
    double largest = 0;
    for (std::size_t t = 0; t < at.size(); ++t)
      for (int i = 0; i < 12; ++i) {
        constexpr double kStep = 1e-6;
        std::vector<Matrix34d> low = at, high = at;
        low[t](i / 4, i % 4) -= kStep;
        high[t](i / 4, i % 4) += kStep;
        largest = std::max(largest, std::abs(cost(high) - cost(low)) / (2 * kStep));
      }
    return largest;
  };
  const double before = gradient(P), start = cost(P);
  const PathProblemSummary summary = SolvePathProblem(wanted, options, P);
  ASSERT_TRUE(summary.usable);
  EXPECT_NEAR(summary.start_cost, start, 1e-9 * start);
  EXPECT_NEAR(summary.cost, cost(P), 1e-9 * start);
  EXPECT_LT(gradient(P), 1e-6 * before);
}

TEST(SecondDifference, OfAConstantVelocityIsNoneWhereverFramesAreMissing) {
  const std::vector<double> times = {0, 1, 4, 4.5, 9};
  for (std::size_t t = 1; t + 1 < times.size(); ++t) {
    const auto d = SecondDifference(times, t);
    EXPECT_NEAR(d[0] + d[1] + d[2], 0, 1e-12);
    EXPECT_NEAR(d[0] * times[t - 1] + d[1] * times[t] + d[2] * times[t + 1], 0, 1e-12);
    const double parabola =
        d[0] * times[t - 1] * times[t - 1] + d[1] * times[t] * times[t] + d[2] * times[t + 1] * times[t + 1];
    EXPECT_NEAR(parabola, 2 * std::sqrt(0.5 * (times[t + 1] - times[t - 1])), 1e-12);
  }
  const auto even = SecondDifference({0, 1, 2}, 1);
  EXPECT_EQ(even[0], 1);
  EXPECT_EQ(even[1], -2);
  EXPECT_EQ(even[2], 1);
}

TEST(PathProblem, LeavesHeldFramesWhereTheyAreAndJoinsThemSmoothly) {
  Shifted s = Shift(80, [](int t) { return Eigen::Vector2d(t % 2 == 0 ? 0.01 : -0.01, 0); });
  for (int t = 0; t < 10; ++t) {
    s.P[static_cast<std::size_t>(t)].block<2, 1>(0, 2) =
        s.P[static_cast<std::size_t>(t)](2, 2) * Eigen::Vector2d(0.05, 0);
    s.wanted[static_cast<std::size_t>(t)].held = true;
  }
  PathProblemOptions options;
  options.smoothness = SmoothnessOf(0.3, kFps);
  std::vector<Matrix34d> P = s.P;
  ASSERT_TRUE(SolvePathProblem(s.wanted, options, P).usable);
  for (std::size_t t = 0; t < 10; ++t) EXPECT_TRUE(P[t].isApprox(s.P[t].normalized(), 1e-12));
  EXPECT_NEAR(ShiftOf(P[10]), 0.05, 2e-3);  // goes on as it was
  EXPECT_NEAR(ShiftOf(P[60]), 0, 3e-3);
  for (std::size_t t = 9; t < 78; ++t)
    EXPECT_LT(std::abs(ShiftOf(P[t]) - 2 * ShiftOf(P[t + 1]) + ShiftOf(P[t + 2])), 5e-4);
}

TEST(PathProblem, RefusesNumbersThatDoNotFitAndReturnsWithoutTargets) {
  Shifted s = Shift(5, [](int) { return Eigen::Vector2d(0, 0); });
  std::vector<Matrix34d> fewer(s.P.begin(), s.P.begin() + 3), P = s.P;
  EXPECT_THROW(SolvePathProblem(s.wanted, {}, fewer), std::invalid_argument);
  PathProblemOptions options;
  options.times = {0, 1, 2};
  EXPECT_THROW(SolvePathProblem(s.wanted, options, P), std::invalid_argument);
  options.times = {0, 1, 1, 2, 3};
  EXPECT_THROW(SolvePathProblem(s.wanted, options, P), std::invalid_argument);
  EXPECT_FALSE(SolvePathProblem(std::vector<WantedFrame>(5), {}, P).usable);
  for (std::size_t t = 0; t < 5; ++t) EXPECT_EQ(P[t], s.P[t]);
}

}  // namespace
}  // namespace lumi
