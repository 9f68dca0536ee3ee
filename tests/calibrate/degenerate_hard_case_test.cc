// Sets that do not determine a camera, approached step by step: a right answer with an honest standard deviation, or a
// refusal by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "calibrate/fit.h"
#include "calibrate/uncertainty.h"
#include "scene/program/error.h"
#include "tests/calibrate/synthetic_boards.h"

namespace lumi::test {
namespace {

using testing::HasSubstr;

FitOptions Quick() {
  FitOptions options;
  options.model = "square-k1k2";
  return options;
}

Intrinsics Truth() {
  Intrinsics k = NominalIntrinsics(612, kWidthPx, kHeightPx);
  k[kCx] = 327;
  k[kK1] = -0.2;
  k[kK2] = 0.05;
  return k;
}

// The refusal's text; empty where there was an answer, which then has to be right.
std::string RefusalOf(const std::vector<BoardView>& views, const FitOptions& options = Quick()) {
  try {
    const FitResult fit = Fit(kBoard, views, kWidthPx, kHeightPx, options);
    const Calibration& c = fit.calibration;
    EXPECT_TRUE(c.intrinsics.allFinite() && c.unit_covariance.allFinite());
    EXPECT_LT(std::abs(c.intrinsics[kFx] - Truth()[kFx]), 4 * c.Sigma(kFx, c.noise_px) + 1e-5);
    return {};
  } catch (const DataError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    EXPECT_FALSE(e.hint().empty());
    return e.what();
  }
}

std::vector<TruePose> Tilted(double share) {
  std::vector<TruePose> poses = GoodPoses();
  for (TruePose& p : poses) p.tilt_x_deg *= share, p.tilt_y_deg *= share;
  return poses;
}

TEST(DegenerateSets, FrontalBoardsAreRefusedByNameAndTiltedOnesAnswered) {
  for (const double noise_px : {0.0, 0.2}) {
    EXPECT_EQ(RefusalOf(SeenBoards(Truth(), Tilted(1), noise_px)), "");
    for (const double share : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2})
      EXPECT_THAT(RefusalOf(SeenBoards(Truth(), Tilted(share), noise_px)), HasSubstr("parallel")) << share;
    // Between: either, but never a wrong answer.
    for (const double share : {0.03, 0.1, 0.2, 0.4}) RefusalOf(SeenBoards(Truth(), Tilted(share), noise_px));
  }
}

TEST(DegenerateSets, FrontalBoardsAreRefusedWhateverTheModel) {
  FitOptions chosen;
  EXPECT_THAT(RefusalOf(SeenBoards(Truth(), Tilted(0), 0.2), chosen), HasSubstr("parallel"));
  FitOptions thesis;
  thesis.model = "thesis";
  EXPECT_THAT(RefusalOf(SeenBoards(Truth(), Tilted(0), 0.2), thesis), HasSubstr("parallel"));
}

TEST(DegenerateSets, OneViewManyTimesIsParallel) {
  const std::vector<TruePose> same(10, {0, 0, 300, 30, -20, 10});
  for (const double noise_px : {0.0, 0.2}) {
    const std::string refusal = RefusalOf(SeenBoards(Truth(), same, noise_px));
    EXPECT_THAT(refusal, testing::AnyOf(HasSubstr("parallel"), HasSubstr("cover"))) << noise_px;
  }
}

TEST(DegenerateSets, FewViewsAreRefusedByNumber) {
  const auto all = SeenBoards(Truth(), GoodPoses(), 0.1);
  EXPECT_THAT(RefusalOf({}), HasSubstr("no board"));
  EXPECT_THAT(RefusalOf({all[1]}), HasSubstr("one view"));
  EXPECT_THAT(RefusalOf({all[1], all[3]}), HasSubstr("two views"));
  EXPECT_EQ(RefusalOf({all[1], all[3], all[4], all[6]}), "");
}

TEST(DegenerateSets, BoardsInOneCornerAreRefusedByPlace) {
  std::vector<TruePose> poses = GoodPoses();
  for (TruePose& p : poses) p.x = -0.55 + 0.1 * p.x, p.y = -0.55 + 0.1 * p.y, p.distance_mm *= 2.2;
  EXPECT_THAT(RefusalOf(SeenBoards(Truth(), poses, 0.1)),
              testing::AllOf(HasSubstr("cover"), HasSubstr("upper left corner")));
}

TEST(DegenerateSets, AMirroredBoardIsRefusedByName) {
  auto views = SeenBoards(Truth(), GoodPoses(), 0.1);
  for (BoardView& view : views)
    for (std::size_t row = 0; row < view.corners_px.size(); row += 9)
      std::reverse(view.corners_px.begin() + static_cast<std::ptrdiff_t>(row),
                   view.corners_px.begin() + static_cast<std::ptrdiff_t>(row + 9));
  EXPECT_THAT(RefusalOf(views), HasSubstr("mirrored"));
}

TEST(DegenerateSets, CornersOnALineAreRefused) {
  auto views = SeenBoards(Truth(), GoodPoses(), 0.1);
  for (std::size_t i = 0; i < views[2].corners_px.size(); ++i)
    views[2].corners_px[i] = {3.0 * static_cast<double>(i), 100};
  EXPECT_THAT(RefusalOf(views), HasSubstr("line"));
}

TEST(DegenerateSets, ViewsOfManyCamerasContradictOneAnother) {
  std::vector<BoardView> views;
  for (std::size_t i = 0; i < GoodPoses().size(); ++i) {
    Intrinsics k = Truth();
    k[kFx] *= 1 + 0.12 * static_cast<double>(i % 4);
    k[kCx] += 40.0 * static_cast<double>(i % 3) - 40;
    views.push_back(Seen(PoseOf(GoodPoses()[i], k), k, "view" + std::to_string(i)));
  }
  // Whatever it makes of them, no confident answer: refused, or said to be uncertain.
  try {
    const FitResult fit = Fit(kBoard, views, kWidthPx, kHeightPx, Quick());
    EXPECT_GT(fit.calibration.Sigma(kFx, fit.calibration.noise_px), 1);
  } catch (const DataError& e) {
    SUCCEED();
  }
}

TEST(DegenerateSets, AWideLensIsFoundFromAnyStart) {
  Intrinsics k = NominalIntrinsics(280, kWidthPx, kHeightPx);
  k[kK1] = -0.25;
  k[kK2] = 0.07;
  k[kK3] = -0.009;
  std::vector<TruePose> poses = GoodPoses();
  for (TruePose& p : poses) p.distance_mm *= 0.55;
  FitOptions options;
  options.model = "square-k1k2k3";
  const FitResult fit = Fit(kBoard, SeenBoards(k, poses, 0.05), kWidthPx, kHeightPx, options);
  EXPECT_NEAR(fit.calibration.intrinsics[kFx], k[kFx], 4 * fit.calibration.Sigma(kFx, fit.calibration.noise_px));
}

// With less noise by a factor the map is smaller by that factor, and it is finite everywhere.
TEST(Uncertainty, FollowsTheNoise) {
  FitOptions options;
  options.model = "thesis";
  const auto map = [&](double noise_px) {
    return ProjectionUncertainty(
        Fit(kBoard, SeenBoards(TrueIntrinsics(), GoodPoses(), noise_px, 9), kWidthPx, kHeightPx, options).calibration,
        kWidthPx, kHeightPx);
  };
  const UncertaintyMap coarse = map(0.2), fine = map(0.02);
  for (const double sigma : coarse.sigma_px) EXPECT_TRUE(std::isfinite(sigma));
  EXPECT_NEAR(coarse.median_px / fine.median_px, 10, 0.5);
  EXPECT_LT(coarse.median_px, 0.5);
}

}  // namespace
}  // namespace lumi::test
