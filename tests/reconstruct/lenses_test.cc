// Photos of other lenses among those that share a camera.
#include "reconstruct/lenses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "watched_world.h"

namespace lumi {
namespace {

// As if view v had been taken with a focal length so many times its camera's, and nobody said so.
void Zoom(Scene& scene, std::int32_t v, double factor) {
  const Eigen::Vector2d middle = scene.cameras[0].PrincipalPointPx();
  for (Point& point : scene.points)
    for (Observation& o : point.track)
      if (o.view.value == v) o.x_px = middle + factor * (o.x_px - middle);
}

TEST(Lenses, OneLensIsOne) {
  std::mt19937 random(21);
  for (const WatchedWorld& world : {Ring(16, random), Drive(20, random)}) {
    const auto focals = FocalsOfViews(world.scene);
    ASSERT_EQ(focals.size(), world.scene.views.size());
    for (const FocalOfView& f : focals) {
      EXPECT_LT(f.sigma, 0.01);
      EXPECT_LT(std::abs(std::log(f.ratio)), 5 * f.sigma);
    }
    EXPECT_TRUE(OneLensExplains(focals));
  }
}

TEST(Lenses, AZoomedPhotoAsksForItsOwnFocalLength) {
  std::mt19937 random(22);
  for (const double factor : {0.6, 0.9, 1.1, 1.5, 2.5}) {
    WatchedWorld world = Ring(16, random);
    Zoom(world.scene, 3, factor);
    Zoom(world.scene, 11, factor);
    const auto focals = FocalsOfViews(world.scene);
    for (std::size_t v = 0; v < focals.size(); ++v)
      EXPECT_NEAR(focals[v].ratio, v == 3 || v == 11 ? factor : 1, 0.02) << v;
    EXPECT_FALSE(OneLensExplains(focals)) << factor;
  }
}

// A mapper takes a zoom for a step forward and keeps the points that this explains: the matches know the others.
TEST(Lenses, AZoomThatWasTakenForAStepIsFoundByTheMatches) {
  std::mt19937 random(24);
  WatchedWorld world = Ring(16, random);
  constexpr std::int32_t kZoomed = 5;
  constexpr double kZoom = 1.8;
  const Eigen::Vector2d middle = world.scene.cameras[0].PrincipalPointPx();
  Zoom(world.scene, kZoomed, kZoom);
  for (ViewMatches& m : world.matches)
    for (auto& [x_a, x_b] : m.px) {
      if (m.a.value == kZoomed) x_a = middle + kZoom * (x_a - middle);
      if (m.b.value == kZoomed) x_b = middle + kZoom * (x_b - middle);
    }
  View& view = world.scene.views[kZoomed];
  view.cam_from_world.translation.z() *= 1 / kZoom;
  for (Point& point : world.scene.points)
    std::erase_if(point.track, [&](const Observation& o) {
      if (o.view.value != kZoomed) return false;
      const auto x = world.scene.cameras[0].Project(view.cam_from_world * point.x_in_world);
      return !x || (*x - o.x_px).norm() > 3;
    });
  EXPECT_TRUE(OneLensExplains(FocalsOfViews(world.scene)));
  const auto focals = FocalsOfViews(world.scene, EvidenceOf(world.scene, world.matches));
  EXPECT_NEAR(focals[kZoomed].ratio, kZoom, 0.05);
  EXPECT_FALSE(OneLensExplains(focals));
  for (std::size_t v = 0; v < focals.size(); ++v) {
    if (static_cast<std::int32_t>(v) == kZoomed) continue;
    EXPECT_NEAR(focals[v].ratio, 1, 0.02) << v;
  }
}

// Points in one plane that a photo faces tell no focal length from a distance, nor do ever fewer points.
TEST(Lenses, WhatThePointsDoNotTellIsNoOtherLens) {
  std::mt19937 random(23);
  for (const double depth : {1e-2, 1e-4, 1e-8, 0.0}) {
    std::vector<Rigid3> poses;
    for (int i = 0; i < 6; ++i) {
      Rigid3 pose;
      pose.translation = {-0.5 + 0.2 * i, 0, 5};  // all face the plane
      poses.push_back(pose);
    }
    WatchedWorld world = Watch(poses, Cloud(200, {1.5, 1, depth}, random), 100, 5, random);
    Zoom(world.scene, 2, 1.02);
    const auto focals = FocalsOfViews(world.scene);
    EXPECT_TRUE(OneLensExplains(focals)) << depth;
    if (depth < 1e-6) {
      for (const FocalOfView& f : focals) EXPECT_GT(f.sigma, 0.05) << depth;
    }
  }
  for (const std::size_t count : {0U, 1U, 2U, 3U, 4U}) {
    WatchedWorld world = Ring(6, random);
    world.scene.points.resize(count);
    for (const FocalOfView& f : FocalsOfViews(world.scene)) {
      EXPECT_TRUE(std::isfinite(f.ratio));
      EXPECT_GE(f.sigma, 0);
    }
  }
}

TEST(Lenses, LikeOnesAreShared) {
  Scene scene;
  const std::vector<double> focals{500, 802, 505, 498, 790, 503, 2000, 501, 795, 805};
  for (std::size_t v = 0; v < focals.size(); ++v) {
    Camera camera;
    camera.model = CameraModel::kSimpleRadial;
    camera.width_px = 640, camera.height_px = 480;
    camera.params = {focals[v], 320, 240, -0.01};
    scene.cameras.push_back(camera);
    View view;
    view.name = "photo " + std::to_string(v);
    view.camera = CameraId{static_cast<std::int32_t>(v)};
    scene.views.push_back(view);
  }
  const Scene shared = ShareLikeLenses(scene);
  ASSERT_EQ(shared.cameras.size(), 3U);
  EXPECT_EQ(shared.CameraOf(shared.views[0]).model, CameraModel::kRadial);  // five photos
  EXPECT_EQ(shared.CameraOf(shared.views[0]).params, (std::vector<double>{501, 320, 240, -0.01, 0}));
  EXPECT_EQ(shared.CameraOf(shared.views[1]).model, CameraModel::kSimpleRadial);  // four
  EXPECT_EQ(shared.views[1].camera, shared.views[9].camera);
  EXPECT_EQ(shared.CameraOf(shared.views[6]).params[0], 2000);
  // Another size is another camera, whatever its focal length.
  Scene sizes = scene;
  sizes.cameras[2].width_px = 480, sizes.cameras[2].height_px = 640;
  EXPECT_EQ(ShareLikeLenses(sizes).cameras.size(), 4U);
}

}  // namespace
}  // namespace lumi
