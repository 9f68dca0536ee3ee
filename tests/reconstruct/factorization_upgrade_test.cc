// The parts of the factorisation that lead to a metric: linear programs, the quasi-affine frame, the plane at infinity.
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/linear_program.h"
#include "reconstruct/factorization/metric_bundle.h"
#include "reconstruct/factorization/quasi_affine.h"
#include "reconstruct/factorization/upgrade.h"
#include "reconstruct/factorization/window_upgrade.h"
#include "scene/geometry/median.h"
#include "scene/geometry/similarity3.h"
#include "true_model.h"

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
using test::TrueModel;
using test::TrueSceneOf;

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

// Two points of 800 that noise has moved far away along their rays would keep the plane near all others: they are left
// out, and depths are as even as without them.
TEST(QuasiAffine, AFewFarPointsDoNotBendTheFrame) {
  auto [s, points, model] = TrueSceneOf(See(PlazaPath(20), PlazaPoints(800), {}));
  const auto depth_range = [](const ProjectiveModel& m) {
    std::vector<double> depth;
    for (std::size_t t = 0; t < m.X.size(); ++t)
      if (m.solved[t]) depth.push_back(m.P[10].row(2).dot(m.X[t]) / m.X[t].w());
    return Quantile(depth, 0.95) / Quantile(depth, 0.05);
  };
  const QuasiAffine plain = SolveQuasiAffine(points, model);
  ASSERT_TRUE(plain.solved);
  EXPECT_EQ(plain.left_out, 0);
  const double even = depth_range(model);
  const Eigen::Vector3d centre = -model.P[10].leftCols<3>().inverse() * model.P[10].col(3);
  for (const std::size_t t : {100U, 500U}) {
    const Eigen::Vector3d x = model.X[t].hnormalized();
    model.X[t] = (centre + 20 * (x - centre)).homogeneous().normalized();
  }
  const QuasiAffine far = SolveQuasiAffine(points, model);
  ASSERT_TRUE(far.solved);
  EXPECT_GE(far.left_out, 2);
  EXPECT_LE(far.left_out, 4);
  EXPECT_FALSE(model.solved[100] || model.solved[500]);
  EXPECT_NEAR(depth_range(model) / even, 1, 0.1);
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
