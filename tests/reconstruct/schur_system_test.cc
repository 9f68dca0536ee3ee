// The projective adjustment's own solver: against dense matrices in extended precision, and its minimum beside Ceres'.
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <ceres/sphere_manifold.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "reconstruct/factorization/projective_bundle.h"
#include "reconstruct/factorization/reprojection_cost.h"
#include "reconstruct/factorization/schur_system.h"
#include "scene/program/parallel.h"
#include "true_model.h"

namespace lumi {
namespace {

using test::DeskPath;
using test::DeskPoints;
using test::See;
using test::TrueSceneOf;

using MatrixXl = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using VectorXl = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

// Rounding of a product over n numbers grows with n at most; conditions of these matrices stay below 1e4.
constexpr double kRounding = 1e-11;

// A random positive definite matrix whose row i begins at first_of(i).
template <typename First>
Eigen::MatrixXd Enveloped(int n, const First& first_of, std::vector<int>& first) {
  std::mt19937_64 random(static_cast<std::uint64_t>(n));
  std::uniform_real_distribution<double> number(-1, 1);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  first.resize(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    first[static_cast<std::size_t>(i)] = first_of(i);
    for (int j = first_of(i); j < i; ++j) A(i, j) = A(j, i) = number(random);
  }
  for (int i = 0; i < n; ++i) A(i, i) = A.row(i).cwiseAbs().sum() + 1;
  return A;
}

void Fill(TileCholesky& tiles, const Eigen::MatrixXd& A, const std::vector<int>& first) {
  for (int i = 0; i < A.rows(); ++i)
    for (int j = first[static_cast<std::size_t>(i)]; j <= i; ++j) *tiles.At(i, j) = A(i, j);
}

TEST(TileCholesky, SolvesWhatADenseMatrixInExtendedPrecisionSolves) {
  for (const int n : {1, 12, 47, 48, 49, 96, 200, 331})
    for (const int band : {0, 5, 60, 1000}) {
      std::vector<int> first;
      // Ragged: every seventh row reaches twice as far.
      const Eigen::MatrixXd A = Enveloped(
          n, [&](int i) { return std::max(0, i - (i % 7 ? band : 2 * band)); }, first);
      TileCholesky tiles(first);
      Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(n, -1, 2);
      const VectorXl truth = A.cast<long double>().llt().solve(x.cast<long double>());
      for (int again = 0; again < 2; ++again) {  // what was left of a factor does not count
        tiles.SetZero();
        Fill(tiles, A, first);
        Eigen::VectorXd y = x;
        ASSERT_TRUE(tiles.Factorise()) << n << " " << band;
        tiles.Solve(y);
        EXPECT_LT((y.cast<long double>() - truth).norm(), kRounding * truth.norm()) << n << " " << band;
      }
    }
}

TEST(TileCholesky, SaysThatAMatrixIsNotPositiveDefinite) {
  for (const int at : {0, 30, 60, 99}) {
    std::vector<int> first;
    Eigen::MatrixXd A = Enveloped(
        100, [](int i) { return std::max(0, i - 20); }, first);
    A(at, at) = -1;
    TileCholesky tiles(first);
    Fill(tiles, A, first);
    EXPECT_FALSE(tiles.Factorise()) << at;
    A(at, at) = std::numeric_limits<double>::quiet_NaN();
    tiles.SetZero();
    Fill(tiles, A, first);
    EXPECT_FALSE(tiles.Factorise()) << at;
  }
}

// Equations of random derivatives: most cameras see a run of points, as in a video, two do not move, one sees nothing,
// and some points are seen but once.
struct RandomEquations {
  std::vector<SchurSystem::Link> links;
  int cameras = 0, points = 0;
  MatrixXl H;
  VectorXl g;

  RandomEquations(int camera_count, int point_count, int seed) : cameras(camera_count), points(point_count) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    for (int p = 0; p < points; ++p) {
      const int begin = p * (cameras - 1) / points, many = p % 9 == 0 ? 1 : p % 5 == 0 ? cameras : 4;
      if (p % 3 == 0) links.push_back({-1, p});
      for (int c = begin; c < std::min(cameras - 1, begin + many); ++c) links.push_back({c, p});
    }
    const int C = SchurSystem::kCameraNumbers, n = C * cameras + 3 * points;
    H.setZero(n, n);
    g.setZero(n);
    std::normal_distribution<double> gauss;
    for (const SchurSystem::Link& link : links) {
      std::vector<int> at;
      for (int j = 0; j < 3; ++j) at.push_back(C * cameras + 3 * link.point + j);
      for (int j = 0; link.camera >= 0 && j < C; ++j) at.push_back(C * link.camera + j);
      for (int row = 0; row < 2; ++row) {
        const double r = gauss(random);
        std::vector<double> J(at.size());
        for (double& number : J) number = gauss(random);
        for (std::size_t i = 0; i < at.size(); ++i) {
          g[at[i]] += static_cast<long double>(J[i]) * r;
          for (std::size_t j = 0; j < at.size(); ++j) H(at[i], at[j]) += static_cast<long double>(J[i]) * J[j];
        }
      }
    }
  }

  void Give(SchurSystem& s) const {
    const int C = SchurSystem::kCameraNumbers;
    const auto block = [&](int i, int j, int rows, int columns) {
      return H.block(i, j, rows, columns).cast<double>().eval();
    };
    for (int c = 0; c < cameras; ++c) {
      s.U[static_cast<std::size_t>(c)] = block(C * c, C * c, C, C);
      s.camera_gradient[static_cast<std::size_t>(c)] = g.segment(C * c, C).cast<double>();
    }
    for (int p = 0; p < points; ++p) {
      const int at = C * cameras + 3 * p;
      s.V[static_cast<std::size_t>(p)] = block(at, at, 3, 3);
      s.point_gradient[static_cast<std::size_t>(p)] = g.segment(at, 3).cast<double>();
    }
    for (std::size_t k = 0; k < links.size(); ++k)
      if (links[k].camera >= 0) s.E[k] = block(C * links[k].camera, C * cameras + 3 * links[k].point, C, 3);
  }

  // The step, and what it takes off half the sum of squares.
  VectorXl Step(double damping, long double& decrease) const {
    MatrixXl damped = H;
    for (Eigen::Index i = 0; i < H.rows(); ++i) damped(i, i) += damping * (H(i, i) > 0 ? H(i, i) : 1.0L);
    const VectorXl x = damped.ldlt().solve(-g);
    decrease = -(g.dot(x) + x.dot(H * x) / 2);
    return x;
  }
};

TEST(SchurSystem, StepsAsTheWholeMatrixInExtendedPrecisionDoes) {
  for (const int cameras : {2, 5, 23})
    for (const double damping : {1.0, 1e-2, 1e-4}) {
      const RandomEquations equations(cameras, 9 * cameras, cameras);
      SchurSystem system(cameras, equations.points, equations.links);
      equations.Give(system);
      SchurSystem::Step step;
      ASSERT_TRUE(system.Solve(damping, step));
      long double decrease = 0;
      const VectorXl truth = equations.Step(damping, decrease);
      VectorXl x(truth.size());
      for (int c = 0; c < cameras; ++c)
        x.segment(12 * c, 12) = step.cameras[static_cast<std::size_t>(c)].cast<long double>();
      for (int p = 0; p < equations.points; ++p)
        x.segment(12 * cameras + 3 * p, 3) = step.points[static_cast<std::size_t>(p)].cast<long double>();
      // Damping alone holds what few sights leave free: errors grow with its inverse.
      EXPECT_LT((x - truth).norm(), kRounding / damping * truth.norm()) << cameras << " " << damping;
      EXPECT_NEAR(step.model_decrease, static_cast<double>(decrease),
                  kRounding / damping * static_cast<double>(decrease));
    }
}

TEST(SchurSystem, IsTheSameToTheBitForAnyNumberOfThreads) {
  const RandomEquations equations(40, 400, 3);
  std::vector<SchurSystem::Step> steps(2);
  for (int threads : {1, 4}) {
    SetThreadCount(threads);
    SchurSystem system(equations.cameras, equations.points, equations.links);
    equations.Give(system);
    ASSERT_TRUE(system.Solve(1e-3, steps[threads == 1 ? 0 : 1]));
  }
  SetThreadCount(0);
  EXPECT_EQ(steps[0].model_decrease, steps[1].model_decrease);
  for (std::size_t c = 0; c < steps[0].cameras.size(); ++c) EXPECT_EQ(steps[0].cameras[c], steps[1].cameras[c]);
  for (std::size_t p = 0; p < steps[0].points.size(); ++p) EXPECT_EQ(steps[0].points[p], steps[1].points[p]);
}

TEST(SchurSystem, RefusesEquationsThatAreNoNumbers) {
  const RandomEquations equations(4, 30, 1);
  SchurSystem system(4, 30, equations.links);
  equations.Give(system);
  system.V[7](1, 1) = std::numeric_limits<double>::quiet_NaN();
  SchurSystem::Step step;
  EXPECT_FALSE(system.Solve(1e-3, step));
}

ceres::LossFunction* CeresLoss(BundleOptions::Loss loss, double scale) {
  switch (loss) {
    case BundleOptions::Loss::kNone: break;
    case BundleOptions::Loss::kHuber: return new ceres::HuberLoss(scale);
    case BundleOptions::Loss::kCauchy: return new ceres::CauchyLoss(scale);
  }
  return nullptr;
}

// Of the robust cost that both minimise.
double CostOf(const ImagePoints& points, const ProjectiveModel& model, const BundleOptions& options) {
  const std::unique_ptr<ceres::LossFunction> loss(CeresLoss(options.loss, options.scale_px));
  double sum = 0;
  for (const double e : InlierErrorsPx(points, model)) {
    double rho[3] = {e * e, 1, 0};
    if (loss) loss->Evaluate(e * e, rho);
    sum += rho[0] / 2;
  }
  return sum;
}

ProjectiveModel ByCeres(const ImagePoints& points, ProjectiveModel model, const BundleOptions& options,
                        const std::vector<char>& held) {
  using RowMajor = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  std::vector<RowMajor> P(model.P.begin(), model.P.end());
  for (RowMajor& p : P) p.normalize();
  ceres::Problem problem;
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    model.X[t].normalize();
    for (const Sight& sight : points.tracks[t]) {
      const auto f = static_cast<std::size_t>(sight.frame);
      problem.AddResidualBlock(new ReprojectionCost<4>(sight.x, points.px_per_unit[f]),
                               CeresLoss(options.loss, options.scale_px), P[f].data(), model.X[t].data());
    }
    problem.SetManifold(model.X[t].data(), new ceres::SphereManifold<4>);
  }
  for (std::size_t f = 0; f < P.size(); ++f)
    if (!held.empty() && held[f])
      problem.SetParameterBlockConstant(P[f].data());
    else
      problem.SetManifold(P[f].data(), new ceres::SphereManifold<12>);
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_SCHUR;
  solver.max_num_iterations = 200;
  solver.function_tolerance = 1e-14;
  solver.max_trust_region_radius = 1e7;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  for (std::size_t f = 0; f < P.size(); ++f) model.P[f] = P[f];
  return model;
}

TEST(ProjectiveBundle, ItsMinimumIsNotAboveCeres) {
  auto noise = test::Tracked(0.5);
  const auto s = See(DeskPath(8), DeskPoints(60), noise);
  auto [seen, points, start] = TrueSceneOf(s);
  std::mt19937_64 random(9);
  std::normal_distribution<double> gauss(0, 1e-3);
  for (auto& P : start.P)
    for (int i = 0; i < 12; ++i) P.data()[i] += gauss(random);
  for (std::size_t t = 0; t < points.tracks.size(); t += 11) points.tracks[t][0].x.x() += 0.1;  // outliers
  std::vector<char> two_held(points.FrameCount(), 0);
  two_held[2] = two_held[5] = 1;
  for (const auto loss : {BundleOptions::Loss::kNone, BundleOptions::Loss::kHuber, BundleOptions::Loss::kCauchy})
    for (const std::vector<char>& held : {std::vector<char>{}, two_held}) {
      BundleOptions options;
      options.loss = loss;
      options.max_iterations = 200;
      options.tolerance = 1e-14;
      ProjectiveModel ours = start;
      ASSERT_TRUE(AdjustProjective(points, ours, options, held).usable);
      const double ceres = CostOf(points, ByCeres(points, start, options, held), options);
      EXPECT_LT(CostOf(points, ours, options), ceres * (1 + 1e-6)) << static_cast<int>(loss) << " " << held.size();
      if (!held.empty()) {
        EXPECT_LT((ours.P[2] - start.P[2].normalized()).norm(), 1e-15);
      }
    }
}

TEST(ProjectiveBundle, ChangesNothingWhereAPointLiesOnACamerasPrincipalPlane) {
  auto [s, points, model] = TrueSceneOf(See(DeskPath(6), DeskPoints(40), {}));
  // Exactly: w = (0, 0, 1, 0) . (1, 2, 0, 1).
  model.P[static_cast<std::size_t>(points.tracks[3][0].frame)].row(2) << 0, 0, 1, 0;
  model.X[3] = {1, 2, 0, 1};
  const ProjectiveModel before = model;
  EXPECT_FALSE(AdjustProjective(points, model, {}).usable);
  for (std::size_t f = 0; f < model.P.size(); ++f) EXPECT_EQ(model.P[f], before.P[f]);
  for (std::size_t t = 0; t < model.X.size(); ++t) EXPECT_EQ(model.X[t], before.X[t]);
}

TEST(ProjectiveBundle, FewSightsLeaveACameraWhereTheyCanAndTheOthersWhereTheyWere) {
  auto [s, points, model] = TrueSceneOf(See(DeskPath(8), DeskPoints(60), test::Tracked(0.3)));
  for (std::size_t t = 4; t < points.tracks.size(); ++t)  // four sights for the eleven numbers of frame 7
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k)
      if (points.tracks[t][k].frame == 7) model.inlier[t][k] = 0;
  ProjectiveModel without = model;
  without.placed[7] = 0;
  BundleOptions options;
  options.max_iterations = 100;
  const BundleSummary summary = AdjustProjective(points, model, options);
  ASSERT_TRUE(summary.usable);
  ASSERT_TRUE(AdjustProjective(points, without, options).usable);
  EXPECT_TRUE(model.P[7].allFinite());
  EXPECT_NEAR(summary.rms_px, RmsPx(points, without), 0.05 * summary.rms_px);
}

}  // namespace
}  // namespace lumi
