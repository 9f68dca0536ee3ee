// The least-squares problem of a path: its derivatives, its frequency response, its held frames.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

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
// times: of the frames, in frames.
Shifted ShiftAt(const std::vector<double>& times, const std::function<Eigen::Vector2d(double)>& shift) {
  Shifted s;
  const auto X = PointsIn({-1, -0.6, 1}, {1, 0.6, 2}, 12, 5);
  for (const double t : times) {
    Matrix34d P = Matrix34d::Zero();
    P.leftCols<3>().setIdentity();
    P.block<2, 1>(0, 2) = shift(t);
    s.P.push_back(P / P.norm());
    WantedFrame& frame = s.wanted.emplace_back();
    for (const Eigen::Vector4d& x : X) frame.points.push_back({x, Eigen::Vector3d(P * x).hnormalized(), 1});
  }
  return s;
}
std::vector<double> WholeFrames(int frames) {
  std::vector<double> times;
  for (int t = 0; t < frames; ++t) times.push_back(t);
  return times;
}
Shifted Shift(int frames, const std::function<Eigen::Vector2d(double)>& shift) {
  return ShiftAt(WholeFrames(frames), shift);
}
// Frames that each stand for the time up to the middle between them and their neighbours.
PathProblemOptions OnTimes(Shifted& s, const std::vector<double>& times, double cutoff_hz) {
  for (std::size_t t = 0; t < times.size(); ++t) s.wanted[t].weight = TimeStoodFor(times, t);
  PathProblemOptions options;
  options.smoothness = SmoothnessOf(cutoff_hz, kFps);
  options.times = times;
  return options;
}
// Steps of 2/3 to 4/3 of a frame, by which the times leave whole frames further and further; `share` of that.
std::vector<double> Jittered(int frames, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> step(2.0 / 3, 4.0 / 3);
  std::vector<double> times{0};
  for (int t = 1; t < frames; ++t) times.push_back(times.back() + 1 + share * (step(random) - 1));
  return times;
}
double ShiftOf(const Matrix34d& P) { return P(0, 2) / P(2, 2); }

TEST(PathProblem, IsTheLowPassItSaysItIs) {
  for (const double cutoff : {0.3, 1.0})
    for (const double hz : {0.05, 0.3, 1.0, 2.0}) {
      constexpr int kFrames = 901, kMiddle = 450;  // ends far from the middle
      const double amplitude = 0.02;
      const Shifted s = Shift(kFrames, [&](double t) {
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

TEST(TimeStoodFor, IsOneAtEvenStepsAndTheWholeOfTheTime) {
  const std::vector<double> even = WholeFrames(7), uneven = {0, 0.7, 2, 3.1, 3.8};
  for (std::size_t t = 0; t < even.size(); ++t) EXPECT_EQ(TimeStoodFor(even, t), 1);
  EXPECT_NEAR(TimeStoodFor(uneven, 0), 0.7, 1e-15);
  EXPECT_NEAR(TimeStoodFor(uneven, 2), 1.2, 1e-15);
  EXPECT_EQ(TimeStoodFor({5}, 0), 1);
}

TEST(PathProblem, LowPassesOnTheFramesOwnTimes) {
  // A cosine of the cutoff in frames of 20 to 40 ms, in frames of which one of 300 was dropped, and twice as dense in
  // one half of the film as in the other: half of it is left, where taking them for evenly spaced leaves 0.3 to 0.7.
  constexpr double kCutoff = 0.3, kAmplitude = 0.02;
  constexpr int kFrames = 901;
  std::vector<double> dropped = WholeFrames(kFrames);
  for (int t = 850; t > 0; t -= 300) dropped.erase(dropped.begin() + t);
  std::vector<double> denser;
  for (double t = 0; t < kFrames; t += t < kFrames / 2 ? 1 : 0.5) denser.push_back(t);
  for (const auto& times : {Jittered(kFrames, 1, 3), dropped, denser})
    for (const double share : {0.35, 0.5, 0.65}) {
      const auto middle = static_cast<std::size_t>(share * static_cast<double>(times.size()));
      Shifted s = ShiftAt(times, [&](double t) {
        const double angle = 2 * std::numbers::pi * kCutoff * (t - times[middle]) / kFps;
        return Eigen::Vector2d(kAmplitude * std::cos(angle), 0);
      });
      std::vector<Matrix34d> P = s.P;
      ASSERT_TRUE(SolvePathProblem(s.wanted, OnTimes(s, times, kCutoff), P).usable);
      EXPECT_NEAR(ShiftOf(P[middle]) / kAmplitude, 0.5, 0.01) << times.size() << " " << share;
    }
}

TEST(HardCase, APathOfTimesWhoseJitterGoesToNothingIsThatOfEvenTimes) {
  constexpr int kFrames = 121;
  const auto shake = [](double t) { return Eigen::Vector2d(0.02 * std::sin(0.9 * t), 0.01 * std::cos(0.31 * t)); };
  Shifted even = Shift(kFrames, shake);
  std::vector<Matrix34d> P = even.P;
  ASSERT_TRUE(SolvePathProblem(even.wanted, OnTimes(even, WholeFrames(kFrames), 0.3), P).usable);
  for (double share = 1e-2; share >= 1e-15; share /= 10) {
    const std::vector<double> times = Jittered(kFrames, share, 9);
    Shifted jittered = ShiftAt(times, shake);
    std::vector<Matrix34d> Q = jittered.P;
    ASSERT_TRUE(SolvePathProblem(jittered.wanted, OnTimes(jittered, times, 0.3), Q).usable) << share;
    // The shake's own speed, 0.02 a frame, times what the times are off, which adds up over 120 frames; the solver
    // stops at 1e-7 of the cost.
    for (std::size_t t = 0; t < P.size(); ++t)
      EXPECT_NEAR(ShiftOf(Q[t]), ShiftOf(P[t]), 0.1 * share + 1e-8) << share << " " << t;
  }
}

}  // namespace
}  // namespace lumi
