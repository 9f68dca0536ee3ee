// Labels of pairs of simulated photos: a camera that moves, that only turns, that sees a plane alone, and the way from
// one to the other; stamps on photos; matches that mean nothing.
#include "reconstruct/pair_geometry.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace lumi {
namespace {

struct Pair {
  std::vector<Eigen::Vector2d> a, b;
  std::vector<std::pair<int, int>> matches;
  Camera camera_a = Camera::Pinhole(640, 480, 600, 600, 320, 240);
  Camera camera_b = camera_a;
};

struct Setting {
  Eigen::Vector3d centre = Eigen::Vector3d(0.4, 0.05, 0.1);  // of the second camera; points are 3 to 6 away
  double turn_rad = 0.08;
  double relief = 1;  // of the points' depth, of 1.5 to both sides
  double noise_px = 0.3;
  int points = 300;
  double outliers = 0.25;  // share of all matches
};

Pair Simulate(const Setting& s, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, s.noise_px);
  std::uniform_real_distribution<double> part(0, 1);
  Pair pair;
  const Eigen::AngleAxisd turn(s.turn_rad, Eigen::Vector3d(0.2, 1, 0.1).normalized());
  const auto add = [&](const Eigen::Vector2d& x, const Eigen::Vector2d& y) {
    pair.matches.emplace_back(static_cast<int>(pair.a.size()), static_cast<int>(pair.b.size()));
    pair.a.push_back(x);
    pair.b.push_back(y);
  };
  while (static_cast<int>(pair.a.size()) < s.points) {
    const Eigen::Vector2d x(640 * part(random), 480 * part(random));
    // A slanted plane, and what stands before and behind it.
    const double depth = 4.5 + (x.x() - 320) / 640 + s.relief * 3 * (part(random) - 0.5);
    const Eigen::Vector3d X = depth * pair.camera_a.Normalized(x)->homogeneous();
    const auto y = pair.camera_b.Project(turn * (X - s.centre));
    if (!y || y->x() < 0 || y->y() < 0 || y->x() > 640 || y->y() > 480) continue;
    add(x + Eigen::Vector2d(noise(random), noise(random)), *y + Eigen::Vector2d(noise(random), noise(random)));
  }
  const auto wrong = static_cast<int>(s.points * s.outliers / (1 - s.outliers));
  for (int i = 0; i < wrong; ++i)
    add({640 * part(random), 480 * part(random)}, {640 * part(random), 480 * part(random)});
  return pair;
}

PairGeometry Estimate(const Pair& p, bool focal_is_known) {
  return EstimatePairGeometry({p.a, p.camera_a, focal_is_known}, {p.b, p.camera_b, focal_is_known}, p.matches, {});
}

// Of 300 true matches nearly all, and of 100 wrong ones those that lie near their line by chance: 2 * 4 px of 480.
void ExpectInliers(const PairGeometry& g, int most_wrong) {
  int right = 0, wrong = 0;
  for (const auto& [i, j] : g.inliers) (i < 300 ? right : wrong) += 1;
  EXPECT_GE(right, 297);
  EXPECT_LE(wrong, most_wrong);
}

TEST(PairGeometry, AMovingCameraBeforeThings) {
  const Pair pair = Simulate({});
  const PairGeometry unknown = Estimate(pair, false), known = Estimate(pair, true);
  EXPECT_EQ(unknown.label, PairLabel::kUncalibrated);
  EXPECT_EQ(known.label, PairLabel::kCalibrated);
  ExpectInliers(unknown, 10);
  ExpectInliers(known, 10);
  EXPECT_GT(known.E.norm(), 0.9);
  EXPECT_EQ(unknown.E.norm(), 0);
}

// F is the true one, whichever matches are drawn first: points without noise lie on its lines to less than the
// noise of those that it was made of.
TEST(PairGeometry, ItsLinesPassThroughWhereThePointsAre) {
  const Pair exact = Simulate({.noise_px = 0, .outliers = 0});
  for (unsigned seed = 1; seed <= 12; ++seed)
    for (const bool known : {false, true}) {
      const PairGeometry g = Estimate(Simulate({}, seed), known);
      double squares = 0;
      for (std::size_t i = 0; i < exact.a.size(); ++i) {
        const Eigen::Vector3d line = g.F * exact.a[i].homogeneous();
        squares += std::pow(exact.b[i].homogeneous().dot(line) / line.head<2>().norm(), 2);
      }
      EXPECT_LT(std::sqrt(squares / static_cast<double>(exact.a.size())), Setting().noise_px) << seed;
    }
}

TEST(PairGeometry, WrongFocalLengthsAreNotBelieved) {
  Pair pair = Simulate({.centre = {0.8, 0.1, 0.6}, .turn_rad = 0.3});
  pair.camera_a.params[0] = pair.camera_a.params[1] = 1800;
  EXPECT_EQ(Estimate(pair, true).label, PairLabel::kUncalibrated);
}

TEST(PairGeometry, APlaneAndACameraThatTurns) {
  const Pair plane = Simulate({.relief = 0}), turn = Simulate({.centre = {0, 0, 0}});
  EXPECT_EQ(Estimate(plane, false).label, PairLabel::kPlanarOrPanoramic);
  EXPECT_EQ(Estimate(plane, true).label, PairLabel::kPlanar);
  EXPECT_EQ(Estimate(turn, false).label, PairLabel::kPlanarOrPanoramic);
  EXPECT_EQ(Estimate(turn, true).label, PairLabel::kPanoramic);
  for (const Pair* pair : {&plane, &turn})
    for (const bool known : {false, true}) ExpectInliers(Estimate(*pair, known), 10);
}

// One camera zooms and nothing moves: a homography, and with its focal lengths known a camera that only turned.
TEST(PairGeometry, ZoomWithoutMotion) {
  Pair pair = Simulate({.centre = {0, 0, 0}, .turn_rad = 0.02});
  for (Eigen::Vector2d& x : pair.b) x = Eigen::Vector2d(320, 240) + 1.5 * (x - Eigen::Vector2d(320, 240));
  pair.camera_b = Camera::Pinhole(640, 480, 900, 900, 320, 240);
  EXPECT_EQ(Estimate(pair, true).label, PairLabel::kPanoramic);
  EXPECT_EQ(Estimate(pair, false).label, PairLabel::kPlanarOrPanoramic);
}

// Photos of two sizes, one of them portrait.
TEST(PairGeometry, PortraitAmongLandscape) {
  Pair pair = Simulate({});
  // Turned by a quarter: (x, y) -> (480 - y, x).
  for (Eigen::Vector2d& x : pair.b) x = Eigen::Vector2d(480 - x.y(), x.x());
  pair.camera_b = Camera::Pinhole(480, 640, 600, 600, 240, 320);
  EXPECT_EQ(Estimate(pair, true).label, PairLabel::kCalibrated);
  EXPECT_EQ(Estimate(pair, false).label, PairLabel::kUncalibrated);
}

TEST(PairGeometry, AStampOnThePhotosIsAWatermark) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> part(0, 1);
  Pair pair;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d x(20 + 600 * part(random), 450 + 20 * part(random));  // along the lower border
    pair.matches.emplace_back(i, i);
    pair.a.push_back(x);
    pair.b.push_back(x + Eigen::Vector2d(0.2 * part(random), 0.2 * part(random)));
  }
  EXPECT_EQ(Estimate(pair, false).label, PairLabel::kWatermark);
  // The same over the whole photo is two photos from one place.
  for (std::size_t i = 0; i < pair.a.size(); ++i) {
    const Eigen::Vector2d x(640 * part(random), 480 * part(random));
    pair.a[i] = pair.b[i] = x;
  }
  EXPECT_EQ(Estimate(pair, false).label, PairLabel::kPlanarOrPanoramic);
}

TEST(PairGeometry, MatchesThatMeanNothing) {
  EXPECT_EQ(Estimate(Simulate({.points = 0, .outliers = 0}), false).label, PairLabel::kDegenerate);
  EXPECT_EQ(Estimate(Simulate({.points = 14, .outliers = 0}), true).label, PairLabel::kDegenerate);
  Pair random = Simulate({.points = 40, .outliers = 0.75});
  random.a.erase(random.a.begin(), random.a.begin() + 40);
  random.b.erase(random.b.begin(), random.b.begin() + 40);
  random.matches.resize(random.a.size());
  for (const bool known : {false, true}) {
    const PairGeometry g = Estimate(random, known);
    // Chance gives a line to some of 120; hardly more than COLMAP's bound.
    EXPECT_LT(g.inliers.size(), 40U);
  }
}

TEST(PairGeometry, SameMatchesSameGeometry) {
  const Pair pair = Simulate({});
  const PairGeometry one = Estimate(pair, true), again = Estimate(pair, true);
  EXPECT_EQ(one.F, again.F);
  EXPECT_EQ(one.E, again.E);
  EXPECT_EQ(one.H, again.H);
  EXPECT_EQ(one.inliers, again.inliers);
}

void ExpectSound(const PairGeometry& g, double step) {
  for (const Eigen::Matrix3d& m : {g.F, g.E, g.H}) EXPECT_TRUE(m.allFinite()) << step;
  EXPECT_GE(g.inliers.size(), 297U) << step;
}

// The way to the next kind in steps, without noise and with it: every true match stays an inlier, nothing is not a
// number, and from where on the step is below the error in pixels, the label is the neighbour's.
TEST(HardCasePairGeometry, BaselinesTowardsNothing) {
  for (const double noise_px : {0.0, 0.3})
    for (int e = 2; e <= 15; ++e) {
      const double step = std::pow(10.0, -e);
      const Pair pair = Simulate({.centre = step * Eigen::Vector3d(1, 0.2, 0.1), .noise_px = noise_px});
      const PairGeometry known = Estimate(pair, true), unknown = Estimate(pair, false);
      ExpectSound(known, step);
      ExpectSound(unknown, step);
      // 600 px / 3 * step is the parallax: 2 px at 1e-2, less than 4 px of error.
      EXPECT_EQ(known.label, PairLabel::kPanoramic) << step << " " << Name(known.label);
      EXPECT_EQ(unknown.label, PairLabel::kPlanarOrPanoramic) << step << " " << Name(unknown.label);
    }
}

TEST(HardCasePairGeometry, ThingsTowardsAPlane) {
  for (const double noise_px : {0.0, 0.3})
    for (int e = 2; e <= 15; ++e) {
      const double relief = std::pow(10.0, -e);
      const Pair pair = Simulate({.relief = relief, .noise_px = noise_px});
      const PairGeometry known = Estimate(pair, true), unknown = Estimate(pair, false);
      ExpectSound(known, relief);
      ExpectSound(unknown, relief);
      EXPECT_EQ(known.label, PairLabel::kPlanar) << relief << " " << Name(known.label);
      EXPECT_EQ(unknown.label, PairLabel::kPlanarOrPanoramic) << relief << " " << Name(unknown.label);
    }
}

}  // namespace
}  // namespace lumi
