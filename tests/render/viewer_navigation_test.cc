// How the viewer's camera moves.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "render/viewer/navigation.h"
#include "scene/model/orientation.h"
#include "tests/render/gl_test_scene.h"
#include "tests/render/viewer_state.h"

namespace lumi {
namespace {

using test::StateAt;

constexpr double kTolerance = 1e-9;  // chains of a few rotations in double

TEST(Navigation, AWindowOfThePhotosSizeHasThePhotosCamera) {
  const test::World w = test::MakeWorld(6, 120);
  for (int j = 0; j < 6; ++j) {
    const View& view = w.scene.views[static_cast<std::size_t>(j)];
    const Camera& c = w.scene.CameraOf(view);
    const RenderView window = MakeWindowView(StateOfView(w.scene, {j}), c.width_px, c.height_px);
    const RenderView photo = MakeRenderView(w.scene, view);
    EXPECT_LT((window.P - photo.P).norm(), kTolerance * photo.P.norm());
    EXPECT_LT((window.centre - photo.centre).norm(), kTolerance);
  }
}

// Stored on its side, looked through upright: level, and in a window of the upright photo's size each pixel is the
// photo's, turned.
TEST(Navigation, APortraitPhotosCameraStandsUpright) {
  test::World w = test::MakeWorld(6, 120);
  View& view = w.scene.views[2];
  const double roll = Navigator(StateOfView(w.scene, {2}), w.scene.up, 1).Roll();
  view.cam_from_world = StoredPose(view.cam_from_world, 6);
  view.orientation = 6;
  const ViewState state = StateOfView(w.scene, {2});
  EXPECT_NEAR(Navigator(state, w.scene.up, 1).Roll(), roll, kTolerance);
  const Camera& c = w.scene.CameraOf(view);
  const RenderView window = MakeWindowView(state, c.height_px, c.width_px), photo = MakeRenderView(w.scene, view);
  for (const Eigen::Vector3d& x : {Eigen::Vector3d(0, 0, 3), Eigen::Vector3d(0.4, -0.3, 2.8)}) {
    const auto in_window = Project(window.P, x), in_photo = Project(photo.P, x);
    ASSERT_TRUE(in_window && in_photo);
    EXPECT_NEAR(in_window->x(), c.height_px - in_photo->y(), 1e-6);
    EXPECT_NEAR(in_window->y(), in_photo->x(), 1e-6);
  }
}

TEST(Navigation, EveryWindowShowsTheWholePhoto) {
  const test::World w = test::MakeWorld(3, 120);
  const View& view = w.scene.views[1];
  const Camera& camera = w.scene.CameraOf(view);
  for (const auto& [width, height] : {std::pair{300, 100}, {100, 300}, {640, 480}}) {
    const RenderView window = MakeWindowView(StateOfView(w.scene, {1}), width, height);
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), Eigen::Vector2d(camera.width_px, camera.height_px)}) {
      const auto ray = camera.Normalized(corner);
      const auto x =
          Project(window.P, Eigen::Vector3d(view.cam_from_world.Inverse() * Eigen::Vector3d(ray->x(), ray->y(), 1.0)));
      ASSERT_TRUE(x);
      EXPECT_GE(x->minCoeff(), -1e-6);
      EXPECT_LE(x->x(), width + 1e-6);
      EXPECT_LE(x->y(), height + 1e-6);
    }
  }
}

TEST(Navigation, AnOrbitKeepsItsPointInPlaceAndUpUp) {
  const Eigen::Vector3d pivot(0.2, -0.1, 0.4);
  Navigator n(StateAt({3, 1, 1.5}, pivot), Eigen::Vector3d::UnitZ(), 1.0);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> angle(-0.7, 0.7);
  const double distance = (n.state().cam_from_world.OriginInSource() - pivot).norm();
  for (int i = 0; i < 500; ++i) {
    n.Orbit(pivot, angle(random), angle(random));
    const Eigen::Vector3d in_cam = n.state().cam_from_world * pivot;
    ASSERT_NEAR(in_cam.x(), 0, 1e-8);
    ASSERT_NEAR(in_cam.y(), 0, 1e-8);
    ASSERT_NEAR(in_cam.z(), distance, 1e-8);
    ASSERT_NEAR(n.Roll(), 0, 1e-8);
    ASSERT_LE(std::abs(n.Elevation()), Navigator::kMaxElevation + 1e-9);
  }
}

TEST(Navigation, AnOrbitGoesWhereItSays) {
  const Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  Navigator n(StateAt({0, -4, 0}, pivot), Eigen::Vector3d::UnitZ(), 1.0);
  n.Orbit(pivot, 0.5, 0);  // to the right: the camera looks along +y, its right is +x
  EXPECT_GT(n.state().cam_from_world.OriginInSource().x(), 1.0);
  EXPECT_NEAR(n.state().cam_from_world.OriginInSource().z(), 0, kTolerance);
  n.Orbit(pivot, 0, 0.3);
  EXPECT_GT(n.state().cam_from_world.OriginInSource().z(), 1.0);
  EXPECT_NEAR(n.Elevation(), -0.3, kTolerance);
}

TEST(Navigation, LookingTurnsOnTheSpot) {
  const Eigen::Vector3d eye(1, 2, 3);
  Navigator n(StateAt(eye, {1, 5, 3}), Eigen::Vector3d::UnitZ(), 1.0);
  n.Look(0.4, 0.2);
  EXPECT_LT((n.state().cam_from_world.OriginInSource() - eye).norm(), kTolerance);
  const Eigen::Vector3d forward = n.state().cam_from_world.R().row(2).transpose();
  EXPECT_GT(forward.x(), 0.3);  // it looked along +y: its right is +x
  EXPECT_NEAR(std::asin(forward.z()), 0.2, kTolerance);
}

TEST(Navigation, LooksStraightUpAndDownWithoutTumbling) {
  Navigator n(StateAt({0, 0, 5}, {0, 0, 0}), Eigen::Vector3d::UnitZ(),
              1.0);  // straight down: right is not defined by up
  for (int i = 0; i < 100; ++i) {
    n.Look(0.1, 0.05);
    ASSERT_TRUE(n.state().cam_from_world.R().allFinite());
  }
  EXPECT_NEAR(n.Elevation(), Navigator::kMaxElevation, 1e-6);
  EXPECT_NEAR(n.Roll(), 0, 1e-8);
}

TEST(Navigation, ARollIsLevelledAfterATurnOnly) {
  ViewState tilted = StateAt({3, 0, 1}, {0, 0, 0});
  const Eigen::Vector3d eye = tilted.cam_from_world.OriginInSource();
  tilted.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())) * tilted.cam_from_world.rotation;
  tilted.cam_from_world.translation = -(tilted.cam_from_world.rotation * eye);
  Navigator n(tilted, Eigen::Vector3d::UnitZ(), 1.0);
  EXPECT_NEAR(std::abs(n.Roll()), 0.4, kTolerance);
  EXPECT_FALSE(n.Tick(1.0));
  EXPECT_NEAR(std::abs(n.Roll()), 0.4, kTolerance);
  n.Orbit({0, 0, 0}, 0.01, 0);
  double last = 0.41;
  for (int i = 0; i < 40; ++i) {
    n.Tick(0.05);
    ASSERT_LE(std::abs(n.Roll()), last + kTolerance);
    last = std::abs(n.Roll());
  }
  EXPECT_NEAR(n.Roll(), 0, 2e-4);
}

TEST(Navigation, AFlightEndsAtItsTargetAndAMoveEndsTheFlight) {
  const test::World w = test::MakeWorld(4, 100);
  Navigator n(StateOfView(w.scene, {0}), Eigen::Vector3d::UnitZ(), 1.0);
  n.FlyTo(StateOfView(w.scene, {3}), 0.5);
  Eigen::Vector3d last = n.state().cam_from_world.OriginInSource();
  for (int i = 0; n.flying(); ++i) {
    ASSERT_LT(i, 100);
    EXPECT_TRUE(n.Tick(0.02));
    const Eigen::Vector3d now = n.state().cam_from_world.OriginInSource();
    EXPECT_LT((now - last).norm(), 0.6);  // no jump: 7 units in 25 steps, fastest in the middle
    last = now;
  }
  EXPECT_EQ(NearestView(w.scene, n.state().cam_from_world), 3);
  EXPECT_LT((MakeWindowView(n.state(), 100, 75).P - MakeWindowView(StateOfView(w.scene, {3}), 100, 75).P).norm(), 1e-9);
  n.FlyTo(StateOfView(w.scene, {0}), 1.0);
  n.Tick(0.3);
  n.Fly(0.1, 0, 0);
  EXPECT_FALSE(n.flying());
}

TEST(Navigation, DollyNeverPassesItsPoint) {
  Navigator n(StateAt({3, 0, 0}, {0, 0, 0}), Eigen::Vector3d::UnitZ(), 1.0);
  for (int i = 0; i < 1000; ++i) n.Dolly({0, 0, 0}, 0.8);
  EXPECT_GE(n.state().cam_from_world.OriginInSource().x(), 1e-3);
  for (int i = 0; i < 300; ++i) n.Zoom(0.5);
  EXPECT_GT(n.state().lens.extent.minCoeff(), 0.001);
}

}  // namespace
}  // namespace lumi
