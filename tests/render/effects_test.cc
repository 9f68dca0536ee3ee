#include "render/effects/effects.h"

#include <gtest/gtest.h>

#include "capture_with_tracks.h"
#include "render/effects/exposure.h"

namespace lumi {
namespace {

const Effect& Find(const EffectChoice& choice, const std::string& name) {
  for (const Effect& e : choice.effects)
    if (e.name == name) return e;
  throw std::logic_error("no effect " + name);
}

// Cameras that all contain all of a small square, from one distance, with nothing before it: nothing is called for.
test::Capture Plain() {
  test::Capture c;
  c.proxy.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  c.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
  c.scene.cameras.push_back(Camera::Pinhole(100, 100, 60, 60, 50, 50));
  for (int i = 0; i < 9; ++i) {
    View v;
    v.name = "view" + std::to_string(i);
    v.camera = {0};
    v.cam_from_world = LookAt({0.3 * (i % 3 - 1), 0.3 * (i / 3 - 1), -4}, {0, 0, 0}, {0, -1, 0});
    c.scene.views.push_back(v);
  }
  for (int i = 0; i < 60; ++i) {
    Point p;
    p.x_in_world = {std::sin(12.9 * i), std::sin(78.2 * i), 0};
    c.scene.points.push_back(p);
  }
  UpdateFrameOfReference(c.scene);
  return c;
}

EffectChoice Choose(const test::Capture& c, const RenderView& desired, const Decided& decided = {},
                    RadianceSettings settings = {}) {
  return ChooseEffects(c.scene, c.proxy, {desired}, {}, settings, decided, {});
}

RenderView At(const Eigen::Vector3d& centre) {
  return MakeRenderView(Camera::Pinhole(100, 100, 60, 60, 50, 50), LookAt(centre, {0, 0, 0}, {0, -1, 0}));
}

TEST(Effects, APlainSceneCallsForNone) {
  const EffectChoice choice = Choose(Plain(), At({0.1, 0.05, -4}));
  for (const Effect& e : choice.effects) EXPECT_FALSE(e.on) << e.name << ": " << e.evidence;
  EXPECT_FALSE(choice.settings.field_of_view);
  EXPECT_FALSE(choice.settings.visibility);
  EXPECT_FALSE(choice.settings.prefilter);
}

TEST(Effects, APhotoThatEndsCallsForFieldOfView) {
  test::Capture c = Plain();
  c.scene.views[4].cam_from_world = LookAt(c.scene.views[4].CentreInWorld(), {2.5, 0, 0}, {0, -1, 0});
  EXPECT_TRUE(Find(Choose(c, At({0.1, 0.05, -4})), "fov").on);
}

TEST(Effects, CamerasAtOtherDistancesCallForResolution) {
  test::Capture c = Plain();
  for (const std::size_t i : {1U, 4U, 7U})
    c.scene.views[i].cam_from_world = LookAt(3 * c.scene.views[i].CentreInWorld(), {0, 0, 0}, {0, -1, 0});
  const EffectChoice choice = Choose(c, At({0.1, 0.05, -4}));
  EXPECT_TRUE(Find(choice, "resolution").on) << Find(choice, "resolution").evidence;
  EXPECT_EQ(choice.settings.resolution, Resolution::kDistance) << "all look straight on: the cheap measure serves";
}

TEST(Effects, OblquePhotosCallForTheJacobian) {
  test::Capture c = Plain();
  for (const std::size_t i : {1U, 4U, 7U})
    c.scene.views[i].cam_from_world = LookAt({3.9, 0.2 * static_cast<double>(i) - 0.8, -0.9}, {0, 0, 0}, {0, -1, 0});
  const EffectChoice choice = ChooseEffects(c.scene, c.proxy, {At({1.2, 0.05, -3.8})}, {},
                                            [] {
                                              RadianceSettings s;
                                              s.k = 8;
                                              return s;
                                            }(),
                                            {}, {});
  EXPECT_EQ(choice.settings.resolution, Resolution::kJacobian) << Find(choice, "resolution").evidence;
}

TEST(Effects, APartBehindAnotherCallsForVisibility) {
  test::Capture c = test::MakeCapture(8, 48);
  EXPECT_TRUE(Find(Choose(c, MakeRenderView(c.scene, c.scene.views[3])), "visibility").on);
}

TEST(Effects, SmallerPicturesCallForPrefiltering) {
  const test::Capture c = Plain();
  const RenderView small =
      MakeRenderView(Camera::Pinhole(40, 40, 24, 24, 20, 20), LookAt({0.1, 0.05, -4}, {0, 0, 0}, {0, -1, 0}));
  EXPECT_TRUE(Find(Choose(c, small), "prefilter").on);
}

TEST(Effects, TimeNeedsAPeriodOrAWord) {
  test::Capture c = Plain();
  for (std::size_t i = 0; i < c.scene.views.size(); ++i) c.scene.views[i].time_s = 0.1 * static_cast<double>(i);
  EXPECT_FALSE(Find(Choose(c, At({0, 0, -4})), "time").on) << "a video of a still scene has times too";
  RadianceSettings periodic;
  periodic.period_s = 0.4;
  EXPECT_TRUE(Find(Choose(c, At({0, 0, -4}), {}, periodic), "time").on);
}

TEST(Effects, TheUsersWordOverridesTheEvidence) {
  RadianceSettings settings;
  settings.field_of_view = true;
  settings.visibility = true;
  const EffectChoice choice = Choose(Plain(), At({0.1, 0.05, -4}), {"fov", "visibility"}, settings);
  EXPECT_TRUE(Find(choice, "fov").on);
  EXPECT_TRUE(Find(choice, "visibility").on);
  EXPECT_TRUE(choice.settings.visibility);
}

// Photos of a capture, each darkened by its own factor.
TEST(Exposure, GainsComeBackFromThePhotos) {
  test::Capture c = test::CaptureWithTracks(8);
  EXPECT_FALSE(EstimateExposures(c.scene, c.photos).Differ()) << "photos of one exposure";

  std::vector<double> truth;
  double mean = 0;
  for (std::size_t v = 0; v < c.photos.size(); ++v) {
    truth.push_back(std::exp(0.15 * std::sin(2.0 * static_cast<double>(v))));
    mean += std::log(truth.back()) / static_cast<double>(c.photos.size());
    for (Image8& level : c.photos[v].levels)
      for (auto& value : level.data)
        value = static_cast<std::uint8_t>(std::lround(std::min(255.0, 0.9 * truth.back() * value)));
  }
  const Exposures e = EstimateExposures(c.scene, c.photos);
  EXPECT_TRUE(e.Differ());
  for (std::size_t v = 0; v < truth.size(); ++v) EXPECT_NEAR(e.gain[v], truth[v] / std::exp(mean), 0.02) << v;
}

// A highlight, or what stands before the points in one photo, is no exposure.
TEST(Exposure, WhatDiffersInAPartOfAPhotoIsNoGain) {
  test::Capture c = test::CaptureWithTracks(8);
  constexpr std::size_t kShone = 3;
  constexpr double kTimes = 1.5, kNear = 0.03;  // a mean over the points takes a part of it along: 4 %
  for (Image8& level : c.photos[kShone].levels)
    for (int y = 0; y < level.height; ++y)
      for (int x = 0; 10 * x < 3 * level.width; ++x)
        for (int k = 0; k < level.channels; ++k)
          level.At(x, y, k) = static_cast<std::uint8_t>(std::min(255.0, kTimes * level.At(x, y, k)));
  int shone = 0, seen = 0;
  for (const Point& point : c.scene.points)
    for (const Observation& o : point.track)
      if (o.view.value == kShone) ++seen, shone += 10 * o.x_px.x() < 3 * c.photos[kShone].levels[0].width;
  EXPECT_GT(shone, seen / 10);
  EXPECT_LT(shone, seen / 3);
  const Exposures e = EstimateExposures(c.scene, c.photos);
  for (std::size_t v = 0; v < e.gain.size(); ++v) EXPECT_NEAR(e.gain[v], 1, kNear) << v;
}

}  // namespace
}  // namespace lumi
