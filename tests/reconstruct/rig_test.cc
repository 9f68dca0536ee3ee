#include "reconstruct/rig.h"

#include <gtest/gtest.h>

#include "reconstruct/nelder_mead.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kExact = 1e-12;

TEST(RingPose, CamerasStandOnACircleAndSeeItsCentreInTheMiddle) {
  RingGeometry ring;
  ring.elevation_rad = 20 * kRadPerDeg;
  ring.step_rad = 10 * kRadPerDeg;
  for (int i = 0; i < 36; ++i) {
    const Rigid3 pose = RingPose(ring, i);
    const Eigen::Vector3d eye = pose.OriginInSource();
    EXPECT_NEAR(eye.norm(), 1, kExact);
    EXPECT_NEAR(eye.z(), std::sin(ring.elevation_rad), kExact);
    EXPECT_NEAR(std::atan2(eye.y(), eye.x()), std::remainder(i * ring.step_rad, 360 * kRadPerDeg), 1e-9);
    EXPECT_LT((pose * Eigen::Vector3d::Zero() - Eigen::Vector3d(0, 0, 1)).norm(), kExact);
    EXPECT_LT((pose.R() * Eigen::Vector3d::UnitZ()).y(), 0);  // up is up in the image
  }
}

TEST(RingPose, TiltAndPanMoveTheCentreInTheImage) {
  RingGeometry ring;
  ring.tilt_rad = 2 * kRadPerDeg;
  ring.pan_rad = 3 * kRadPerDeg;
  const Eigen::Vector3d centre = RingPose(ring, 5) * Eigen::Vector3d::Zero();
  // The axis passes below the centre, which is seen above the middle; and to its right: seen on the left.
  EXPECT_LT(centre.y(), 0);
  EXPECT_LT(centre.x(), 0);
  EXPECT_NEAR(centre.norm(), 1, kExact);
}

TEST(RingPose, OppositeStepsTurnTheOtherWay) {
  RingGeometry ring;
  ring.step_rad = 0.3;
  RingGeometry other = ring;
  other.step_rad = -0.3;
  EXPECT_LT((RingPose(ring, 2).Matrix() - RingPose(other, -2).Matrix()).cwiseAbs().maxCoeff(), kExact);
}

TEST(GridPose, CamerasAreParallel) {
  const Rigid3 pose = GridPose(3, 2);
  EXPECT_LT((pose.OriginInSource() - Eigen::Vector3d(3, 2, 0)).norm(), kExact);
  EXPECT_LT((pose * Eigen::Vector3d(3, 2, 7) - Eigen::Vector3d(0, 0, 7)).norm(), kExact);
}

TEST(GridSize, IsRowsTimesColumns) {
  EXPECT_EQ(ParseGridSize("17x16"), std::pair(17, 16));
  for (const char* wrong : {"", "17", "17x", "x17", "0x4", "-1x4", "3x4x5", "axb"}) EXPECT_THROW(ParseGridSize(wrong), UsageError) << wrong;
}

TEST(NelderMead, FindsTheMinimumOfRosenbrocksValley) {
  const auto rosenbrock = [](const std::vector<double>& x) { return 100 * std::pow(x[1] - x[0] * x[0], 2) + std::pow(1 - x[0], 2); };
  const auto x = NelderMead(rosenbrock, {-1.2, 1}, {0.1, 0.1}, 2000, 1e-14);
  EXPECT_NEAR(x[0], 1, 1e-4);
  EXPECT_NEAR(x[1], 1, 1e-4);
}

TEST(NelderMead, AStepOfZeroHoldsTheVariable) {
  const auto bowl = [](const std::vector<double>& x) { return x[0] * x[0] + x[1] * x[1]; };
  const auto x = NelderMead(bowl, {3, 2}, {0, 0.5});
  EXPECT_EQ(x[0], 3);
  EXPECT_NEAR(x[1], 0, 1e-3);
}

}  // namespace
}  // namespace lumi
