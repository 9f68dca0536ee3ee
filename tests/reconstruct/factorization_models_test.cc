// The parts of the factorisation that make a model of many frames: rank 4, bundle adjustments, culling, merging.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "reconstruct/factorization/cull.h"
#include "reconstruct/factorization/merge.h"
#include "reconstruct/factorization/metric_bundle.h"
#include "reconstruct/factorization/projective_bundle.h"
#include "reconstruct/factorization/rank4_factorization.h"
#include "scene/geometry/similarity3.h"
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

}  // namespace
}  // namespace lumi
