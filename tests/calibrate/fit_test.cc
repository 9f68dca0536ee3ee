#include "calibrate/fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "tests/calibrate/synthetic_boards.h"

namespace lumi::test {
namespace {

using testing::HasSubstr;

TEST(Refinement, FindsAllTermsOfNoiseFreeCorners) {
  Intrinsics k = TrueIntrinsics();
  k[kP1] = 1e-3;
  k[kP2] = -7e-4;
  k[kK3] = 0.03;
  FitOptions options;
  options.model = "skew-k1k2pk3";
  const FitResult fit = Fit(kBoard, SeenBoards(k, GoodPoses()), kWidthPx, kHeightPx, options);
  // The solver stops where the error falls by less than 1e-12 of itself.
  for (int term = 0; term < kTermCount; ++term)
    EXPECT_NEAR(fit.calibration.intrinsics[term], k[term], 1e-6 * std::max(1.0, std::abs(k[term]))) << term;
  EXPECT_LT(fit.calibration.rms_px, 1e-6);
}

// 100 captures of one camera: what is reported against how the answers scatter. With 100 samples a standard deviation
// is itself known to 7 %, so 0.8..1.25 is three of those.
TEST(Refinement, StandardDeviationsHoldUpAgainstTheSpread) {
  constexpr int kSets = 100;
  constexpr double kNoisePx = 0.2;
  const Intrinsics k = TrueIntrinsics();
  const std::vector<std::pair<const char*, Term>> terms = {{"fx", kFx},     {"cx", kCx}, {"cy", kCy},
                                                           {"skew", kSkew}, {"k1", kK1}, {"k2", kK2}};
  std::vector<Calibration> fits(kSets);
  const LensModel model = *LensModelFromName("thesis");
  std::vector<Rigid3> poses;
  for (const TruePose& p : GoodPoses()) poses.push_back(PoseOf(p, k));
  ParallelFor(kSets, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s)
      fits[s] = Refine(kBoard, SeenBoards(k, GoodPoses(), kNoisePx, static_cast<unsigned>(100 + s)), {model, 0, 200},
                       {k, poses});
  });
  const auto check = [&](const char* name, const std::function<double(const Calibration&)>& value,
                         const std::function<double(const Calibration&)>& sigma, double truth) {
    double mean = 0, square = 0, reported = 0;
    for (const Calibration& c : fits) {
      ASSERT_TRUE(c.usable) << c.why;
      mean += value(c) / kSets;
      reported += sigma(c) / kSets;
    }
    for (const Calibration& c : fits) square += std::pow(value(c) - mean, 2) / (kSets - 1);
    const double ratio = reported / std::sqrt(square);
    std::printf("%-5s reported %.4g, spread %.4g, ratio %.3f\n", name, reported, std::sqrt(square), ratio);
    EXPECT_GT(ratio, 0.8) << name;
    EXPECT_LT(ratio, 1.25) << name;
    EXPECT_LT(std::abs(mean - truth), 4 * reported / std::sqrt(kSets)) << name << " is biased";
  };
  for (const auto& [name, term] : terms)
    check(
        name, [&, term = term](const Calibration& c) { return c.intrinsics[term]; },
        [&, term = term](const Calibration& c) { return c.Sigma(term, c.noise_px); }, k[term]);
  check(
      "fy", [](const Calibration& c) { return c.Fy(); }, [](const Calibration& c) { return c.SigmaFy(c.noise_px); },
      k[kFx] * k[kAspect]);
}

TEST(ModelChoice, TakesTheFewestTermsThatTheDataCallFor) {
  struct Case {
    const char* wanted;
    std::vector<std::pair<Term, double>> set;
  };
  const std::vector<Case> cases = {
      {"square-none", {}},
      {"square-k1k2", {{kK1, -0.25}, {kK2, 0.12}}},
      {"rect-k1", {{kAspect, 1.02}, {kK1, -0.2}}},
      {"skew-k1k2", {{kAspect, 1.02}, {kSkew, 3}, {kK1, -0.25}, {kK2, 0.12}}},
      {"square-k1k2p", {{kK1, -0.25}, {kK2, 0.12}, {kP1, 4e-3}, {kP2, -3e-3}}},
  };
  // A term without need is taken now and then, where noise makes it three of its standard deviations; one that is
  // needed is never left out.
  int exact = 0, all = 0;
  for (const Case& c : cases) {
    Intrinsics k = NominalIntrinsics(600, kWidthPx, kHeightPx);
    for (const auto& [term, value] : c.set) k[term] = value;
    for (const unsigned seed : {7U, 8U}) {
      const FitResult fit = Fit(kBoard, SeenBoards(k, GoodPoses(), 0.15, seed), kWidthPx, kHeightPx, {});
      const LensModel wanted = *LensModelFromName(c.wanted);
      for (std::size_t term = 0; term < kTermCount; ++term)
        EXPECT_TRUE(!wanted.free[term] || fit.calibration.model.free[term])
            << c.wanted << " needs term " << term << ": " << fit.calibration.model.name;
      EXPECT_LE(fit.calibration.model.FreeCount(), wanted.FreeCount() + 1)
          << c.wanted << ": " << fit.calibration.model.name;
      exact += fit.calibration.model.name == c.wanted;
      ++all;
      EXPECT_EQ(fit.trials.size(), LensModels().size());
    }
  }
  EXPECT_GE(exact, all - 2);
}

TEST(ModelChoice, HeldOutErrorIsNoSmallerThanTheFitted) {
  const FitResult fit = Fit(kBoard, SeenBoards(TrueIntrinsics(), GoodPoses(), 0.2, 3), kWidthPx, kHeightPx, {});
  ASSERT_TRUE(fit.cross_validated_rms_px);
  EXPECT_GT(*fit.cross_validated_rms_px, fit.calibration.rms_px);
  EXPECT_LT(*fit.cross_validated_rms_px, 1.1 * fit.calibration.rms_px);
}

TEST(ModelChoice, AFixedAspectIsFixed) {
  FitOptions options;
  options.fix_aspect = true;
  Intrinsics k = TrueIntrinsics();
  k[kAspect] = 1;
  const FitResult fit = Fit(kBoard, SeenBoards(k, GoodPoses(), 0.1, 3), kWidthPx, kHeightPx, options);
  EXPECT_EQ(fit.calibration.intrinsics[kAspect], 1);
  EXPECT_EQ(fit.calibration.Sigma(kAspect, 1), 0);
  for (const ModelTrial& trial : fit.trials) EXPECT_THAT(trial.model.name, testing::StartsWith("square"));
  options.model = "thesis";
  EXPECT_THAT(options.Problem(), HasSubstr("aspect"));
}

TEST(Outliers, AViewOfAnotherCameraIsRefused) {
  const Intrinsics k = TrueIntrinsics();
  std::vector<BoardView> views = SeenBoards(k, GoodPoses(), 0.1, 5);
  Intrinsics zoomed = k;
  zoomed[kFx] *= 1.2;
  zoomed[kCx] -= 60;
  views[4] = Seen(PoseOf(GoodPoses()[4], k), zoomed, "zoomed");
  const FitResult fit = Fit(kBoard, views, kWidthPx, kHeightPx, {});
  ASSERT_EQ(fit.refused.size(), 1U);
  EXPECT_EQ(fit.refused[0].name, "zoomed");
  EXPECT_THAT(fit.refused[0].reason, HasSubstr("outlier"));
  EXPECT_NEAR(fit.calibration.intrinsics[kFx], k[kFx], 3 * fit.calibration.Sigma(kFx, fit.calibration.noise_px) + 1e-9);
}

// The mirror image of a camera is a camera, only its principal point lies on the other side of the middle: that gives
// it away.
TEST(Outliers, AMirroredPhotoIsNamed) {
  Intrinsics k = TrueIntrinsics();
  k[kCx] = 345;
  std::vector<BoardView> views = SeenBoards(k, GoodPoses(), 0.1, 5);
  for (const std::size_t v : {std::size_t{2}, std::size_t{7}}) {
    const BoardView truth = views[v];
    for (int j = 0; j < kBoard.rows; ++j)
      for (int i = 0; i < kBoard.columns; ++i) {
        const auto& c = truth.corners_px[static_cast<std::size_t>(j * kBoard.columns + kBoard.columns - 1 - i)];
        views[v].corners_px[static_cast<std::size_t>(j * kBoard.columns + i)] = {kWidthPx - c.x(), c.y()};
      }
  }
  const FitResult fit = Fit(kBoard, views, kWidthPx, kHeightPx, {});
  ASSERT_EQ(fit.refused.size(), 2U);
  for (const RefusedView& refused : fit.refused) EXPECT_THAT(refused.reason, HasSubstr("mirrored")) << refused.name;
}

TEST(Outliers, SingleCornersAreLeftOut) {
  const Intrinsics k = TrueIntrinsics();
  std::vector<BoardView> views = SeenBoards(k, GoodPoses(), 0.1, 5);
  views[3].corners_px[10] += Eigen::Vector2d(4, -3);
  views[8].corners_px[33] += Eigen::Vector2d(-2, 5);
  const FitResult fit = Fit(kBoard, views, kWidthPx, kHeightPx, {});
  EXPECT_EQ(fit.corners_left_out, 2);
  EXPECT_TRUE(fit.refused.empty());
  EXPECT_NEAR(fit.calibration.intrinsics[kFx], k[kFx], 3 * fit.calibration.Sigma(kFx, fit.calibration.noise_px));
}

TEST(Tradeoff, MoreViewsLeaveLessUncertainty) {
  const FitResult fit = Fit(kBoard, SeenBoards(TrueIntrinsics(), GoodPoses(), 0.2, 3), kWidthPx, kHeightPx, {});
  const auto trials = ViewCountTradeoff(kBoard, fit, 0);
  ASSERT_GE(trials.size(), 4U);
  EXPECT_EQ(trials.front().views, 3);
  EXPECT_EQ(trials.back().views, 12);
  EXPECT_GT(trials.front().sigma_f_percent, 1.5 * trials.back().sigma_f_percent);
  EXPECT_GT(trials.front().held_out_rms_px, trials.back().held_out_rms_px);
}

}  // namespace
}  // namespace lumi::test
