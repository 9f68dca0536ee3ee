#include "reconstruct/ring.h"

#include <cmath>
#include <random>

#include "database_fixture.h"
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

TEST(RingPose, PanAndRollTurnTheCameraWhereItStands) {
  RingGeometry ring;
  ring.pan_rad = 3 * kRadPerDeg;
  const Eigen::Vector3d centre = RingPose(ring, 5) * Eigen::Vector3d::Zero();
  EXPECT_LT(centre.x(), 0);  // the axis passes to its right: it is seen on the left
  EXPECT_NEAR(centre.norm(), 1, kExact);
  RingGeometry rolled;
  rolled.roll_rad = 5 * kRadPerDeg;
  const Eigen::Vector3d up = RingPose(rolled, 5).R() * Eigen::Vector3d::UnitZ();
  EXPECT_LT(up.x(), 0);  // the camera turned clockwise: the world leans to the left
  EXPECT_LT((RingPose(rolled, 5).OriginInSource() - RingPose(RingGeometry{}, 5).OriginInSource()).norm(), kExact);
}

TEST(RingPose, OppositeStepsTurnTheOtherWay) {
  RingGeometry ring;
  ring.step_rad = 0.3;
  RingGeometry other = ring;
  other.step_rad = -0.3;
  EXPECT_LT((RingPose(ring, 2).Matrix() - RingPose(other, -2).Matrix()).cwiseAbs().maxCoeff(), kExact);
}

// Photos of random points on a turntable, with matches between neighbours; every eighth match is wrong.
Capture MakeRing(const std::filesystem::path& database, const RingGeometry& truth, int n) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> coordinate(-0.12, 0.12);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 150; ++i) points.emplace_back(coordinate(random), coordinate(random), coordinate(random));
  const Camera camera = Camera::Pinhole(640, 480, truth.focal_px, truth.focal_px, 320, 240);
  TestDatabase db(database);
  Capture capture;
  for (int v = 0; v < n; ++v) {
    InputPhoto photo;
    photo.name = (v < 10 ? "p0" : "p") + std::to_string(v) + ".jpg";
    photo.width_px = 640;
    photo.height_px = 480;
    capture.photos.push_back(photo);
    std::vector<Eigen::Vector2d> keypoints;
    for (const auto& X : points) keypoints.push_back(*camera.Project(RingPose(truth, v) * X));
    db.AddImage(v + 1, photo.name, keypoints);
  }
  std::uniform_int_distribution<int> any(0, 149);
  for (int a = 0; a < n; ++a)
    for (int b = a + 1; b < n; ++b) {
      std::vector<std::pair<int, int>> matches;
      for (int i = 0; i < 150; ++i) matches.emplace_back(i, i % 8 == 0 ? any(random) : i);
      db.AddMatches(a + 1, b + 1, matches);
    }
  return capture;
}

TEST(RingSearch, FindsFocalLengthElevationAndSenseOfATurntable) {
  for (const int sense : {1, -1}) {
    const FixtureFolder folder("ring");
    RingGeometry truth;
    truth.focal_px = 1400;
    truth.elevation_rad = 24 * kRadPerDeg;
    truth.step_rad = sense * 360 * kRadPerDeg / 24;
    truth.pan_rad = 1.5 * kRadPerDeg;
    truth.roll_rad = -2 * kRadPerDeg;
    const Capture capture = MakeRing(folder.path() / "database.db", truth, 24);
    ReconstructOptions options;
    options.rig = Rig::kRing;
    options.search_focal = true;
    const auto views = AssumeRing(capture, options, folder.path() / "database.db", SilentProgress());
    ASSERT_EQ(views.size(), 24u);
    // Matches are exact to float; the search stops within a fraction of its narrowest tolerance (1.5 px of 640).
    EXPECT_NEAR(views[0].camera.FocalPx().x() / truth.focal_px, 1, 0.02);
    for (int v = 0; v < 24; ++v)
      EXPECT_LT(
          views[static_cast<std::size_t>(v)].cam_from_world.rotation.angularDistance(RingPose(truth, v).rotation) *
              kDegPerRad,
          0.5)
          << v;
  }
}

TEST(RingSearch, AGivenFocalLengthIsKept) {
  const FixtureFolder folder("ringf");
  RingGeometry truth;
  truth.focal_px = 900;
  truth.elevation_rad = 10 * kRadPerDeg;
  truth.step_rad = 360 * kRadPerDeg / 18;
  const Capture capture = MakeRing(folder.path() / "database.db", truth, 18);
  ReconstructOptions options;
  options.rig = Rig::kRing;
  options.focal_px = 900;
  const auto views = AssumeRing(capture, options, folder.path() / "database.db", SilentProgress());
  EXPECT_EQ(views[5].camera.FocalPx().x(), 900);
  EXPECT_LT(views[5].cam_from_world.rotation.angularDistance(RingPose(truth, 5).rotation) * kDegPerRad, 0.2);
}

TEST(RingSearch, PhotosThatAreNoRingAreRefused) {
  const FixtureFolder folder("noring");
  RingGeometry truth;
  truth.focal_px = 900;
  truth.step_rad = 360 * kRadPerDeg / 18;
  truth.elevation_rad = 35 * kRadPerDeg;  // (seen from the side every order looks alike: all points move along rows)
  Capture capture = MakeRing(folder.path() / "database.db", truth, 18);
  // Names in another order than the places on the circle.
  const std::vector<InputPhoto> in_order = capture.photos;
  for (std::size_t i = 0; i < 18; ++i) capture.photos[i] = in_order[(i * 7) % 18];
  ReconstructOptions options;
  options.rig = Rig::kRing;
  options.search_focal = true;
  EXPECT_THROW(AssumeRing(capture, options, folder.path() / "database.db", SilentProgress()), DataError);
}

TEST(NelderMead, FindsTheMinimumOfRosenbrocksValley) {
  const auto rosenbrock = [](const std::vector<double>& x) {
    return 100 * std::pow(x[1] - x[0] * x[0], 2) + std::pow(1 - x[0], 2);
  };
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
