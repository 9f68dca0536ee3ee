#include "calibrate/fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calibrate/choose_model.h"
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
        name, [t = term](const Calibration& c) { return c.intrinsics[t]; },
        [t = term](const Calibration& c) { return c.Sigma(t, c.noise_px); }, k[term]);
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

// Fits that do as well on the boards, with these focal lengths; models from few terms to many.
std::vector<HeldOutFit> FitsWith(const std::vector<std::pair<double, double>>& focal_and_sigma) {
  std::vector<HeldOutFit> fits;
  for (const auto& [focal, sigma] : focal_and_sigma) {
    HeldOutFit& fit = fits.emplace_back();
    fit.all.intrinsics = NominalIntrinsics(focal, kWidthPx, kHeightPx);
    fit.all.noise_px = 0.1;
    fit.all.unit_covariance(kFx, kFx) = std::pow(sigma / fit.all.noise_px, 2);
    fit.all.usable = true;
    fit.rms_px = 0.2;
    fit.squares.assign(12, 1);
  }
  return fits;
}

// The leanest of the models that do as well has a focal length of its own: the next one is taken, and what is left of
// their disagreement is in the standard deviation.
TEST(ModelChoice, AFocalLengthThatTheOthersDoNotShareIsNotTaken) {
  const std::vector<LensModel> all = LensModels(true);
  const std::vector<LensModel> models(all.begin(), all.begin() + 6);
  const ModelChoice apart =
      ChooseModel(models, FitsWith({{705.07, 0.7}, {702.4, 0.8}, {702, 0.9}, {701.5, 1}, {703, 1}, {701.8, 1.2}}));
  EXPECT_EQ(models[apart.model].name, models[1].name);
  EXPECT_THAT(apart.why, testing::AllOf(HasSubstr(models[0].name), HasSubstr("705.07")));
  EXPECT_GT(apart.spread_px.fx, 0.8);  // as far as the lean one's answer carries
  EXPECT_LT(apart.spread_px.fx, 1.5);
  EXPECT_EQ(std::ranges::count(apart.as_good, 1), 6);
  // It shares theirs within its noise, or within how much they scatter: the fewest terms it is.
  for (const double sigma : {2.0, 0.7}) {
    const double scatter = sigma > 1 ? 1 : 3;
    const ModelChoice shared = ChooseModel(models, FitsWith({{705.07, sigma},
                                                             {702 + scatter, 0.8},
                                                             {702, 0.9},
                                                             {702 - scatter, 1},
                                                             {702 + 2 * scatter, 1},
                                                             {702 - 2 * scatter, 1.2}}));
    EXPECT_EQ(shared.model, 0U) << sigma;
  }
  // Answers that differ by no more than their noise does add nothing.
  EXPECT_EQ(ChooseModel(models, FitsWith({{702, 0.5}, {702.6, 0.9}, {701.5, 0.9}, {702.4, 1.1}, {702, 1}, {702, 1}}))
                .spread_px.fx,
            0);
  // A model that does worse has no say.
  std::vector<HeldOutFit> fits =
      FitsWith({{705.07, 0.7}, {702.4, 0.8}, {702, 0.9}, {701.5, 1}, {703, 1}, {701.8, 1.2}});
  for (const std::size_t m : {0U, 4U}) {
    fits[m].rms_px = 0.4;
    for (std::size_t v = 0; v < fits[m].squares.size(); ++v) fits[m].squares[v] = 3.9 + 0.01 * static_cast<double>(v);
  }
  const ModelChoice worse = ChooseModel(models, fits);
  EXPECT_EQ(worse.model, 1U);
  EXPECT_EQ(std::ranges::count(worse.as_good, 1), 4);
  EXPECT_THAT(worse.why, testing::Not(HasSubstr("705.07")));
}

// Few boards, and a lens whose small terms they hardly show: models with and without them do as well and differ in the
// focal length. Over 24 captures the answers' errors are what the standard deviations say, which those of noise alone
// are not.
TEST(ModelChoice, StandardDeviationsHoldWhereTheModelIsChosenToo) {
  constexpr int kSets = 24;
  constexpr double kNoisePx = 0.3;
  Intrinsics k = NominalIntrinsics(700, kWidthPx, kHeightPx);
  k[kCx] += 6;
  k[kCy] -= 4;
  k[kK1] = -0.08;
  k[kK2] = 0.03;
  k[kP1] = 8e-4;
  const std::vector<TruePose> all = GoodPoses();
  const std::vector<TruePose> few(all.begin() + 1, all.begin() + 9);
  double by_noise = 0, by_all = 0, bias = 0;
  for (unsigned seed = 1; seed <= kSets; ++seed) {
    const FitResult fit = Fit(kBoard, SeenBoards(k, few, kNoisePx, seed), kWidthPx, kHeightPx, {});
    const double error = fit.calibration.intrinsics[kFx] - k[kFx];
    bias += error / kSets;
    by_noise += std::pow(error / fit.calibration.Sigma(kFx, fit.calibration.noise_px), 2) / kSets;
    by_all += std::pow(error / fit.PixelSigmas().fx, 2) / kSets;
  }
  std::printf("errors over standard deviations, rms: %.2f by noise alone, %.2f; mean error %.3f px\n",
              std::sqrt(by_noise), std::sqrt(by_all), bias);
  EXPECT_LT(by_all, by_noise);
  EXPECT_LT(std::sqrt(by_all), 1.5);
}

TEST(ModelChoice, HeldOutErrorIsNoSmallerThanTheFitted) {
  const FitResult fit = Fit(kBoard, SeenBoards(TrueIntrinsics(), GoodPoses(), 0.2, 3), kWidthPx, kHeightPx, {});
  ASSERT_TRUE(fit.cross_validated_rms_px);
  EXPECT_GT(*fit.cross_validated_rms_px, fit.calibration.rms_px);
  EXPECT_LT(*fit.cross_validated_rms_px, 1.1 * fit.calibration.rms_px);
}

TEST(ModelChoice, FoldsLeaveThreeViewsHoweverFewAreAskedFor) {
  const std::vector<BoardView> all = SeenBoards(TrueIntrinsics(), GoodPoses(), 0.2, 3);
  for (const std::ptrdiff_t views : {4, 5}) {
    FitOptions options;
    options.folds = 2;
    options.min_coverage = 0;
    options.max_focal_sigma = 1;
    const FitResult fit = Fit(kBoard, {all.begin(), all.begin() + views}, kWidthPx, kHeightPx, options);
    EXPECT_TRUE(fit.cross_validated_rms_px) << views;
  }
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
