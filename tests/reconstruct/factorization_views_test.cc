// The parts of the factorisation that place a frame or a point: units, windows, two views, resection, intersection.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/resection.h"
#include "reconstruct/factorization/seed.h"
#include "reconstruct/factorization/two_view.h"
#include "reconstruct/factorization/windows.h"
#include "true_model.h"

namespace lumi {
namespace {

using test::DeskPath;
using test::DeskPoints;
using test::kNoisePx;
using test::Noise;
using test::PlazaPath;
using test::PlazaPoints;
using test::See;
using test::SimulatedTracks;
using test::TrueModel;
using test::TrueSceneOf;

constexpr double kExact = 1e-9;  // noise-free, pixels

TEST(Normalise, EachFramesPointsHaveTheirCentroidAtZeroAndSizeRootTwo) {
  const SimulatedTracks s = See(DeskPath(5), DeskPoints(80), {});
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  std::vector<Eigen::Vector2d> mean(5, Eigen::Vector2d::Zero());
  std::vector<double> square(5, 0), n(5, 0);
  for (const auto& track : points.tracks)
    for (const Sight& x : track) {
      const auto f = static_cast<std::size_t>(x.frame);
      mean[f] += x.x;
      square[f] += x.x.squaredNorm();
      n[f] += 1;
    }
  for (std::size_t f = 0; f < 5; ++f) {
    EXPECT_LT((mean[f] / n[f]).norm(), kExact);
    EXPECT_NEAR(square[f] / n[f], 2, kExact);
  }
}

TEST(Normalise, DistortionIsTakenOut) {
  Camera bent = test::TrueCamera();
  bent.model = CameraModel::kRadial;
  bent.params = {560, 322.5, 238.5, -0.2, 0.05};
  const SimulatedTracks seen = See(DeskPath(3), DeskPoints(40), {}, bent);
  const ImagePoints points = Normalise(seen.tracks, bent);
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    for (const Sight& x : points.tracks[t]) {
      const auto f = static_cast<std::size_t>(x.frame);
      const Eigen::Vector3d q = seen.cam_from_world[f] * seen.x_in_world[t].head<3>();
      const Eigen::Vector2d straight = 560 * q.hnormalized() + Eigen::Vector2d(322.5, 238.5);
      EXPECT_LT((x.x * points.px_per_unit[f] + points.centre_px[f] - straight).norm(), 1e-6);
    }
}

TEST(Normalise, SightsThatAreNotNumbersAreLeftOut) {
  Tracks tracks;
  tracks.frames.resize(2);
  tracks.tracks.push_back({{{0, {1, 2}}, {1, {NAN, 3}}}, {}});
  tracks.tracks.push_back({{{0, {4, 6}}, {0, {4, 7}}, {1, {8, 9}}}, {}});
  const ImagePoints points = Normalise(tracks, std::nullopt);
  EXPECT_EQ(points.tracks[0].size(), 1U);
  EXPECT_EQ(points.tracks[1].size(), 2U);
}

TEST(Windows, EveryFrameIsInOneAndNeighboursOverlap) {
  const ImagePoints points = Normalise(See(PlazaPath(97), PlazaPoints(800), test::Tracked(0, 40)).tracks, std::nullopt);
  const auto windows = SplitIntoWindows(points, {});
  ASSERT_GT(windows.size(), 3U);
  EXPECT_EQ(windows.front().frames.front(), 0);
  EXPECT_EQ(windows.back().frames.back(), 96);
  for (std::size_t i = 1; i < windows.size(); ++i)
    EXPECT_LE(windows[i].frames.front(), windows[i - 1].frames.back() - 4);
}

TEST(Windows, FramesLeftOutAreInNoneButTheLastOneIs) {
  const ImagePoints points = Normalise(See(PlazaPath(97), PlazaPoints(400), {}).tracks, std::nullopt);
  WindowOptions options;
  options.stride = 5;
  options.length = 8;
  options.overlap = 4;
  std::vector<int> covered(97, 0);
  for (const FrameWindow& window : SplitIntoWindows(points, options)) {
    EXPECT_LE(window.frames.size(), 9U);
    EXPECT_TRUE(std::is_sorted(window.frames.begin(), window.frames.end()));
    for (const int f : window.frames) covered[static_cast<std::size_t>(f)] = 1;
  }
  for (int f = 0; f < 97; ++f) EXPECT_EQ(covered[static_cast<std::size_t>(f)], f % 5 == 0 || f == 96) << f;
}

TEST(Windows, UnorderedPhotosAreGroupedByWhatTheyShare) {
  // Every second photo shows one of two ends of the plaza; photos in the middle connect them.
  const SimulatedTracks s = test::InNoOrder(See(PlazaPath(30), PlazaPoints(400), {}));
  WindowOptions options;
  options.ordered = false;
  options.length = 10;
  options.overlap = 4;
  const auto windows = SplitIntoWindows(Normalise(s.tracks, std::nullopt), options);
  std::vector<int> covered(30, 0);
  for (std::size_t i = 0; i < windows.size(); ++i) {
    int known = 0;
    for (const int f : windows[i].frames) known += covered[static_cast<std::size_t>(f)]++ > 0;
    EXPECT_LE(windows[i].frames.size(), 10U);
    if (i > 0) {
      EXPECT_GE(known, 4);
    }
  }
  EXPECT_EQ(std::count(covered.begin(), covered.end(), 0), 0);
}

struct PairOfFrames {
  std::vector<Eigen::Vector2d> a, b;
  double unit_a, unit_b;
};
PairOfFrames TakePair(const ImagePoints& points, int i, int j) {
  PairOfFrames pair{
      {}, {}, points.px_per_unit[static_cast<std::size_t>(i)], points.px_per_unit[static_cast<std::size_t>(j)]};
  for (const auto& track : points.tracks) {
    const Sight *a = nullptr, *b = nullptr;
    for (const Sight& s : track) {
      if (s.frame == i) a = &s;
      if (s.frame == j) b = &s;
    }
    if (!a || !b) continue;
    pair.a.push_back(a->x);
    pair.b.push_back(b->x);
  }
  return pair;
}

TEST(TwoView, TheFundamentalMatrixIsFoundUnderFortyPercentOutliers) {
  Noise noise = test::Tracked(kNoisePx);
  noise.outliers = 0.225;  // of each sight: 40 % of the pairs
  const SimulatedTracks s = See(DeskPath(2, 20), DeskPoints(300), noise);
  const PairOfFrames pair = TakePair(Normalise(s.tracks, std::nullopt), 0, 1);
  const TwoView two = EstimateTwoView(pair.a, pair.b, pair.unit_a, pair.unit_b, {});
  ASSERT_EQ(two.kind, TwoViewKind::kGeneral);
  int wrong = 0, right = 0, good = 0;
  for (std::size_t t = 0; t < s.outlier.size(); ++t) {
    if (s.outlier[t].size() < 2) continue;
    const bool bad = s.outlier[t][0] || s.outlier[t][1];
    good += !bad;
    (bad ? wrong : right) += two.inlier[t];
  }
  EXPECT_GT(right, 0.97 * good);
  EXPECT_LT(wrong, 12);  // by chance within 2 px of their line: 1 to 3 % of 120
  EXPECT_NEAR(two.noise_px, kNoisePx, 0.1);
}

TEST(TwoView, OnePlaneAndItsParallaxAreEnough) {
  auto points = PlazaPoints(300);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (i % 5 != 0) points[i].y() = 2;  // the ground
  const auto path = PlazaPath(40);
  const SimulatedTracks s = See({path[10], path[25]}, points, test::Tracked(kNoisePx));
  const PairOfFrames pair = TakePair(Normalise(s.tracks, std::nullopt), 0, 1);
  const TwoView two = EstimateTwoView(pair.a, pair.b, pair.unit_a, pair.unit_b, {});
  EXPECT_EQ(two.kind, TwoViewKind::kGeneral);
  EXPECT_GT(two.inlier_count, 0.95 * static_cast<double>(pair.a.size()));
}

TEST(TwoView, CanonicalCameraHasItsFundamentalMatrix) {
  const SimulatedTracks s = See(DeskPath(2, 20), DeskPoints(100), {});
  const PairOfFrames pair = TakePair(Normalise(s.tracks, std::nullopt), 0, 1);
  const TwoView two = EstimateTwoView(pair.a, pair.b, pair.unit_a, pair.unit_b, {});
  const Matrix34d P = CanonicalCamera(two.F);
  const Eigen::Vector3d e = P.col(3);
  Eigen::Matrix3d cross;
  cross << 0, -e.z(), e.y(), e.z(), 0, -e.x(), -e.y(), e.x(), 0;
  const Eigen::Matrix3d F = (cross * P.leftCols<3>()).normalized();
  EXPECT_LT(std::min((F - two.F.normalized()).norm(), (F + two.F.normalized()).norm()), 1e-9);
}

TEST(Resection, ACameraIsFoundUnderFortyPercentOutliers) {
  Noise noise = test::Tracked(kNoisePx);
  noise.outliers = 0.4;
  const auto [s, points, truth] = TrueSceneOf(See(DeskPath(3), DeskPoints(200), noise));
  std::vector<Eigen::Vector4d> X;
  std::vector<Eigen::Vector2d> x;
  int good = 0;
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k)
      if (points.tracks[t][k].frame == 1) {
        X.push_back(truth.X[t]);
        x.push_back(points.tracks[t][k].x);
        good += !s.outlier[t][k];
      }
  const auto camera = Resect(X, x, points.px_per_unit[1], {});
  ASSERT_TRUE(camera);
  EXPECT_NEAR(camera->inlier_count, good, 3);
  EXPECT_NEAR(camera->rms_px, kNoisePx * std::sqrt(2.0), 0.1);
}

TEST(Resection, PointsThatAgreeWithNoCameraGiveNone) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> gauss;
  std::vector<Eigen::Vector4d> X;
  std::vector<Eigen::Vector2d> x;
  for (int i = 0; i < 60; ++i) {
    X.push_back(Eigen::Vector4d(gauss(random), gauss(random), gauss(random), gauss(random)).normalized());
    x.emplace_back(gauss(random), gauss(random));
  }
  ResectionOptions options;
  options.min_inliers = 20;
  EXPECT_FALSE(Resect(X, x, 200, options));
}

TEST(Intersection, APointAtInfinityIsAPointLikeAnyOther) {
  const Eigen::Vector4d direction(0.1, -0.05, 1, 0);
  auto [s, points, model] = TrueSceneOf(See(PlazaPath(8), {direction}, {}));
  const Eigen::Vector4d expected = model.X[0];
  model.solved[0] = 0;
  model.X[0].setZero();
  ASSERT_TRUE(IntersectTrack(points, model, 0, {}));
  EXPECT_LT(std::min((model.X[0] - expected).norm(), (model.X[0] + expected).norm()), 1e-8);
}

TEST(Intersection, OutliersAmongTheSightsAreNamed) {
  SimulatedTracks s = See(DeskPath(12), DeskPoints(20), test::Tracked(kNoisePx));
  for (auto& track : s.tracks.tracks)
    if (track.observations.size() > 8)
      for (const std::size_t k : {1U, 5U, 7U}) track.observations[k].x_px += Eigen::Vector2d(25, -31);
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  ProjectiveModel model = TrueModel(s, points);
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    if (points.tracks[t].size() <= 8) continue;
    model.solved[t] = 0;
    ASSERT_TRUE(IntersectTrack(points, model, t, {}));
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k)
      EXPECT_EQ(model.inlier[t][k] != 0, k != 1 && k != 5 && k != 7);
  }
}

}  // namespace
}  // namespace lumi
