// The families in closed form: what a camera without a shake shows is found exactly, a shaky one's path is smooth and
// near.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "stabilize/motion_models.h"
#include "tests/stabilize/walks.h"

namespace lumi {
namespace {

using namespace test;

constexpr double kExactPx = 1e-4;  // of a fit by iterations that stop at a relative decrease of 1e-10
constexpr double kJitterPx =
    0.1;  // above 1 Hz of a path that is smooth by its form; what is left is of points that pass near by

std::vector<Matrix34d> Fitted(const Walk& walk, MotionModel model, const Telling& telling = {},
                              ModelFit* out = nullptr) {
  const FilmedScene film = ReadWalk(walk, telling);
  ModelFitOptions options;
  if (model == MotionModel::kVertigo) {
    // The object's points by their place in the scene: all points are told in their order, those hardly seen left out.
    for (std::size_t i = film.X.size() - walk.object.size(); i < film.X.size(); ++i)
      options.object.push_back(static_cast<std::int32_t>(i));
  }
  const ModelFit fit = FitModel(film, model, options);
  if (out) *out = fit;
  return InWalk(film, fit.P, telling);
}

Telling In(const Walk& walk, double condition, unsigned seed, const Eigen::Vector3d& tilt = Eigen::Vector3d::Zero()) {
  Telling telling;
  telling.world_from_walk = ProjectiveFrame(walk, condition, seed);
  telling.plane_tilt = tilt;
  return telling;
}

TEST(Linear, IsFoundExactlyInAnyProjectiveFrameWhateverThePlaneAtInfinity) {
  for (const Walk& walk : {Forward(40, kStill), Sideways(40, kStill), Diagonal(40, kStill)})
    for (const unsigned seed : {1U, 2U}) {
      const Telling telling = In(walk, 100, seed, {0.003, -0.004, 0.008});
      ModelFit fit;
      EXPECT_LT(LargestDistancePx(walk, Fitted(walk, MotionModel::kLinear, telling, &fit), walk.ideal), kExactPx);
      EXPECT_LT(fit.rms * 320, kExactPx);
    }
}

TEST(Linear, AFewFramesThatAreKnockedAsideDoNotTakeThePathAlong) {
  // Four of sixty matrices are turned by 6 degrees, all to one side: 57 px, of which a mean over all frames would
  // take 4.
  Walk walk = Sideways(60, kStill);
  Eigen::Matrix3d K;
  K << kFocalPx, 0, 0.5 * kWidthPx, 0, kFocalPx, 0.5 * kHeightPx, 0, 0, 1;
  const Eigen::Matrix3d knock =
      K * Eigen::AngleAxisd(6 * kRadPerDeg, Eigen::Vector3d::UnitY()).toRotationMatrix() * K.inverse();
  for (const std::size_t t : {12U, 27U, 28U, 45U}) walk.shaky[t] = knock * walk.shaky[t];
  EXPECT_LT(LargestDistancePx(walk, Fitted(walk, MotionModel::kLinear), walk.ideal),
            0.5);  // measured 0.09; 8.8 where all frames weigh the same
}

TEST(Linear, ForwardMotionFollowsTheReciprocalOfTimeAboutTheFocus) {
  const Walk walk = Forward(60, kStill);
  ModelFit fit;
  const auto P = Fitted(walk, MotionModel::kLinear, {}, &fit);
  ASSERT_TRUE(fit.focus_of_expansion);
  const Eigen::Vector2d focus = fit.focus_of_expansion->hnormalized() * 320 + Eigen::Vector2d(320, 180);
  int tried = 0;
  for (std::size_t j = 0; j < walk.X.size(); j += 25) {
    // 1/r is linear in t (erratum: r = c / |t - t0|), and the direction from the focus stays.
    std::vector<double> reciprocal;
    Eigen::Vector2d first(0, 0);
    for (const std::size_t t : {0U, 20U, 40U}) {
      const Eigen::Vector2d r = Eigen::Vector3d(P[t] * walk.X[j]).hnormalized() - focus;
      if (t == 0) first = r.normalized();
      EXPECT_NEAR(std::abs(first.dot(r.normalized())), 1, 1e-9);
      reciprocal.push_back(1 / r.norm());
    }
    EXPECT_NEAR(reciprocal[1], 0.5 * (reciprocal[0] + reciprocal[2]), 1e-9 * reciprocal[1]);
    ++tried;
  }
  EXPECT_GT(tried, 20);
  // The true focus is where the translation points to: (0,0,1) seen by a camera that looks along (0.02, 0.01, 1).
  EXPECT_NEAR(focus.x(), 320 - 0.02 * kFocalPx, 0.1);
  EXPECT_NEAR(focus.y(), 180 - 0.01 * kFocalPx, 0.1);
}

TEST(Linear, SidewaysMotionIsLinearInTime) {
  const Walk walk = Sideways(60, kStill);
  ModelFit fit;
  const auto P = Fitted(walk, MotionModel::kLinear, {}, &fit);
  EXPECT_LT(std::abs(fit.focus_of_expansion->z()), 1e-6);  // at infinity: no quotient anywhere
  for (std::size_t j = 0; j < walk.X.size(); j += 25) {
    const auto x = [&](std::size_t t) { return Eigen::Vector2d(Eigen::Vector3d(P[t] * walk.X[j]).hnormalized()); };
    EXPECT_LT((x(10) - 2 * x(30) + x(50)).norm(), kExactPx);
  }
}

TEST(Vertigo, IsFoundExactlyAndFollowsItsLaw) {
  for (const double aside : {0.0, 1.2}) {
    const Walk walk = Vertigo(60, aside, kStill);
    ModelFit fit;
    const auto P = Fitted(walk, MotionModel::kVertigo, In(walk, 50, 3, {0.002, 0.003, 0.004}), &fit);
    EXPECT_LT(LargestDistancePx(walk, P, walk.ideal), 1e-3);
    // r(t) = r0 (1 - t) / (1 - rho t) about the focus of expansion, which is the true one, not the object's middle.
    const Eigen::Vector2d focus = fit.focus_of_expansion->hnormalized() * 320 + Eigen::Vector2d(320, 180);
    EXPECT_NEAR(focus.x(), 320, 0.01);
    EXPECT_NEAR(focus.y(), 180, 0.01);
    for (std::size_t j = 0; j < 500; j += 25) {
      const double rho = 6 / walk.X[j].z(), r0 = (Eigen::Vector3d(P[0] * walk.X[j]).hnormalized() - focus).norm();
      for (const std::size_t t : {20U, 59U}) {
        const double time = 2.5 / 6 * static_cast<double>(t) / 59;
        EXPECT_NEAR((Eigen::Vector3d(P[t] * walk.X[j]).hnormalized() - focus).norm(),
                    r0 * (1 - time) / (1 - rho * time), 1e-2);
      }
    }
  }
}

TEST(Circular, IsFoundExactlyFromFiveDegreesToTheWholeCircle) {
  for (const double arc : {5.0, 40.0, 120.0, 350.0}) {
    const Walk walk = Around(60, arc, kStill);
    ModelFit fit;
    const auto P =
        Fitted(walk, MotionModel::kCircular,
               In(walk, 10, 4, arc < 100 ? Eigen::Vector3d(0.004, 0.002, -0.005) : Eigen::Vector3d::Zero()), &fit);
    EXPECT_LT(LargestDistancePx(walk, P, walk.ideal), 0.01) << arc;
    EXPECT_NEAR(std::abs(fit.turn_rad) * 180 / std::numbers::pi, arc, 0.02 * arc) << arc;
  }
}

TEST(Circular, PointsRunThroughConics) {
  const Walk walk = Around(90, 100);
  const auto P = Fitted(walk, MotionModel::kCircular);
  // Six images of a point lie on one conic: the determinant of their monomials vanishes, against five and one moved by
  // a pixel.
  for (std::size_t j = 0; j < 200; j += 20) {
    const auto determinant = [&](double moved) {
      Eigen::Matrix<double, 6, 6> M;
      for (int i = 0; i < 6; ++i) {
        Eigen::Vector2d x = Eigen::Vector3d(P[static_cast<std::size_t>(17 * i)] * walk.X[j]).hnormalized();
        if (i == 3) x.y() += moved;
        x = (x - Eigen::Vector2d(320, 180)) / 320;
        M.row(i) << x.x() * x.x(), x.x() * x.y(), x.y() * x.y(), x.x(), x.y(), 1;
      }
      return M.determinant();
    };
    EXPECT_LT(std::abs(determinant(0)), 1e-3 * std::abs(determinant(1)) + 1e-15);
  }
}

TEST(Shake, IsNotInThePathsOfFamilies) {
  const auto expect = [](const Walk& walk, MotionModel model, const char* what) {
    Telling telling;
    telling.noise_px = 0.3;
    telling.plane_tilt = {0.004, -0.003, 0.01};
    const double before = JitterPx(walk, walk.shaky);
    EXPECT_GT(before, 5) << what;
    EXPECT_LT(JitterPx(walk, Fitted(walk, model, telling)), kJitterPx) << what;
  };
  expect(Forward(100), MotionModel::kLinear, "forward");
  expect(Sideways(100), MotionModel::kLinear, "sideways");
  expect(Diagonal(100), MotionModel::kLinear, "diagonal");
  expect(Vertigo(100), MotionModel::kVertigo, "vertigo");
  expect(Vertigo(100, 1.2), MotionModel::kVertigo, "vertigo, object aside");
  expect(Around(150, 40), MotionModel::kCircular, "around, 40 degrees");
  expect(Around(150, 200), MotionModel::kCircular, "around, 200 degrees");
}

TEST(Vertigo, KeepsTheObjectsSizeWithinAPercent) {
  for (const double aside : {0.0, 1.2}) {
    const Walk walk = Vertigo(150, aside);
    const auto sizes = ObjectSizes(walk, Fitted(walk, MotionModel::kVertigo)), shaky = ObjectSizes(walk, walk.shaky);
    const auto spread = [](const std::vector<double>& s) {
      return *std::max_element(s.begin(), s.end()) / *std::min_element(s.begin(), s.end()) - 1;
    };
    EXPECT_GT(spread(shaky), 0.02);
    EXPECT_LT(spread(sizes), 0.01);
  }
}

TEST(Circular, IsRefusedByNameWhereTheShakeHidesTheArc) {
  for (const Walk& walk : {Sideways(90), Sideways(90, kStill), Forward(90), Around(90, 5)}) {
    try {
      Fitted(walk, MotionModel::kCircular);
      ADD_FAILURE() << "accepted";
    } catch (const DataError& e) {
      EXPECT_EQ(std::string(e.what()).find("circular: "), 0U) << e.what();
      EXPECT_FALSE(e.hint().empty());
    }
  }
  Fitted(Around(90, 5, {3e-4, 3e-4, 0, 0, 1}), MotionModel::kCircular);  // a steadier hand's arc shows
}

}  // namespace
}  // namespace lumi
