#include "calibrate/zhang.h"

#include <gtest/gtest.h>

#include "tests/calibrate/synthetic_boards.h"

namespace lumi::test {
namespace {

// Noise-free corners: what is left is rounding times the condition of the linear systems.
constexpr double kTolerance = 1e-8;

Intrinsics WithoutDistortion(bool with_skew) {
  Intrinsics k = TrueIntrinsics();
  k[kK1] = k[kK2] = 0;
  if (!with_skew) k[kSkew] = 0;
  return k;
}

std::vector<Eigen::Matrix3d> Homographies(const Intrinsics& k, const std::vector<TruePose>& poses) {
  std::vector<Eigen::Matrix3d> all;
  for (const BoardView& view : SeenBoards(k, poses)) all.push_back(*PlaneHomography(kBoard.Corners(), view.corners_px));
  return all;
}

TEST(ClosedForm, FindsFiveIntrinsicsOfNoiseFreeCorners) {
  const Intrinsics k = WithoutDistortion(true);
  for (const std::size_t count : {std::size_t{3}, std::size_t{5}, std::size_t{12}}) {
    std::vector<TruePose> poses = GoodPoses();
    poses.erase(poses.begin());
    if (poses.size() > count) poses.resize(count);
    const auto K = ClosedFormCalibration(Homographies(k, poses), true, kWidthPx, kHeightPx);
    ASSERT_TRUE(K) << count;
    EXPECT_NEAR((*K)(0, 0) / k[kFx], 1, kTolerance);
    EXPECT_NEAR((*K)(1, 1) / (k[kFx] * k[kAspect]), 1, kTolerance);
    EXPECT_NEAR((*K)(0, 1), k[kSkew], kTolerance * k[kFx]);
    EXPECT_NEAR((*K)(0, 2), k[kCx], kTolerance * k[kFx]);
    EXPECT_NEAR((*K)(1, 2), k[kCy], kTolerance * k[kFx]);
  }
}

TEST(ClosedForm, FindsFourIntrinsicsOfTwoViewsWithoutSkew) {
  const Intrinsics k = WithoutDistortion(false);
  const std::vector<TruePose> all = GoodPoses();
  const auto K = ClosedFormCalibration(Homographies(k, {all[1], all[3]}), false, kWidthPx, kHeightPx);
  ASSERT_TRUE(K);
  EXPECT_NEAR((*K)(0, 0) / k[kFx], 1, kTolerance);
  EXPECT_NEAR((*K)(1, 1) / (k[kFx] * k[kAspect]), 1, kTolerance);
  EXPECT_NEAR((*K)(0, 1), 0, kTolerance * k[kFx]);
  EXPECT_NEAR((*K)(0, 2), k[kCx], kTolerance * k[kFx]);
}

TEST(ClosedForm, FindsThePoseOfEachView) {
  const Intrinsics k = WithoutDistortion(true);
  const auto homographies = Homographies(k, GoodPoses());
  Eigen::Matrix3d K;
  K << k[kFx], k[kSkew], k[kCx], 0, k[kFx] * k[kAspect], k[kCy], 0, 0, 1;
  for (std::size_t i = 0; i < homographies.size(); ++i) {
    const Rigid3 truth = PoseOf(GoodPoses()[i], k);
    const auto pose = PoseFromHomography(K, homographies[i]);
    ASSERT_TRUE(pose);
    EXPECT_LT((pose->R() - truth.R()).norm(), kTolerance);
    EXPECT_LT((pose->translation - truth.translation).norm(), kTolerance * truth.translation.norm());
  }
}

TEST(ClosedForm, HasNoAnswerForParallelBoards) {
  const Intrinsics k = WithoutDistortion(true);
  for (const double tilt : {0.0, 20.0}) {
    std::vector<TruePose> poses;
    for (TruePose p : GoodPoses()) {
      p.tilt_x_deg = tilt;
      p.tilt_y_deg = p.roll_deg = 0;
      poses.push_back(p);
    }
    EXPECT_FALSE(ClosedFormCalibration(Homographies(k, poses), true, kWidthPx, kHeightPx)) << tilt;
  }
}

TEST(ClosedForm, HasNoHomographyOfALine) {
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < kBoard.CornerCount(); ++i) line.emplace_back(3.0 * i, 5.0 * i);
  EXPECT_FALSE(PlaneHomography(kBoard.Corners(), line));
  EXPECT_FALSE(PlaneHomography({{0, 0}, {1, 0}, {0, 1}}, {{0, 0}, {1, 0}, {0, 1}}));
}

}  // namespace
}  // namespace lumi::test
