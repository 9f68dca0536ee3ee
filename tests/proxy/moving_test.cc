#include <gtest/gtest.h>

#include "scene/program/error.h"
#include "tests/proxy/moving_world.h"

namespace lumi::test {
namespace {

// A plane is a pixel of parallax between the outermost cameras, 0.5 apart, 90 pixels focal length: 0.09 at depth 2.
// Photos of one moment are compared to a fraction of that.
constexpr double kDepth = 0.12;

TEST(Moving, WhatMovesStandsWhereItIsAndTheRestWhereItWas) {
  const MovingWorld world;
  MovingSummary s;
  const Mesh mesh = BuildMovingProxy(world.Photos(), world.Still(), {}, SilentProgress(), &s);
  EXPECT_EQ(Validate(mesh), std::nullopt);
  for (const double x : {-0.2, 0.0, 0.2})
    for (const double y : {-0.2, 0.0, 0.2}) EXPECT_NEAR(world.DepthTowards(mesh, x, y, 2), 2, kDepth) << x << ' ' << y;
  // Beside its way, and where nothing is masked.
  for (const double x : {-1.9, 1.9}) EXPECT_NEAR(world.DepthTowards(mesh, x, 0, 4), 4, 1e-9);
  EXPECT_NEAR(world.DepthTowards(mesh, 0, 1.4, 4), 4, 1e-9);
  EXPECT_EQ(s.photos, 25U);
  EXPECT_EQ(s.moments, 5);
  EXPECT_NEAR(s.median_depth, 2, kDepth);
  EXPECT_GT(s.gain,
            100);  // code values squared: two textures that differ by tens of code values do not lie on one another
  // Front faces look at the cameras' middle: every one of the surface's, those that reach back to the wall edge on.
  constexpr double kEdgeOn = 1e-9;
  const Eigen::Vector3d eye(0.026, 0, 0.04);
  for (std::size_t f = 2; f < mesh.faces.size(); ++f)
    EXPECT_GT(mesh.FaceNormal(f).dot(eye - mesh.vertices[static_cast<std::size_t>(mesh.faces[f][0])]), -kEdgeOn);
}

TEST(Moving, IsTheSameForAnyNumberOfThreadsAndAgain) {
  MovingWorld world;
  world.views = 3;
  const Mesh a = BuildMovingProxy(world.Photos(), world.Still(), {}, SilentProgress()),
             b = BuildMovingProxy(world.Photos(), world.Still(), {}, SilentProgress());
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.faces, b.faces);
}

Scene Filmed(double period_s, double first_s, int frames) {
  Scene scene;
  scene.period_s = period_s;
  Camera camera;
  camera.width_px = camera.height_px = 64;
  camera.params = {60, 60, 32, 32};
  camera.model = CameraModel::kPinhole;
  scene.cameras = {camera};
  for (int i = 0; i < frames; ++i) {
    View v;
    v.name = "frame" + std::to_string(1000 + i);
    v.camera = {0};
    v.cam_from_world.translation = Eigen::Vector3d(0.01 * std::sin(0.7 * i), 0.01 * i, 0);
    v.time_s = first_s + i / 30.0;
    scene.views.push_back(v);
  }
  return scene;
}

TEST(Moving, PhotosOfOneMomentAreAFrameApartAtMostRoundThePeriod) {
  // Seconds at 1e9 are told to 1.2e-7: nothing against half a frame.
  for (const double first : {0.0, 1e9}) {
    const Scene scene = Filmed(15.37 / 30, first, 200);
    const std::vector<MomentView> picked = PickMoments(scene, {.moments = 8, .views_a_moment = 4});
    ASSERT_EQ(picked.size(), 32U) << first;
    std::vector<int> of(8, 0);
    std::vector<bool> seen(200, false);
    for (const MomentView& a : picked) {
      ++of[static_cast<std::size_t>(a.moment)];
      EXPECT_FALSE(seen[static_cast<std::size_t>(a.view.value)]);
      seen[static_cast<std::size_t>(a.view.value)] = true;
      for (const MomentView& b : picked) {
        if (a.moment != b.moment) continue;
        double apart = std::fmod(std::abs(a.view.value - b.view.value), 15.37);
        apart = std::min(apart, 15.37 - apart);
        EXPECT_LE(apart, 1 + 1e-3);
      }
    }
    for (const int n : of) EXPECT_EQ(n, 4);
  }
}

TEST(Moving, WithoutTimesOrCompanyThereAreNoMoments) {
  Scene scene = Filmed(15.37 / 30, 0, 10);  // less than a period: no frame comes back
  EXPECT_TRUE(PickMoments(scene, {}).empty());
  scene = Filmed(15.37 / 30, 0, 60);
  for (View& v : scene.views) v.time_s.reset();
  EXPECT_TRUE(PickMoments(scene, {}).empty());
  EXPECT_TRUE(PickMoments({}, {}).empty());
}

}  // namespace
}  // namespace lumi::test
