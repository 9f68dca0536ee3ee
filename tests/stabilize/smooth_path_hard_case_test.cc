// What a smooth path keeps and takes away, in one window and in several.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/geometry/angle.h"
#include "stabilize/jitter.h"
#include "stabilize/path_before.h"
#include "tests/stabilize/stabilized_walks.h"

namespace lumi {
namespace {

using namespace test;

TEST(HardCase, SmoothKeepsWhatWasMeantAndTakesTheShakeByItsTransferFunction) {
  // A sine of the hand in yaw: the amplitude that is left against 1 / (1 + (f / f_c)^4).
  for (const double hz : {0.05, 0.3, 2.0}) {
    const int frames = 600;
    Hand hand = kStill;
    hand.turn_rad = 0.015;
    hand.only_hz = hz;
    const Walk walk = Turning(
        frames, [](double) { return Eigen::Matrix3d::Identity(); }, hand);
    const auto P = Stabilized(walk, With(MotionModel::kSmooth));
    // Of the whole picture: its keystone passes up to a higher frequency, which the middle moves by as well.
    double in = 0, out = 0;
    for (std::size_t t = 100; t < 500; ++t) {
      double filmed = 0, steady = 0;
      int points = 0;
      for (std::size_t j = 0; j < walk.X.size(); ++j) {
        if (!walk.seen[t][j]) continue;
        const double meant = Eigen::Vector3d(walk.ideal[t] * walk.X[j]).hnormalized().x();
        filmed += Eigen::Vector3d(walk.shaky[t] * walk.X[j]).hnormalized().x() - meant;
        steady += Eigen::Vector3d(P[t] * walk.X[j]).hnormalized().x() - meant;
        ++points;
      }
      in = std::max(in, std::abs(filmed) / points);
      out = std::max(out, std::abs(steady) / points);
    }
    const double expected = 1 / (1 + std::pow(hz / 0.3, 4));
    EXPECT_NEAR(out / in, expected, hz > 1 ? 5e-3 : 0.03)
        << hz;  // a homography's perspective is not linear: 0.03 px of 8
  }
}

TEST(HardCase, WhatIsNoSimilarityOfTheFilmPassesUpToAHigherFrequency) {
  // The picture breathes, lower and less wider, so that no scale is nearer to it than 1: at a frequency between the two
  // cutoffs.
  constexpr double kHz = 0.4, kStretch = 0.02, kWider = double(kHeightPx * kHeightPx) / (kWidthPx * kWidthPx);
  constexpr int kFrames = 600;
  const Walk walk = Turning(
      kFrames,
      [](double u) {
        const double s = kStretch * std::sin(2 * M_PI * kHz * u * (kFrames - 1) / kFps);
        Eigen::Matrix3d H;
        H << 1 + kWider * s, 0, -320 * kWider * s, 0, 1 - s, 180 * s, 0, 0, 1;
        return H;
      },
      kStill);
  const StabilizeOptions options = With(MotionModel::kSmooth);
  const auto P = Stabilized(walk, options);
  double out = 0;
  for (std::size_t t = 100; t < 500; ++t) {
    const auto y = [&](double slope) {
      return Eigen::Vector3d(P[t] * Eigen::Vector4d(0, slope, 1, 1)).hnormalized().y();
    };
    out = std::max(out, std::abs((y(0.2) - y(-0.2)) / (0.4 * kFocalPx) - 1));
  }
  const double weight = 1 + std::pow(options.similar_hz / options.cutoff_hz, 4);
  EXPECT_NEAR(out / kStretch, 1 / (1 + std::pow(kHz / options.cutoff_hz, 4) / weight), 0.03);
}

TEST(HardCase, ASmoothPathIsOneCamerasPath) {
  // Rigid by its form: where all points are put is what one matrix does, whose epipolar geometry to the film is exact.
  // What a low-pass of each trajectory would be instead differs by parallax of the shake.
  const Walk walk = Wander(150);
  EXPECT_LT(JitterPx(walk, Stabilized(walk, With(MotionModel::kSmooth))), kJitterPx);
  EXPECT_LT(JitterPx(walk, Stabilized(walk,
                                      [] {
                                        StabilizeOptions o = With(MotionModel::kSmooth);
                                        o.min_scale = 0.8;
                                        return o;
                                      }())),
            kJitterPx);
}

// A floor before a wall: one depth a direction, at which a camera that wanders ahead and zooms back shows all points
// nearly where they were. Its pictures would be made of photos from elsewhere.
TEST(HardCase, OverAFloorBeforeAWallTheCentreStaysNearTheFilms) {
  std::vector<Eigen::Vector4d> X = PointsIn({-6, -4, 1}, {6, 1.4, 9}, 900, 31);
  for (std::size_t i = 0; i < X.size(); ++i) (i % 2 == 0 ? X[i].y() = 1.4 : X[i].z() = 9);
  const Hand hand{0.014, 0.012, 0, 0, 4};
  const Walk walk = Film(
      90,
      [](double u) {
        return Pose{LookAt({0, 0, 2.5 * u}, {0, 0, 2.5 * u + 1}, -Eigen::Vector3d::UnitY())};
      },
      X, hand);
  Telling telling;  // as the film of such a place is told: cheirality leaves the plane at infinity far from where it is
  telling.plane_tilt = {0.002, -0.004, 0.05};
  const auto P = Stabilized(walk, With(MotionModel::kSmooth), telling);
  double apart = 0;
  for (std::size_t t = 0; t < P.size(); ++t)
    apart = std::max(apart,
                     (CentreOfProjection(P[t]).hnormalized() - CentreOfProjection(walk.ideal[t]).hnormalized()).norm());
  EXPECT_LT(apart, 0.06);  // measured 0.024, of the way's 2.5 m, on which the hand moves by up to 0.04
  EXPECT_LT(JitterPx(walk, P), kJitterPx);
}

// Windows in projective frames of their own, each with a wrong guess at the plane at infinity, against one window that
// knows all.
TEST(HardCase, WindowsInFramesOfTheirOwnJoinAsIfTheyWereOne) {
  constexpr int kWindow = 200, kOverlap = 80, kTotal = 2 * kWindow - kOverlap;
  constexpr double kTimesAlone = 1.3;  // shake at the seam, of what one window leaves there
  constexpr double kSlowPx = 0.1;      // where one window leaves none: two straight lines are led over in 2.3 s
  constexpr double kStepPx = 0.05;     // of any point, third difference in time
  constexpr double kApartPx = 3, kLinesApartPx = 5;  // of where the one window puts it, which knew what comes; a
                                                     // straight line of fewer frames is another one
  struct Case {
    MotionModel model;
    Walk walk;
  };
  const Hand hand{0.014, 0.012, 0, 0, 2};
  for (const Case& c : {Case{MotionModel::kSmooth, Wander(kTotal)}, Case{MotionModel::kSmooth, Forward(kTotal, hand)},
                        Case{MotionModel::kLinear, Sideways(kTotal)}, Case{MotionModel::kVertigo, Vertigo(kTotal)},
                        Case{MotionModel::kCircular, Around(kTotal, 60)}}) {
    SCOPED_TRACE(Name(c.model));
    StabilizeOptions options = c.model == MotionModel::kVertigo ? WithObject(c.walk) : With(c.model);
    Telling telling;
    telling.plane_tilt = {0.004, -0.003, 0.01};
    const auto alone = Stabilized(c.walk, options, telling);
    const InWindows joined = StabilizeInWindows(c.walk, options, kWindow, kOverlap, telling);
    ASSERT_EQ(joined.P.size(), static_cast<std::size_t>(kTotal));
    ASSERT_EQ(joined.seams.size(), 1U);
    EXPECT_EQ(joined.reports.back().joined_frames, kOverlap);
    const int seam = joined.seams[0];
    const double shake = JitterPx(c.walk, joined.P, seam - 30, seam + kOverlap),
                 shake_alone = JitterPx(c.walk, alone, seam - 30, seam + kOverlap);
    EXPECT_LT(shake, std::max(kTimesAlone * shake_alone, kSlowPx)) << "alone " << shake_alone;
    double step = 0, apart = 0;
    for (int t = seam - 3; t < seam + kOverlap; ++t)
      for (std::size_t j = 0; j < c.walk.X.size(); ++j) {
        bool seen = true;
        for (int d = -2; d <= 1; ++d) seen = seen && c.walk.seen[static_cast<std::size_t>(t + d)][j];
        if (!seen) continue;
        const auto x = [&](const std::vector<Matrix34d>& P, int at) {
          return Eigen::Vector2d(Eigen::Vector3d(P[static_cast<std::size_t>(at)] * c.walk.X[j]).hnormalized());
        };
        step = std::max(step,
                        (x(joined.P, t - 2) - 3 * x(joined.P, t - 1) + 3 * x(joined.P, t) - x(joined.P, t + 1)).norm());
        apart = std::max(apart, (x(joined.P, t) - x(alone, t)).norm());
      }
    EXPECT_LT(step, kStepPx);
    EXPECT_LT(apart, c.model == MotionModel::kSmooth ? kApartPx : kLinesApartPx);
    if (c.model != MotionModel::kVertigo) continue;
    const auto sizes = ObjectSizes(c.walk, joined.P);
    EXPECT_LT(*std::max_element(sizes.begin(), sizes.end()) / *std::min_element(sizes.begin(), sizes.end()) - 1,
              0.01);  // the later window finds it again
  }
}

TEST(HardCase, APathThatHasNoFrameInCommonIsRefusedByName) {
  const Walk walk = Sideways(60);
  StabilizeOptions options = With(MotionModel::kSmooth);
  options.anchors = 20;
  StabilizeReport report;
  options.before = Stabilize(ReadFilmedScene(ToldFrom(WindowOf(walk, 0, 30), {}, 0), std::nullopt), options, report,
                             SilentProgress());
  EXPECT_EQ(report.last_shown, 30 - 20 + SeamOf(20, options.half_window).begin - 1);
  EXPECT_NE(Refused([&] {
              Stabilize(ReadFilmedScene(ToldFrom(WindowOf(walk, 30, 30), {}, 30), std::nullopt), options, report,
                        SilentProgress());
            }).find("anchors"),
            std::string::npos);
}

// A steady turn bends the images of points more at the picture's border than in its middle, and a walk those of near
// points: that is what was meant, and no low-pass may flatten it.
TEST(HardCase, ASteadyTurnAndASteadyWalkPassUnchanged) {
  for (const Walk& walk : {Turning(
                               120, [](double u) { return Pan(0.7 * (u - 0.5)); }, kStill),
                           Forward(120, kStill), Sideways(120, kStill), Around(120, 60, kStill)})
    EXPECT_LT(LargestDistancePx(walk, Stabilized(walk, With(MotionModel::kSmooth)), walk.ideal), 0.1);
}

// The frames of a walk that are kept, at the times at which they were taken.
Walk Kept(const Walk& walk, const std::vector<std::size_t>& frames) {
  Walk kept = walk;
  kept.ideal.clear(), kept.shaky.clear(), kept.seen.clear();
  for (const std::size_t t : frames) {
    kept.ideal.push_back(walk.ideal[t]);
    kept.shaky.push_back(walk.shaky[t]);
    kept.seen.push_back(walk.seen[t]);
  }
  return kept;
}

TEST(HardCase, FramesThatWereDroppedAreGapsInTimeAndLeaveTheRestOfThePathAsItIs) {
  constexpr int kFrames = 300;
  const Walk walk = Wander(kFrames);
  const auto whole = Stabilized(walk, With(MotionModel::kSmooth));
  std::mt19937 random(4);
  for (const int every : {300, 3}) {  // one of 300; one of three, at random
    std::vector<std::size_t> frames;
    for (std::size_t t = 0; t < kFrames; ++t)
      if (every == 300 ? t != 151 : random() % 3 != 0) frames.push_back(t);
    const Walk kept = Kept(walk, frames);
    Scene told = Told(kept);
    for (std::size_t k = 0; k < frames.size(); ++k) told.views[k].time_s = static_cast<double>(frames[k]) / kFps;
    StabilizeReport report;
    const auto path = InWalk(
        Stabilize(ReadFilmedScene(told, std::nullopt), With(MotionModel::kSmooth), report, SilentProgress()), {});
    std::vector<Matrix34d> same;
    for (const std::size_t t : frames) same.push_back(whole[t]);
    // Where the frames are taken for evenly spaced, a speed jumps at each gap, and the path bends there: by a pixel and
    // more for one frame, by 20 for a hundred.
    EXPECT_LT(LargestDistancePx(kept, path, same), every == 300 ? 0.25 : 6) << every;
    EXPECT_GT(report.shake_before_px, 3) << every;  // windows of two seconds hold gaps, and are measured
    EXPECT_LT(report.shake_after_px, 0.3) << every;
  }
}

}  // namespace
}  // namespace lumi
