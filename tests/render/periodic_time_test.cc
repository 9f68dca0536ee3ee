// A scene that repeats itself, filmed by one camera that waves: a red disc runs round a circle on a textured wall,
// which is also the proxy. Where the disc is at any phase is known in closed form, from places and at phases that
// nobody filmed.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "render/picture/convert.h"
#include "render/time/clock.h"
#include "render/world/renderer.h"
#include "scene/files/image_io.h"
#include "scene/image_difference/image_difference.h"

namespace lumi {
namespace {

constexpr int kFrames = 400, kWidth = 96, kHeight = 72;
constexpr double kFps = 30, kPeriodFrames = 47.37, kOrbit = 0.45, kDisc = 0.16;
constexpr double kStart_s = 1e6;  // clocks do not begin at 0

Eigen::Vector3d DiscCentre(double phase) {
  return {kOrbit * std::cos(2 * M_PI * phase), kOrbit * std::sin(2 * M_PI * phase), 0};
}

double PhaseOf(double time_s) {
  const double turns = time_s * kFps / kPeriodFrames;
  return turns - std::floor(turns);
}

RenderView Camera5(double x, double y, double time_s) {
  RenderView v = MakeRenderView(Camera::Pinhole(kWidth, kHeight, 110, 110, 0.5 * kWidth, 0.5 * kHeight),
                                LookAt({x, y, -3}, {0, 0, 0}, {0, -1, 0}));
  v.time_s = time_s;
  return v;
}

Image8 Photograph(const RenderView& view) {
  Image8 image(kWidth, kHeight, 3);
  const Eigen::Vector3d disc = DiscCentre(PhaseOf(*view.time_s));
  const Eigen::Matrix3d rays = view.P.leftCols<3>().inverse();
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      double red = 0, grey = 0;
      for (const double dx : {0.25, 0.75})
        for (const double dy : {0.25, 0.75}) {
          const Eigen::Vector3d d = rays * Eigen::Vector3d(x + dx, y + dy, 1);
          const Eigen::Vector3d p = view.centre - view.centre.z() / d.z() * d;
          if ((p - disc).norm() < kDisc)
            red += 0.25;
          else
            grey += 0.25 * (110 + 50 * std::sin(9 * p.x()) * std::cos(8 * p.y()));
        }
      image.At(x, y, 0) = static_cast<std::uint8_t>(230 * red + grey);
      image.At(x, y, 1) = image.At(x, y, 2) = static_cast<std::uint8_t>(20 * red + grey);
    }
  return image;
}

// Of the red disc's pixels.
Eigen::Vector2d Centroid(const Image8& image) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double red = std::max(0, int(image.At(x, y, 0)) - int(image.At(x, y, 1)) - 20);
      sum += red * Eigen::Vector2d(x + 0.5, y + 0.5);
      weight += red;
    }
  EXPECT_GT(weight, 1000) << "no disc";
  return sum / std::max(weight, 1e-9);
}

struct Video {
  Scene scene;
  Mesh proxy;
  std::vector<Photo> photos;
  Video() {
    proxy.vertices = {{-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0}};
    proxy.faces = {{0, 1, 2}, {0, 2, 3}};
    scene.cameras.push_back(Camera::Pinhole(kWidth, kHeight, 110, 110, 0.5 * kWidth, 0.5 * kHeight));
    scene.period_s = kPeriodFrames / kFps;
    for (int i = 0; i < kFrames; ++i) {
      const double time_s = kStart_s + i / kFps;
      const double x = 0.8 * std::sin(2 * M_PI * i / 83.1), y = 0.15 * std::sin(2 * M_PI * i / 31.7);
      const RenderView view = Camera5(x, y, time_s);
      View v;
      v.name = "f" + std::to_string(i);
      v.camera = {0};
      v.cam_from_world = LookAt({x, y, -3}, {0, 0, 0}, {0, -1, 0});
      v.time_s = time_s;
      scene.views.push_back(v);
      Photo photo;
      photo.levels = BuildPyramid(Photograph(view));
      photos.push_back(std::move(photo));
    }
    UpdateFrameOfReference(scene);
  }
};

const Video& Filmed() {
  static const Video video;
  return video;
}

Image8 Rendered(Renderer& renderer, double x, double y, double time_s, bool time = true) {
  RenderRequest request;
  request.view = Camera5(x, y, time_s);
  TakeClock(Filmed().scene, false, request.settings);
  request.settings.time = time;
  request.settings.time_s = time_s;
  return ToRgb8(renderer.Render(request));
}

TEST(PeriodicTime, WhatMovesStandsWhereItDoesAtAnyPhaseSeenFromAnywhere) {
  const auto renderer = MakeCpuRenderer(WorldOf(Filmed().scene, Filmed().proxy), Filmed().photos);
  constexpr double kCentroidPx = 1.5;
  double gain_db = 0, worst_px = 0;
  constexpr int kMoments = 8;
  for (int i = 0; i < kMoments; ++i) {
    const double time_s = kStart_s + (i + 0.37) / kMoments * kPeriodFrames / kFps, x = -0.6 + 0.17 * i,
                 y = 0.1 * std::cos(2.0 * i);
    const Image8 truth = Photograph(Camera5(x, y, time_s)), with = Rendered(*renderer, x, y, time_s),
                 without = Rendered(*renderer, x, y, time_s, false);
    worst_px = std::max(worst_px, (Centroid(with) - Centroid(truth)).norm());
    gain_db += (Compare(with, truth).psnr_db - Compare(without, truth).psnr_db) / kMoments;
  }
  EXPECT_LT(worst_px, kCentroidPx);
  EXPECT_GT(gain_db, 3);
  std::printf("centroid at most %.2f px off; %.1f dB better than without time\n", worst_px, gain_db);
}

TEST(PeriodicTime, NothingJumpsWhereThePeriodEnds) {
  const auto renderer = MakeCpuRenderer(WorldOf(Filmed().scene, Filmed().proxy), Filmed().photos);
  // The end of the first turn: t = T - 0 and T + 0, and frames beside.
  const double end_s = std::ceil(kStart_s * kFps / kPeriodFrames) * kPeriodFrames / kFps;
  ASSERT_LT(std::min(PhaseOf(end_s + 1e-6), 1 - PhaseOf(end_s - 1e-6)), 1e-4);
  const auto mse = [&](double a_s, double b_s) {
    return Compare(Rendered(*renderer, 0.2, 0.05, a_s), Rendered(*renderer, 0.2, 0.05, b_s)).mse;
  };
  const double across = mse(end_s - 1e-4, end_s + 1e-4), neighbours = mse(end_s - 1.5 / kFps, end_s - 0.5 / kFps);
  EXPECT_GT(neighbours, 0);
  EXPECT_LT(across, 0.1 * neighbours);
  // A turn later, or a hundred, everything is as it was.
  EXPECT_LT(mse(end_s + 0.1, end_s + 0.1 + 100 * kPeriodFrames / kFps), 0.02 * neighbours);
}

}  // namespace
}  // namespace lumi
