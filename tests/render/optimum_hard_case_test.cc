// The optimum next to its degenerate neighbours.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <boost/multiprecision/cpp_dec_float.hpp>
#include <random>

#include "optimum_oracle.h"
#include "render/radiance/optimum/dense_solver.h"
#include "render/radiance/optimum/optimum.h"

namespace lumi {
namespace {

using Decimal = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<50>, boost::multiprecision::et_off>;
const double kAccuracies[] = {1e-3, 1e-6, 1e-9};  // the three paths
const WeightSum kSums[] = {WeightSum::kLocalMean, WeightSum::kRenormalise, WeightSum::kConstrained};

RadianceSettings Full(double accuracy, WeightSum sum = WeightSum::kLocalMean) {
  RadianceSettings s;
  s.similarity = Similarity::kFull;
  s.correlation = Correlation::kFallingLeaves;
  s.accuracy = accuracy;
  s.sum = sum;
  s.cutoff_rad = std::numbers::pi;
  return s;
}

Sources CamerasAt(const std::vector<Eigen::Vector3d>& centres) {
  Sources s;
  const Camera camera = Camera::Pinhole(1000, 1000, 300, 300, 500, 500);
  for (const auto& c : centres) s.views.push_back(MakeRenderView(camera, LookAt(c, {0, 0, 0}, {0, -1, 0})));
  return s;
}

struct Solved {
  std::vector<double> weight;
  float alpha = 0;
  OptimumCounts counts;
  double Sum() const {
    double sum = 0;
    for (const double w : weight) sum += w;
    return sum;
  }
};

// The ray from `eye` to the origin.
Solved AtOrigin(const Sources& s, const Eigen::Vector3d& eye, const RadianceSettings& settings) {
  const RenderView view =
      MakeRenderView(Camera::Pinhole(1000, 1000, 300, 300, 500, 500), LookAt(eye, {0, 0, 0}, {0, -1, 0}));
  const ViewSetup setup = MakeViewSetup(s, view, settings);
  RaySamples rays;
  rays.direction.push_back((-eye.normalized()).cast<float>());
  rays.t.push_back(static_cast<float>(eye.norm()));
  WeightTable table;
  Solved out;
  WeighOptimal(setup, nullptr, rays, table, out.counts);
  out.alpha = table.alpha[0];
  out.weight.resize(s.views.size());
  for (std::size_t i = 0; i < table.camera.size(); ++i) {
    EXPECT_TRUE(std::isfinite(table.weight[i]));
    out.weight[static_cast<std::size_t>(table.camera[i])] = static_cast<double>(table.weight[i]);
  }
  return out;
}

TEST(HardCase, WeightsOfTheFullSystemAgainstFiftyDigits) {
  const test::DeskLike desk = test::MakeDeskLike(262);
  const std::vector<Eigen::Vector2d> pixels = {{320.5, 240.5}, {17.3, 401.2}, {611.9, 88.8}};
  std::vector<test::OracleWeights<Decimal>> truth;
  for (const double accuracy : kAccuracies) {
    const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, Full(accuracy));
    const RaySamples rays = test::RaysThrough(desk, setup, pixels);
    if (truth.empty()) {
      const test::OracleLeaves<Decimal> leaves(Decimal(setup.settings.r_min_rad), Decimal(setup.settings.r_max_rad));
      for (std::size_t i = 0; i < rays.size(); ++i)
        truth.push_back(test::OracleOptimum<Decimal>(setup, nullptr, rays.direction[i], rays.t[i], leaves));
    }
    WeightTable table;
    OptimumCounts counts;
    WeighOptimal(setup, nullptr, rays, table, counts);
    EXPECT_GT(counts.cameras, 30 * 3);
    // Weights are stored in float: half a unit in their last place at 1.
    for (std::size_t i = 0; i < rays.size(); ++i)
      EXPECT_LT(test::LargestError(table, i, truth[i]), accuracy + 6e-8) << accuracy;
  }
}

// Cholesky in double: 10 x condition x epsilon, two photos approaching from a tenth of a radian down to 1e-15.
TEST(HardCase, CholeskyHoldsItsDigitsAsTwoPhotosMeet) {
  const double r_min = 0.001 * kRadPerDeg, r_max = 5 * kRadPerDeg;
  const FallingLeaves leaves(r_min, r_max);
  const test::OracleLeaves<Decimal> exact{Decimal(r_min), Decimal(r_max)};
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> u(-0.08, 0.08);
  DenseSystem s;
  const Eigen::Index n = 12;
  s.u.resize(3, n);
  s.f = Eigen::VectorXd::Ones(n);
  s.y.resize(n);
  s.channel.resize(n, 0);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double x = u(engine), y = u(engine);
    s.u.col(i) = Eigen::Vector3d(x, y, -1).normalized();
  }
  const Eigen::Vector3d view = Eigen::Vector3d(0.01, -0.02, -1).normalized();
  for (double apart = 1e-1; apart >= 1e-15; apart /= 10) {
    s.u.col(1) = (s.u.col(0) + apart * s.u.col(0).cross(Eigen::Vector3d(0.3, 0.9, 0.1)).normalized()).normalized();
    const auto angle = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      Decimal d[3], c[3], dot = 0;
      for (int k = 0; k < 3; ++k) {
        d[k] = Decimal(a[k]);
        c[k] = Decimal(b[k]);
        dot += d[k] * c[k];
      }
      const Decimal x = d[1] * c[2] - d[2] * c[1], y = d[2] * c[0] - d[0] * c[2], z = d[0] * c[1] - d[1] * c[0];
      return Decimal(atan2(Decimal(sqrt(Decimal(x * x + y * y + z * z))), dot));
    };
    std::vector<std::vector<Decimal>> S(static_cast<std::size_t>(n));
    std::vector<Decimal> y;
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < i; ++j)
        S[static_cast<std::size_t>(i)].push_back(exact(angle(s.u.col(i), s.u.col(j))));
      S[static_cast<std::size_t>(i)].push_back(1 + Decimal(kNugget));
      y.push_back(exact(angle(s.u.col(i), view)));
      s.y[i] = static_cast<double>(y.back());
    }
    const auto truth = test::OracleCholesky<Decimal>(S, {y});
    const Eigen::MatrixXd A = SimilarityMatrix(leaves, 1, s);
    const DenseResult r = SolveDense(A, s.y, s.f, false);
    EXPECT_EQ(r.nugget, kNugget);
    EXPECT_FALSE(r.clipped);
    const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A).eigenvalues();
    const double condition = eigenvalues[n - 1] / (eigenvalues[0] + kNugget);
    double error = 0, size = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      error += std::pow(r.w[i] - static_cast<double>(truth[0][static_cast<std::size_t>(i)]), 2);
      size += r.w[i] * r.w[i];
    }
    EXPECT_LE(std::sqrt(error), 10 * condition * std::numeric_limits<double>::epsilon() * std::sqrt(size)) << apart;
  }
}

TEST(HardCase, APhotosOwnViewIsThatPhoto) {
  const test::DeskLike desk = test::MakeDeskLike(262);
  const Camera camera = Camera::Pinhole(640, 480, 700, 700, 320, 240);
  for (const double accuracy : {1e-3, 1e-6}) {
    for (const std::size_t own : {0u, 100u, 261u}) {
      RenderView view = desk.sources.views[own];
      const ViewSetup setup = MakeViewSetup(desk.sources, view, Full(accuracy));
      test::DeskLike from = desk;
      from.view = view;
      std::vector<Eigen::Vector2d> pixels;
      // The inner region: the feather is 0.02 of the smaller side.
      for (double y = 10.5; y < 470; y += 13)
        for (double x = 10.5; x < 630; x += 13) pixels.emplace_back(x, y);
      const RaySamples rays = test::RaysThrough(from, setup, pixels);
      WeightTable table;
      OptimumCounts counts;
      WeighOptimal(setup, nullptr, rays, table, counts);
      std::size_t good = 0;
      for (std::size_t i = 0; i < rays.size(); ++i)
        for (std::int32_t k = table.first[i]; k < table.first[i + 1]; ++k)
          good += table.camera[static_cast<std::size_t>(k)] == static_cast<std::int32_t>(own) &&
                  table.weight[static_cast<std::size_t>(k)] > 0.99F;
      EXPECT_EQ(good, rays.size());
    }
  }
}

TEST(HardCase, RayThroughACameraCentreIsApproachedContinuously) {
  const Sources s =
      CamerasAt({{0, 0, -4}, {0.1, 0, -4}, {0, 0.12, -4}, {-0.2, 0, -4}, {0, -0.3, -4}, {0.25, 0.25, -4}});
  const FallingLeaves leaves(RadianceSettings{}.r_min_rad, RadianceSettings{}.r_max_rad);
  for (const WeightSum sum : kSums)
    for (const double accuracy : kAccuracies) {
      double before = 0;
      for (double a = 1e-1; a >= 1e-15; a /= 10) {
        const Solved r = AtOrigin(s, {3 * std::sin(a), 0, -3 * std::cos(a)}, Full(accuracy, sum));
        EXPECT_NEAR(r.Sum(), 1, 1e-5);
        if (a < 0.05) {
          EXPECT_GE(r.weight[0], before - 2 * accuracy) << a;
        }
        before = r.weight[0];
        // The photo's weight is its correlation with the ray but for what the others add: 1 - w <= 1 - P.
        if (a < 1e-3) {
          EXPECT_GT(r.weight[0], leaves.PSame(a) - 2e-3) << a;
        }
      }
      EXPECT_NEAR(before, 1, 0.1 * accuracy + 1e-6);
    }
}

TEST(HardCase, DuplicatesShareEquallyAndWeighAsOne) {
  const std::vector<Eigen::Vector3d> others = {{0.3, 0, -4}, {0, 0.25, -4}, {-0.4, 0.1, -4}};
  for (const double accuracy : kAccuracies)
    for (const bool timed : {false, true}) {
      std::vector<Eigen::Vector3d> centres = {{0.05, 0.02, -4}};
      centres.insert(centres.end(), others.begin(), others.end());
      RadianceSettings settings = Full(accuracy, WeightSum::kRenormalise);
      settings.time = timed;  // then photos of one place may differ, and are not taken together
      const Solved one = AtOrigin(CamerasAt(centres), {0.1, 0, -3}, settings);
      centres.insert(centres.end(), {{0.05, 0.02, -4}, {0.05, 0.02, -4}});
      const Solved three = AtOrigin(CamerasAt(centres), {0.1, 0, -3}, settings);
      EXPECT_NEAR(three.weight[0] + three.weight[4] + three.weight[5], one.weight[0], 2 * accuracy * 1e-1 + 1e-6);
      // As one they share exactly. In Cholesky rounding parts them by epsilon / nugget.
      const double equal = timed ? 1e-6 : 0;
      EXPECT_NEAR(three.weight[0], three.weight[4], equal);
      EXPECT_NEAR(three.weight[0], three.weight[5], equal);
      for (std::size_t j = 1; j < 4; ++j) EXPECT_NEAR(three.weight[j], one.weight[j], 2 * accuracy * 1e-1 + 1e-6);
    }
}

TEST(HardCase, AThousandPhotosWithinAMillionth) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> u(-1e-6, 1e-6);
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < 1000; ++i) {
    const double x = u(engine), y = u(engine);
    centres.emplace_back(x, y, -4 + u(engine));
  }
  const Sources s = CamerasAt(centres);
  for (const double offset : {0.0, 1e-7, 1e-3, 0.5}) {
    const Solved r = AtOrigin(s, {offset, 0, -3}, Full(1e-3));
    EXPECT_NEAR(r.Sum(), 1, 1e-4);
    for (const double w : r.weight) EXPECT_LT(std::abs(w), 1);
  }
  const Solved dense = AtOrigin(s, {1e-7, 0, -3}, Full(1e-9));
  EXPECT_NEAR(dense.Sum(), 1, 1e-4);
  for (const double w : dense.weight) EXPECT_LT(std::abs(w), 1.5);
}

TEST(HardCase, OneCameraAndNone) {
  for (const WeightSum sum : kSums)
    for (const double accuracy : kAccuracies) {
      for (const double x : {0.0, 1e-9, 0.01, 0.5, 2.0}) {
        const Solved r = AtOrigin(CamerasAt({{x, 0, -4}}), {0, 0, -3}, Full(accuracy, sum));
        EXPECT_NEAR(r.weight[0], 1, 1e-6) << x;
        EXPECT_EQ(r.alpha, 1);
      }
      const Solved none = AtOrigin(CamerasAt({}), {0, 0, -3}, Full(accuracy, sum));
      EXPECT_EQ(none.alpha, 0);
      EXPECT_EQ(none.counts.samples, 0);
    }
}

TEST(HardCase, LeavesDownToNoSizeAndUpToOneSize) {
  const Sources s =
      CamerasAt({{0.05, 0, -4}, {0.1, 0.05, -4}, {0, 0.12, -4}, {-0.2, 0, -4}, {0, -0.3, -4}, {0.25, 0.25, -4}});
  for (const WeightSum sum : kSums)
    for (const double accuracy : kAccuracies) {
      RadianceSettings settings = Full(accuracy, sum);
      const auto expect_sane = [&](const char* what) {
        const Solved r = AtOrigin(s, {0.03, 0.02, -3}, settings);
        EXPECT_NEAR(r.Sum(), 1, 1e-5) << what;
        for (const double w : r.weight) EXPECT_LT(std::abs(w), 2) << what;
      };
      for (double r_min = 1; r_min > 1e-18; r_min /= 10) {
        settings.r_min_rad = r_min * kRadPerDeg;
        expect_sane("towards 0");
      }
      settings.r_min_rad = 0;
      expect_sane("0");
      for (double d = 1e-1; d > 1e-16; d /= 10) {
        settings.r_min_rad = settings.r_max_rad / (1 + d);
        expect_sane("towards r_max");
      }
      settings.r_min_rad = settings.r_max_rad;
      expect_sane("r_max");
    }
}

TEST(HardCase, AnglesThatDoNotCountAndLeavesAsWideAsTheSky) {
  const Sources s = CamerasAt({{0.05, 0, -4}, {0.1, 0.05, -4}, {0, 0.12, -4}, {-0.2, 0, -4}, {3, -0.3, -3}, {0, 0, 5}});
  for (const WeightSum sum : kSums)
    for (const double accuracy : kAccuracies)
      for (const double alpha : {0.0, 1e-9, 0.1, 1.0, 1e9})
        for (const double r_max_deg : {1e-6, 5.0, 60.0, 90.0}) {
          RadianceSettings settings = Full(accuracy, sum);
          settings.alpha = alpha;
          settings.r_max_rad = r_max_deg * kRadPerDeg;
          settings.r_min_rad = 1e-4 * settings.r_max_rad;
          const Solved r = AtOrigin(s, {0.03, 0.02, -3}, settings);
          EXPECT_NEAR(r.Sum(), 1, 1e-4) << alpha << " " << r_max_deg;
          for (const double w : r.weight) EXPECT_LT(std::abs(w), 2) << alpha << " " << r_max_deg;
        }
}

TEST(HardCase, FarFromAllPhotosNothingExplodes) {
  const Sources s = CamerasAt({{0, 0, -4}, {0.3, 0.1, -4}, {0.1, 0.4, -4}, {-0.5, 0, -4}, {-0.2, -0.4, -4}});
  for (const double accuracy : kAccuracies)
    for (const WeightSum sum : kSums) {
      long small = 0;
      double before = 0;
      // The sum of the weights passes through 0 on the way out.
      for (double a = 0; a < 0.6; a += 0.002) {
        const Solved r = AtOrigin(s, {3 * std::sin(a), 0, -3 * std::cos(a)}, Full(accuracy, sum));
        EXPECT_NEAR(r.Sum(), 1, 1e-4) << a;
        small += r.counts.small_sums;
        for (const double w : r.weight) {
          EXPECT_LT(std::abs(w), sum == WeightSum::kRenormalise ? 30 : 1.1) << a << " " << Name(sum);
          if (sum == WeightSum::kLocalMean) {
            EXPECT_GT(w, -0.1) << a;
          }
        }
        before = r.weight[0];
      }
      EXPECT_GT(small, 10);
      EXPECT_LT(before, 1);
    }
}

// Rays become parallel: photos correlate wholly, shares are arbitrary, their sum is not.
TEST(HardCase, AVeryFarProxyPointIsSound) {
  const Sources s = CamerasAt({{0, 0, -4}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}, {0, -1.3, -4}});
  const RenderView view = MakeRenderView(Camera::Pinhole(1000, 1000, 300, 300, 500, 500),
                                         LookAt({0.1, 0.1, -3}, {0.1, 0.1, 0}, {0, -1, 0}));
  for (const bool resolution : {false, true})
    for (const WeightSum sum : kSums)
      for (const double accuracy : kAccuracies) {
        RadianceSettings settings = Full(accuracy, sum);
        if (resolution) settings.resolution = Resolution::kJacobian;
        const ViewSetup setup = MakeViewSetup(s, view, settings);
        for (float t = 1; t < 1e30F; t *= 100) {
          const RaySamples rays{{{0, 0, 1}}, {t}, {{0, 0.6F, 0.8F}}};
          WeightTable table;
          OptimumCounts counts;
          WeighOptimal(setup, nullptr, rays, table, counts);
          double total = 0;
          for (const float w : table.weight) {
            ASSERT_TRUE(std::isfinite(w)) << t;
            EXPECT_LT(std::abs(w), 2) << t << " " << accuracy << " " << Name(sum);
            total += static_cast<double>(w);
          }
          EXPECT_EQ(table.alpha[0], 1) << t;
          EXPECT_NEAR(total, 1, 1e-4) << t << " " << accuracy << " " << Name(sum);
        }
      }
}

TEST(HardCase, ACameraOnTheProxyAndADesiredOneTouchingIt) {
  for (const WeightSum sum : kSums)
    for (const double accuracy : kAccuracies)
      for (double d = 1e-1; d >= 1e-30; d /= 100) {
        const Sources s = CamerasAt({{0, 0, -d}, {0.1, 0, -4}, {0, 0.12, -4}, {-0.2, 0, -4}, {0.04, 0.1, -4}});
        for (const Eigen::Vector3d& eye :
             {Eigen::Vector3d(0.02, 0.01, -3), Eigen::Vector3d(0, 0, -d), Eigen::Vector3d(0, 0, -1e-3 * d)}) {
          const Solved r = AtOrigin(s, eye, Full(accuracy, sum));
          EXPECT_NEAR(r.Sum(), 1, 1e-4) << d << " " << eye.z() << " " << accuracy << " " << Name(sum);
          for (const double w : r.weight) EXPECT_LT(std::abs(w), 2) << d << " " << eye.z();
        }
      }
}

// Samples of one call share their photos' pairs: rays that coincide, or lie on a line, or fan out from one point, are
// weighed as each is alone.
TEST(HardCase, CollinearAndCoincidentSamples) {
  const Sources s =
      CamerasAt({{0.05, 0, -4}, {0.1, 0.05, -4}, {0, 0.12, -4}, {-0.2, 0, -4}, {0, -0.3, -4}, {0.25, 0.25, -4}});
  const RenderView view =
      MakeRenderView(Camera::Pinhole(1000, 1000, 300, 300, 500, 500), LookAt({0.03, 0.02, -3}, {0, 0, 0}, {0, -1, 0}));
  for (const double accuracy : kAccuracies) {
    const ViewSetup setup = MakeViewSetup(s, view, Full(accuracy));
    for (double apart = 1e-1; apart >= 1e-15; apart /= 10) {
      RaySamples rays;
      const auto add = [&](const Eigen::Vector3d& p) {
        const Eigen::Vector3d ray = p - setup.desired.centre;
        rays.direction.push_back(ray.normalized().cast<float>());
        rays.t.push_back(static_cast<float>(ray.norm()));
      };
      for (int i = 0; i < 40; ++i) add({i * apart, 0.5 * i * apart, 0});  // on a line
      for (int i = 0; i < 40; ++i) add({0.1, 0.05, 0});                   // the same
      for (int i = 0; i < 5; ++i)
        add(setup.desired.centre + Eigen::Vector3d(0, 0, 3 + i * apart));  // one behind the other
      WeightTable together;
      OptimumCounts counts;
      WeighOptimal(setup, nullptr, rays, together, counts);
      for (std::size_t i = 0; i < rays.size(); i += 3) {
        const RaySamples one{{rays.direction[i]}, {rays.t[i]}, {}};
        WeightTable alone;
        WeighOptimal(setup, nullptr, one, alone, counts);
        std::vector<double> w(6, 0.0);
        for (std::size_t k = 0; k < alone.camera.size(); ++k)
          w[static_cast<std::size_t>(alone.camera[k])] -= static_cast<double>(alone.weight[k]);
        for (std::int32_t k = together.first[i]; k < together.first[i + 1]; ++k)
          w[static_cast<std::size_t>(together.camera[static_cast<std::size_t>(k)])] +=
              static_cast<double>(together.weight[static_cast<std::size_t>(k)]);
        for (const double difference : w)
          EXPECT_NEAR(difference, 0, accuracy + 1e-6) << "sample " << i << ", " << apart;
      }
    }
  }
}

TEST(HardCase, IndefiniteSimilarityIsClipped) {
  // Neighbours alike, ends not at all: no three directions can be so. Eigenvalue 1 - 0.9 sqrt(2).
  Eigen::Matrix3d S;
  S << 1, 0.9, 0, 0.9, 1, 0.9, 0, 0.9, 1;
  const DenseResult r = SolveDense(S, Eigen::Vector3d(0.5, 0.6, 0.5), Eigen::Vector3d::Ones(), true);
  EXPECT_TRUE(r.clipped);
  EXPECT_TRUE(r.w.allFinite());
  EXPECT_TRUE(r.z.allFinite());
  // What lies in the definite part is solved as it stands.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
  for (Eigen::Index k = 1; k < 3; ++k) {
    const DenseResult one = SolveDense(S, eigen.eigenvectors().col(k), Eigen::Vector3d::Ones(), false);
    EXPECT_NEAR((one.w - eigen.eigenvectors().col(k) / eigen.eigenvalues()[k]).norm(), 0, 1e-9);
  }
  const DenseResult other = SolveDense(S, eigen.eigenvectors().col(0), Eigen::Vector3d::Ones(), false);
  EXPECT_NEAR((other.w * kSmallestEigenvalue - eigen.eigenvectors().col(0)).norm(), 0, 1e-9);
}

TEST(HardCase, NearlySingularSimilarityTakesMoreOnItsDiagonal) {
  Eigen::Matrix2d S;
  S << 1, 1 + 5e-8, 1 + 5e-8, 1;
  const DenseResult r = SolveDense(S, Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d::Ones(), false);
  EXPECT_FALSE(r.clipped);
  EXPECT_GT(r.nugget, kNugget);
  EXPECT_NEAR(r.w.sum(), 0.5, 1e-6);
}

TEST(HardCase, APhotoCrossesTheCutoffWithoutAWeight) {
  const double deg = kRadPerDeg;
  for (const double accuracy : kAccuracies) {
    RadianceSettings settings = Full(accuracy, WeightSum::kRenormalise);
    settings.cutoff_rad = 6 * deg;  // well within reach: y is 0.01 there
    const auto weight = [&](double angle_deg) {
      const double a = angle_deg * deg, b = a - 2 * deg;  // a second photo stays two degrees from the ray
      const Sources s = CamerasAt({{0, 0, -4}, {4 * std::sin(b), 0, -4 * std::cos(b)}});
      return AtOrigin(s, {3 * std::sin(a), 0, -3 * std::cos(a)}, settings).weight[0];
    };
    EXPECT_GT(std::abs(weight(5)), 1e-2);
    double before = weight(5);
    for (double a = 5; a < 6.1; a += 0.01) {
      const double now = weight(a);
      EXPECT_LT(std::abs(now - before), 0.02 * std::abs(weight(5)) + accuracy) << a;
      before = now;
    }
    EXPECT_LT(std::abs(weight(5.99)), 1e-2 * std::abs(weight(5)) + 0.1 * accuracy);
    EXPECT_EQ(weight(6.01), 0);
  }
}

// Along a line of proxy points photos end, and the cutoff passes over others.
TEST(HardCase, WeightsChangeInProportionToTheStep) {
  test::DeskLike desk = test::MakeDeskLike(120);
  RadianceSettings s = Full(1e-6);
  s.cutoff_rad = 6 * kRadPerDeg;  // well within reach: a photo without a feather would enter with 0.01
  const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s);
  std::vector<double> largest;
  for (const double step : {1e-2, 1e-3, 1e-4}) {
    std::vector<Eigen::Vector2d> pixels;
    for (int i = 0; i < 400; ++i)
      pixels.emplace_back(100 + 640 * step * i * (step > 5e-3 ? 0.15 : 1),
                          200 + 100 * step * i * (step > 5e-3 ? 0.15 : 1));
    const RaySamples rays = test::RaysThrough(desk, setup, pixels);
    WeightTable table;
    OptimumCounts counts;
    WeighOptimal(setup, nullptr, rays, table, counts);
    double change = 0;
    std::vector<double> now(120), before;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      std::fill(now.begin(), now.end(), 0.0);
      for (std::int32_t k = table.first[i]; k < table.first[i + 1]; ++k)
        now[static_cast<std::size_t>(table.camera[static_cast<std::size_t>(k)])] =
            static_cast<double>(table.weight[static_cast<std::size_t>(k)]);
      if (!before.empty())
        for (std::size_t j = 0; j < 120; ++j) change = std::max(change, std::abs(now[j] - before[j]));
      before = now;
    }
    largest.push_back(change);
  }
  // Steps of 0.96, 0.64 and 0.064 pixels.
  EXPECT_LT(largest[1], 0.9 * largest[0]);
  EXPECT_LT(largest[2], 0.2 * largest[1]);
}

}  // namespace
}  // namespace lumi
