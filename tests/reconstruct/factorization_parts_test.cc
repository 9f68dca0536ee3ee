// The parts of the factorisation, each on its own.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "factorization_scenes.h"
#include "reconstruct/factorization/cull.h"
#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/linear_program.h"
#include "reconstruct/factorization/merge.h"
#include "reconstruct/factorization/metric_bundle.h"
#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/projective_bundle.h"
#include "reconstruct/factorization/quasi_affine.h"
#include "reconstruct/factorization/rank4_factorization.h"
#include "reconstruct/factorization/resection.h"
#include "reconstruct/factorization/seed.h"
#include "reconstruct/factorization/two_view.h"
#include "reconstruct/factorization/upgrade.h"
#include "reconstruct/factorization/window_upgrade.h"
#include "reconstruct/factorization/windows.h"
#include "scene/geometry/similarity3.h"

namespace lumi {
namespace {

using test::DeskPath;
using test::DeskPoints;
using test::HallwayPath;
using test::HallwayPoints;
using test::Noise;
using test::PlazaPath;
using test::PlazaPoints;
using test::See;
using test::SimulatedTracks;

constexpr double kExact = 1e-9;  // noise-free, pixels
constexpr double kNoisePx = 0.3;

// The truth as a projective model, moved by a frame change far from the identity.
ProjectiveModel TrueModel(const SimulatedTracks& s, const ImagePoints& points) {
  ProjectiveModel model(points);
  for (std::size_t f = 0; f < model.P.size(); ++f) {
    model.P[f] = (NormalisedFromPixels(points, f) * ProjectionMatrix(s.camera.K(), s.cam_from_world[f])).normalized();
    model.placed[f] = 1;
  }
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    model.X[t] = s.x_in_world[t].normalized();
    model.solved[t] = 1;
  }
  Eigen::Matrix4d H;
  H << 1, 0.2, -0.3, 0.5, 0.1, 0.8, 0.4, -0.2, -0.3, 0.2, 1.1, 0.3, 0.25, -0.15, 0.3, 0.9;
  ChangeFrame(model, H);
  return model;
}

struct TrueScene {
  SimulatedTracks s;
  ImagePoints points;
  ProjectiveModel model;
};
TrueScene TrueSceneOf(const SimulatedTracks& s) {
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  return {s, points, TrueModel(s, points)};
}

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

// Complete tracks as a measurement matrix.
MeasurementMatrix Complete(const ImagePoints& points) {
  const auto frames = static_cast<Eigen::Index>(points.FrameCount());
  MeasurementMatrix m;
  std::vector<std::size_t> whole;
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    if (points.tracks[t].size() == points.FrameCount()) whole.push_back(t);
  m.x.resize(2 * frames, static_cast<Eigen::Index>(whole.size()));
  m.seen.setConstant(frames, static_cast<Eigen::Index>(whole.size()), true);
  for (std::size_t j = 0; j < whole.size(); ++j)
    for (const Sight& s : points.tracks[whole[j]]) m.x.block<2, 1>(2 * s.frame, static_cast<Eigen::Index>(j)) = s.x;
  return m;
}

Eigen::MatrixXd StackedCameras(const ProjectiveModel& model) {
  Eigen::MatrixXd rows(3 * static_cast<Eigen::Index>(model.P.size()), 4);
  for (std::size_t f = 0; f < model.P.size(); ++f) rows.middleRows<3>(3 * static_cast<Eigen::Index>(f)) = model.P[f];
  return rows;
}

TEST(Factorise, DepthsFromNothingMoveTowardsRankFour) {
  const ImagePoints points = Normalise(See(DeskPath(12), DeskPoints(150), {}).tracks, std::nullopt);
  FactoriseOptions options;
  options.max_iterations = 200;
  options.tolerance = 1e-6;
  const Factorisation result = Factorise(Complete(points), {}, options);
  ASSERT_TRUE(result.usable);
  EXPECT_LT(result.rms, 1e-3 * result.start_rms);
  EXPECT_GT(result.gap, 1e4);
  EXPECT_LT((result.P.transpose() * result.P - Eigen::Matrix4d::Identity()).norm(), 1e-12);
}

TEST(Factorise, TheGapIsTheSignalOverTheNoise) {
  double last = 1e300;
  for (const double sigma : {0.01, 0.1, 1.0}) {
    const auto [s, points, truth] = TrueSceneOf(See(DeskPath(12), DeskPoints(150), test::Tracked(sigma)));
    const Factorisation result = Factorise(Complete(points), StackedCameras(truth), {});
    EXPECT_LT(result.gap, last / 5);
    EXPECT_LE(result.rms, result.start_rms);
    EXPECT_GT(result.depths.minCoeff() * result.depths.maxCoeff() + 1, 0);
    last = result.gap;
  }
}

TEST(Factorise, MissingEntriesAreFilledAndDoNotCountForTheGap) {
  Noise noise;
  noise.sigma_px = kNoisePx;
  const SimulatedTracks s = See(DeskPath(12), DeskPoints(150), noise);
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  const ProjectiveModel truth = TrueModel(s, points);
  std::mt19937_64 random(4);
  std::normal_distribution<double> gauss(0, 2e-3);
  Eigen::MatrixXd start(36, 4);
  for (Eigen::Index f = 0; f < 12; ++f) start.middleRows<3>(3 * f) = truth.P[static_cast<std::size_t>(f)];
  for (Eigen::Index i = 0; i < start.size(); ++i) start.data()[i] += gauss(random);
  MeasurementMatrix m = Complete(points);
  const Factorisation complete = Factorise(m, start, {});
  for (Eigen::Index p = 0; p < m.seen.cols(); ++p)
    for (Eigen::Index f = 0; f < 12; ++f)
      if (p % 3 > 0 && random() % 2) {
        m.seen(f, p) = false;
        m.x.block<2, 1>(2 * f, p).setZero();
      }
  const Factorisation result = Factorise(m, start, {});
  ASSERT_TRUE(result.usable);
  EXPECT_LT(result.rms, 0.5 * result.start_rms);
  EXPECT_NEAR(result.gap, complete.gap, 0.3 * complete.gap);
}

TEST(Factorise, APlaneHasRankThree) {
  auto flat = DeskPoints(150);
  for (auto& x : flat) x.y() = 0;
  const auto [s, points, truth] = TrueSceneOf(See(DeskPath(12), flat, {}));
  EXPECT_GT(Factorise(Complete(points), StackedCameras(truth), {}).rank3_gap, 1e6);
}

TEST(ProjectiveBundle, BringsADisturbedModelBack) {
  auto [s, points, model] = TrueSceneOf(See(DeskPath(8), DeskPoints(60), {}));
  std::mt19937_64 random(5);
  std::normal_distribution<double> gauss(0, 2e-3);
  for (auto& P : model.P)
    for (int i = 0; i < 12; ++i) P.data()[i] += gauss(random);
  for (auto& X : model.X)
    for (int i = 0; i < 4; ++i) X[i] += gauss(random);
  const double before = RmsPx(points, model);
  EXPECT_GT(before, 0.5);
  BundleOptions options;
  options.loss = BundleOptions::Loss::kNone;
  options.max_iterations = 60;
  const BundleSummary summary = AdjustProjective(points, model, options);
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(RmsPx(points, model), 1e-4 * before);
  for (const auto& P : model.P) EXPECT_NEAR(P.norm(), 1, 1e-12);
}

TEST(ProjectiveBundle, OutliersPullLittleUnderARobustLoss) {
  SimulatedTracks s = See(DeskPath(8), DeskPoints(60), {});
  for (std::size_t t = 0; t < s.tracks.tracks.size(); t += 6)
    s.tracks.tracks[t].observations[0].x_px += Eigen::Vector2d(15, 9);
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  const auto median = [&](BundleOptions::Loss loss) {
    ProjectiveModel model = TrueModel(s, points);
    BundleOptions options;
    options.loss = loss;
    AdjustProjective(points, model, options);
    std::vector<double> errors = InlierErrorsPx(points, model);
    std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    return errors[errors.size() / 2];
  };
  EXPECT_LT(median(BundleOptions::Loss::kCauchy), 0.1 * median(BundleOptions::Loss::kNone));
}

TEST(MetricBundle, FindsTheFocalLengthAndThePoses) {
  const SimulatedTracks s = See(DeskPath(8), DeskPoints(80), {});
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  const ProjectiveModel used(TrueModel(s, points));
  MetricModel metric;
  metric.intrinsics_px << 590, 590, 322.5, 238.5;
  metric.cam_from_world = s.cam_from_world;
  metric.X = s.x_in_world;
  std::mt19937_64 random(6);
  std::normal_distribution<double> gauss(0, 3e-3);
  for (auto& pose : metric.cam_from_world) {
    pose.translation += Eigen::Vector3d(gauss(random), gauss(random), gauss(random));
    pose.rotation = (Eigen::AngleAxisd(gauss(random), Eigen::Vector3d::UnitY()) * pose.rotation).normalized();
  }
  BundleOptions options;
  options.loss = BundleOptions::Loss::kNone;
  options.max_iterations = 100;
  options.tolerance = 1e-12;
  const BundleSummary summary = AdjustMetric(points, used, metric, FreeIntrinsics::kFocalAndCentre, options);
  EXPECT_TRUE(summary.usable);
  EXPECT_LT(summary.rms_px, 1e-3);
  EXPECT_NEAR(metric.intrinsics_px[0], 560, 0.1);
  EXPECT_NEAR(metric.intrinsics_px[3], 238.5, 0.1);
}

// Each cut leaves two points for one; neighbours are held by tracks that are cut elsewhere.
TEST(MetricBundle, CutTracksStillTieEachCameraToItsNeighbours) {
  Noise noise;
  noise.max_track_frames = 12;
  const SimulatedTracks s = See(PlazaPath(30), PlazaPoints(300), noise);
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  const ProjectiveModel used(TrueModel(s, points));
  MetricModel metric;
  metric.intrinsics_px << 560, 560, 322.5, 238.5;
  metric.cam_from_world = s.cam_from_world;
  metric.X = s.x_in_world;
  std::mt19937_64 random(6);
  std::normal_distribution<double> gauss(0, 3e-3);
  for (auto& pose : metric.cam_from_world)
    pose.translation += Eigen::Vector3d(gauss(random), gauss(random), gauss(random));
  BundleOptions options;
  options.loss = BundleOptions::Loss::kNone;
  options.max_iterations = 100;
  options.tolerance = 1e-12;
  options.max_span = 5;
  int cut = 0;
  for (std::size_t t = 0; t < points.tracks.size(); ++t) cut += CutTrack(points, used, t, options).count > 1;
  EXPECT_GT(cut, 100);
  EXPECT_TRUE(AdjustMetric(points, used, metric, FreeIntrinsics::kNone, options).usable);
  EXPECT_LT(ComparePoses(metric.cam_from_world, s.cam_from_world).centre_max_percent, 1e-3);
  options.whole.assign(points.tracks.size(), 1);
  for (std::size_t t = 0; t < points.tracks.size(); ++t) EXPECT_EQ(CutTrack(points, used, t, options).count, 1);
}

TEST(Cull, TheLimitFollowsTheNoiseAndOutliersAreFound) {
  Noise noise = test::Tracked(0.8);
  noise.outliers = 0.1;
  auto [s, points, model] = TrueSceneOf(See(DeskPath(15), DeskPoints(100), noise));
  const CullResult result = Cull(points, model, {});
  EXPECT_NEAR(result.sigma_px, 0.8, 0.25);  // the truth's errors, taken for a fit's: a little too large
  int wrong = 0, lost = 0;
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      wrong += model.inlier[t][k] && s.outlier[t][k];
      lost += !model.inlier[t][k] && !s.outlier[t][k];
    }
  EXPECT_LE(wrong, 3);
  EXPECT_LE(lost, 8);
}

TEST(Merge, TwoFramesOfReferenceBecomeOneExactly) {
  const auto [s, points, truth] = TrueSceneOf(See(DeskPath(16), DeskPoints(150), {}));
  const FrameWindow window = MakeWindow(points, {6, 7, 8, 9, 10, 11, 12, 13, 14, 15});
  ProjectiveModel whole = truth, part(Extract(points, window));
  for (std::size_t i = 0; i < window.frames.size(); ++i) {
    const auto f = static_cast<std::size_t>(window.frames[i]);
    part.P[i] = truth.P[f];
    part.placed[i] = 1;
    if (f > 9) whole.placed[f] = 0;
  }
  for (std::size_t i = 0; i < window.tracks.size(); ++i) {
    part.X[i] = truth.X[static_cast<std::size_t>(window.tracks[i])];
    part.solved[i] = 1;
  }
  Eigen::Matrix4d other = Eigen::Matrix4d::Identity();
  other << 0.2, 1, 0.1, 0.4, -0.9, 0.3, 0.2, 0.1, 0.1, 0.3, -0.7, 0.6, 0.3, 0.1, 0.2, 0.8;
  ChangeFrame(part, other);
  const MergeSummary summary = Merge(points, whole, window, part, {});
  ASSERT_TRUE(summary.merged);
  EXPECT_EQ(summary.shared_frames, 4);
  EXPECT_LT(summary.rms_px, 1e-6);
  EXPECT_EQ(whole.PlacedCount(), 16);
  EXPECT_LT(RmsPx(points, whole), 1e-6);
}

TEST(Merge, WhatDoesNotFitIsNotMerged) {
  const auto [s, points, truth] = TrueSceneOf(See(DeskPath(16), DeskPoints(150), {}));
  const FrameWindow window = MakeWindow(points, {8, 9, 10, 11, 12, 13});
  ProjectiveModel whole = truth, part(Extract(points, window));
  std::mt19937_64 random(7);
  std::normal_distribution<double> gauss;
  for (std::size_t i = 0; i < window.tracks.size(); ++i) {
    part.X[i] = Eigen::Vector4d(gauss(random), gauss(random), gauss(random), gauss(random)).normalized();
    part.solved[i] = 1;
  }
  EXPECT_FALSE(Merge(points, whole, window, part, {}).merged);
}

// Two unknowns: the optimum is at a vertex, and all can be tried.
TEST(LinearProgram, AgreesWithTryingAllVertices) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const int n = 3 + trial % 20;
    Eigen::MatrixXd A(n, 2);
    Eigen::VectorXd b(n), c(2);
    for (int i = 0; i < n; ++i) {
      A.row(i) << uniform(random), uniform(random);
      b[i] = trial % 3 == 0 ? 0.3 * uniform(random) : std::abs(uniform(random));
    }
    c << uniform(random), uniform(random);
    Eigen::MatrixXd all(n + 4, 2);
    Eigen::VectorXd rhs(n + 4);
    all << A, 1, 0, -1, 0, 0, 1, 0, -1;
    rhs << b, 1, 1, 1, 1;
    double best = -1e300;
    for (int i = 0; i < n + 4; ++i)
      for (int j = 0; j < i; ++j) {
        Eigen::Matrix2d M;
        M << all.row(i), all.row(j);
        if (std::abs(M.determinant()) < 1e-12) continue;
        const Eigen::Vector2d x = M.inverse() * Eigen::Vector2d(rhs[i], rhs[j]);
        if (((all * x - rhs).array() < 1e-9).all()) best = std::max(best, c.dot(x));
      }
    const auto x = SolveLinearProgram(A, b, c, 1, static_cast<std::uint64_t>(trial));
    ASSERT_EQ(x.has_value(), best > -1e299) << trial;
    if (x) {
      EXPECT_NEAR(c.dot(*x), best, 1e-8) << trial;
    }
  }
}

// Feasible, and no better than the dual says: any multipliers y >= 0 with A^T y = c bound the optimum by b . y.
TEST(LinearProgram, FiveUnknownsAndManyConstraintsReachTheKnownOptimum) {
  // A x <= 1 for random unit rows; the ball of radius 1 lies inside. Tangent at c / |c|: the optimum is |c|.
  std::mt19937_64 random(13);
  std::normal_distribution<double> gauss;
  for (int trial = 0; trial < 10; ++trial) {
    const int n = 2000;
    Eigen::MatrixXd A(n + 5, 5);
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k < 5; ++k) A(i, k) = gauss(random);
      A.row(i).normalize();
    }
    Eigen::VectorXd c(5);
    for (int k = 0; k < 5; ++k) c[k] = gauss(random);
    // A simplex around the optimum's direction, so that the optimum is a vertex that is known: all five meet at c /
    // |c|.
    const Eigen::VectorXd u = c.normalized();
    for (int k = 0; k < 5; ++k) A.row(n + k) = (u + 0.3 * (Eigen::VectorXd::Unit(5, k) - u[k] * u)).transpose();
    Eigen::VectorXd b = Eigen::VectorXd::Constant(n + 5, 1.5);
    for (int k = 0; k < 5; ++k) b[n + k] = A.row(n + k).dot(u);
    const auto x = SolveLinearProgram(A, b, c, 10, static_cast<std::uint64_t>(trial));
    ASSERT_TRUE(x);
    EXPECT_LT((A * *x - b).maxCoeff(), 1e-8);
    EXPECT_GE(c.dot(*x), c.norm() - 1e-8);
  }
}

TEST(LinearProgram, ContradictionsAreNamed) {
  Eigen::MatrixXd A(2, 3);
  A << 1, 0, 0, -1, 0, 0;
  const Eigen::Vector2d b(-0.5, 0.2);  // x <= -0.5 and x >= -0.2
  EXPECT_FALSE(SolveLinearProgram(A, b, Eigen::Vector3d(0, 1, 0), 1));
}

TEST(QuasiAffine, EverythingIsInFrontAndOnOneSideOfInfinity) {
  auto [s, points, model] = TrueSceneOf(See(PlazaPath(20), PlazaPoints(200), {}));
  std::mt19937_64 random(17);
  for (auto& P : model.P) P *= random() % 2 ? 1 : -1;
  for (auto& X : model.X) X *= random() % 2 ? 1 : -1;
  const QuasiAffine result = SolveQuasiAffine(points, model);
  ASSERT_TRUE(result.solved);
  EXPECT_EQ(result.sign_conflicts, 0);
  EXPECT_GT(result.margin, 0);
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    EXPECT_GT(model.X[t].w(), 0);
    for (const Sight& x : points.tracks[t])
      EXPECT_GT(model.P[static_cast<std::size_t>(x.frame)].row(2).dot(model.X[t]), 0);
  }
  // Centres of projection are finite and the left blocks keep their handedness: in front means det > 0 and w > 0.
  for (const auto& P : model.P) EXPECT_GT(P.leftCols<3>().determinant(), 0);
  EXPECT_LT(RmsPx(points, model), 1e-6);
}

TEST(QuasiAffine, TheHullOfPointsAndCamerasIsNotCut) {
  // Convex combinations of points keep w > 0, and the true frame's order of depths in each camera survives: what a
  // quasi-affine frame promises.
  auto [s, points, model] = TrueSceneOf(See(DeskPath(10), DeskPoints(100), {}));
  ASSERT_TRUE(SolveQuasiAffine(points, model).solved);
  std::mt19937_64 random(19);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t i = random() % model.X.size(), j = random() % model.X.size();
    // The midpoint in the world, carried into the frame by the line's own cross ratio: on the segment, not through
    // infinity.
    const Eigen::Vector4d middle = (s.x_in_world[i] / s.x_in_world[i].w() + s.x_in_world[j] / s.x_in_world[j].w()) / 2;
    // Its image in two cameras lies between the images of the ends.
    const Eigen::Vector3d image =
        NormalisedFromPixels(points, 0) * s.camera.K() * (s.cam_from_world[0] * Eigen::Vector3d(middle.head<3>()));
    const Eigen::Vector3d a = model.P[0] * model.X[i], b = model.P[0] * model.X[j];
    const Eigen::Vector2d from = a.hnormalized(), to = b.hnormalized(), at = image.hnormalized();
    const double share = (at - from).dot(to - from) / std::max(1e-12, (to - from).squaredNorm());
    EXPECT_GT(share, -1e-9);
    EXPECT_LT(share, 1 + 1e-9);
  }
}

TEST(Upgrade, TheTrueFrameIsFoundExactly) {
  const auto [s, points, model] = TrueSceneOf(See(PlazaPath(12), PlazaPoints(150), {}));
  std::vector<Eigen::Matrix3d> K;
  for (std::size_t f = 0; f < 12; ++f) K.push_back(NormalisedFromPixels(points, f) * s.camera.K());
  const Upgrade upgrade = UpgradeToEuclidean(points, model, K);
  ASSERT_TRUE(upgrade.found);
  EXPECT_LT(upgrade.residual, 1e-8);
  EXPECT_EQ(upgrade.front_share, 1);
  for (std::size_t f = 1; f < 12; ++f) {
    const Eigen::Quaterniond found =
        upgrade.cam_from_world[f].rotation * upgrade.cam_from_world[0].rotation.conjugate();
    const Eigen::Quaterniond truth = s.cam_from_world[f].rotation * s.cam_from_world[0].rotation.conjugate();
    EXPECT_LT(found.angularDistance(truth), 1e-7);
  }
}

TEST(Upgrade, TheUncertaintyFollowsTheNoiseAndOneBadCameraDoesNoHarm) {
  const SimulatedTracks s = See(PlazaPath(12), PlazaPoints(150), {});
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  std::vector<Eigen::Matrix3d> K;
  for (std::size_t f = 0; f < 12; ++f) K.push_back(NormalisedFromPixels(points, f) * s.camera.K());
  double last = 0;
  for (const double noise : {1e-6, 1e-5, 1e-4}) {
    ProjectiveModel model = TrueModel(s, points);
    std::mt19937_64 random(41);
    std::normal_distribution<double> gauss(0, noise);
    for (auto& P : model.P)
      for (int i = 0; i < 12; ++i) P.data()[i] += gauss(random);
    const double sigma = UpgradeToEuclidean(points, model, K).plane_sigma;
    EXPECT_GT(sigma, noise);
    if (last > 0) {
      EXPECT_NEAR(sigma / last, 10, 3);
    }
    last = sigma;
  }
  ProjectiveModel model = TrueModel(s, points);
  model.P[2] = Matrix34d::Random().normalized();
  const Upgrade upgrade = UpgradeToEuclidean(points, model, K);
  ASSERT_TRUE(upgrade.found);
  for (std::size_t f = 4; f < 12; ++f) {
    const Eigen::Quaterniond found =
        upgrade.cam_from_world[f].rotation * upgrade.cam_from_world[3].rotation.conjugate();
    const Eigen::Quaterniond truth = s.cam_from_world[f].rotation * s.cam_from_world[3].rotation.conjugate();
    EXPECT_LT(found.angularDistance(truth), 0.02);  // a camera that is off altogether still pulls a little
  }
}

TEST(Upgrade, ConstantOrientationIsToldFromTurning) {
  auto path = PlazaPath(12);
  const auto deviation = [&] {
    const SimulatedTracks s = See(path, PlazaPoints(150), {});
    const ImagePoints points = Normalise(s.tracks, std::nullopt);
    return DeviationFromConstantOrientation(points, TrueModel(s, points));
  };
  EXPECT_GT(deviation(), 0.05);
  path = test::WithoutTurning(path);
  EXPECT_LT(deviation(), 1e-8);
}

// A projective frame that bends along the way: each frame's plane at infinity is a little off its neighbours'.
ProjectiveModel Bent(const SimulatedTracks& s, const ImagePoints& points, double bend) {
  ProjectiveModel model = TrueModel(s, points);
  for (std::size_t f = 0; f < model.P.size(); ++f) {
    Eigen::Matrix4d H = Eigen::Matrix4d::Identity();
    H(3, 0) = bend * static_cast<double>(f) / static_cast<double>(model.P.size());
    model.P[f] = (model.P[f] * H).eval().normalized();
  }
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    model.solved[t] = 0;
    IntersectTrack(points, model, t, {});
  }
  return model;
}

TEST(WindowUpgrade, ABentFrameIsMetricWindowByWindow) {
  Noise noise;
  noise.max_track_frames = 10;
  const SimulatedTracks s = See(HallwayPath(60), HallwayPoints(900), noise);
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  const ProjectiveModel model = Bent(s, points, 0.1);
  std::vector<Eigen::Matrix3d> K;
  for (std::size_t f = 0; f < points.FrameCount(); ++f) K.push_back(NormalisedFromPixels(points, f) * s.camera.K());
  const PoseErrors at_once = ComparePoses(UpgradeToEuclidean(points, model, K).cam_from_world, s.cam_from_world);
  EXPECT_GT(at_once.rotation_max_deg, 1);
  const auto windows = SplitIntoWindows(points, {});
  const Eigen::Vector4d intrinsics_px(560, 560, 322.5, 238.5);
  const WindowUpgrade joined = UpgradeByWindows(points, model, windows, intrinsics_px, {});
  ASSERT_TRUE(joined.found);
  EXPECT_EQ(joined.windows, static_cast<int>(windows.size()));
  const PoseErrors errors = ComparePoses(joined.cam_from_world, s.cam_from_world);
  EXPECT_LT(errors.rotation_max_deg, 1e-6);
  EXPECT_LT(errors.centre_max_percent, 1e-6);
  // Points move with their windows.
  MetricModel metric{intrinsics_px, joined.cam_from_world, joined.X};
  ProjectiveModel euclidean = model;
  euclidean.solved = joined.solved;
  ToProjective(points, metric, euclidean);
  EXPECT_GT(euclidean.SolvedCount(), model.SolvedCount() / 2);
  EXPECT_LT(RmsPx(points, euclidean), 1e-5);
}

TEST(WindowUpgrade, AFrameThatNoWindowReachesLeavesNoAnswer) {
  const SimulatedTracks s = See(HallwayPath(30), HallwayPoints(400), {});
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  std::vector<FrameWindow> windows;
  for (const int begin : {0, 15}) {  // side by side, without a frame in common
    std::vector<int> frames;
    for (int f = begin; f < begin + 15; ++f) frames.push_back(f);
    windows.push_back(MakeWindow(points, frames));
  }
  const WindowUpgrade joined =
      UpgradeByWindows(points, TrueModel(s, points), windows, Eigen::Vector4d(560, 560, 322.5, 238.5), {});
  EXPECT_FALSE(joined.found);
  EXPECT_EQ(joined.windows, 1);
}

}  // namespace
}  // namespace lumi
