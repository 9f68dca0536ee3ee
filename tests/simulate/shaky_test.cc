// Shaken paths, lenses that zoom, and the ideal paths behind them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "simulate/capture.h"
#include "simulate/examples.h"

namespace lumi {
namespace {

using Eigen::Vector3d;
constexpr double kRounding = 1e-12;

SceneDescription ShakyScene(const std::string& path, const std::string& more = "") {
  return ParseScene(R"({"name": "s", "cameras": [{"size": [64, 48], "fov_deg": 50}], "path": )" + path + more + "}",
                    "test.json", ".");
}
PathDescription ExamplePath(const char* name) { return ParseScene(ExampleJson(name), name, ".").paths[0]; }
Vector3d EyeAt(const PathDescription& path, double frame) { return PoseAt(path, frame).OriginInSource(); }

constexpr const char* kDrive =
    R"({"kind": "drive", "views": 31, "from": [0, 0, 1], "to": [3, 0, 1], "direction": [0, 1, 0]})";

TEST(ShakyPaths, ADriveIsShakenLikeAWalkWhenAsked) {
  const PathDescription drive = ShakyScene(kDrive).paths[0];
  EXPECT_FALSE(IsShaken(drive));
  EXPECT_LT((EyeAt(drive, 15) - Vector3d(1.5, 0, 1)).norm(), kRounding);
  const PathDescription once = WithShake(drive, 1), twice = WithShake(drive, 2);
  EXPECT_TRUE(IsShaken(twice));
  for (int i = 0; i <= 30; ++i) {
    const Vector3d ideal(0.1 * i, 0, 1);
    // bob 3 cm up at 1.9 Hz, sway 2.5 cm to the right of the drive (-y) at half of that.
    const double step = 2 * M_PI * 1.9 * i / 30;
    EXPECT_LT((EyeAt(once, i) - ideal - Vector3d(0, -0.025 * std::sin(0.5 * step), 0.03 * std::sin(step))).norm(),
              kRounding);
    EXPECT_LT((EyeAt(twice, i) - ideal - 2 * (EyeAt(once, i) - ideal)).norm(), kRounding);
    EXPECT_LT((EyeAt(WithShake(twice, 0), i) - ideal).norm(), kRounding);
    EXPECT_LT(PoseAt(WithShake(twice, 0), i).rotation.angularDistance(PoseAt(drive, i).rotation), 1e-9);
  }
  double turned_rad = 0;
  for (int i = 0; i <= 30; ++i)
    turned_rad = std::max(turned_rad, PoseAt(once, i).rotation.angularDistance(PoseAt(drive, i).rotation));
  EXPECT_GT(turned_rad, 0.2 * 0.012);
}

TEST(ShakyPaths, AWalksIdealPathIsStraightAndEven) {
  const PathDescription ideal = WithShake(ExamplePath("plaza"), 0);
  for (int i = 2; i < ideal.views; ++i) {
    EXPECT_LT((EyeAt(ideal, i) - 2 * EyeAt(ideal, i - 1) + EyeAt(ideal, i - 2)).norm(), 1e-12);
    EXPECT_LT(PoseAt(ideal, i).rotation.angularDistance(PoseAt(ideal, 0).rotation), 1e-9);
  }
}

TEST(ShakyPaths, HoldKeepsTheSizeOfWhatItHoldsOnTheIdealPathOnly) {
  const PathDescription shaken = ExamplePath("vertigo"), ideal = WithShake(shaken, 0);
  ASSERT_TRUE(shaken.hold.has_value());
  const auto size = [&](const PathDescription& path, double frame) {
    return ZoomAt(path, frame) / (PoseAt(path, frame) * *path.hold).z();
  };
  double most = 0;
  for (int i = 0; i < shaken.views; ++i) {
    EXPECT_NEAR(size(ideal, i) / size(ideal, 0), 1, kRounding);
    most = std::max(most, std::abs(size(shaken, i) / size(ideal, 0) - 1));
  }
  EXPECT_GT(most, 0.02);  // a hand's zoom is off by a few percent
  EXPECT_LT(most, 0.15);
  EXPECT_LT(ZoomAt(ideal, shaken.views - 1), 0.5);  // it does zoom out
  PathDescription zoomed = ideal;
  zoomed.zoom_error = shaken.zoom_error;
  most = 0;
  for (int i = 0; i < shaken.views; ++i) most = std::max(most, std::abs(ZoomAt(zoomed, i) / ZoomAt(ideal, i) - 1));
  EXPECT_GT(most, 0.2 * shaken.zoom_error);
  EXPECT_LE(most, shaken.zoom_error);
}

TEST(ShakyPaths, AZoomWithoutMotionIsEvenInItsLogarithm) {
  const PathDescription path =
      ShakyScene(R"({"kind": "wave", "views": 41, "centre": [0, 0, 1], "amplitude": [0, 0, 0], "zoom": [0.5, 2]})")
          .paths[0];
  EXPECT_NEAR(ZoomAt(path, 0), 0.5, kRounding);
  EXPECT_NEAR(ZoomAt(path, 20), 1, kRounding);
  EXPECT_NEAR(ZoomAt(path, 40), 2, kRounding);
  EXPECT_EQ(EyeAt(path, 0), EyeAt(path, 33));
}

TEST(ShakyPaths, WhatCannotBeHeldOrZoomedIsRefused) {
  const auto refused = [](const std::string& keys) {
    try {
      ShakyScene(R"({"kind": "drive", "from": [0, 0, 1], "to": [0, 3, 1], "views": 9, )" + keys + "}");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(refused(R"("hold": [0, 1, 1])"), ::testing::HasSubstr("hold"));
  EXPECT_THAT(refused(R"("zoom": [1, 0])"), ::testing::HasSubstr("zoom"));
  EXPECT_THAT(refused(R"("gait": {"zoom_percent": 60})"), ::testing::HasSubstr("zoom_percent"));
  EXPECT_EQ(refused(R"("hold": [0, 5, 1], "zoom": [1, 2])"), "");
}

class ShakyCapture : public ::testing::Test {
 protected:
  SimulateOptions Options(const std::string& output, const std::string& path, const std::string& more = "") {
    std::ofstream(folder_ / "scene.json")
        << R"({"name": "wall", "image": {"format": "png"}, "cameras": [{"size": [64, 48], "fov_deg": 50}], "path": )"
        << path << R"(, "materials": [{"name": "wall", "texture": {"kind": "cells", "size": 0.3}}],
        "objects": [{"kind": "quad", "size": [20, 20], "position": [0, 4, 0], "rotate_deg": [90, 0, 0], "material": "wall"}])"
        << more << "}";
    SimulateOptions options;
    options.scene_file = folder_ / "scene.json";
    options.output = folder_ / output;
    return options;
  }
  nlohmann::json Views(const std::string& capture, const char* file) {
    return nlohmann::json::parse(ReadText(folder_ / capture / "truth" / file))["views"];
  }
  TemporaryFolder folder_;
};

TEST_F(ShakyCapture, HasTheCamerasOfItsIdealPathAndASteadyCaptureShowsThem) {
  const std::string effects = R"(, "effects": {"noise_sigma": 3, "rolling_shutter_s": 0.02})";
  SimulateOptions options = Options("shaken", kDrive, effects);
  options.shake = 2;
  options.video = true;
  options.views = 4;
  Simulate(options, SilentProgress());
  options.output = folder_ / "steady";
  options.shake.reset();
  options.steady = true;
  Simulate(options, SilentProgress());
  SimulateOptions plain = Options("plain", kDrive);
  plain.views = 4, plain.video = true;
  Simulate(plain, SilentProgress());
  EXPECT_EQ(Views("shaken", "steady.json"), Views("steady", "cameras.json"));
  EXPECT_NE(Views("shaken", "steady.json"), Views("shaken", "cameras.json"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "plain" / "truth" / "steady.json"));
  for (int i = 0; i < 4; ++i) {  // the first frames of the video
    const std::string name = "images/wall_000" + std::to_string(i) + ".png";
    EXPECT_EQ(ReadImage8(folder_ / "steady" / name).data, ReadImage8(folder_ / "plain" / name).data);
    EXPECT_NE(ReadImage8(folder_ / "shaken" / name).data, ReadImage8(folder_ / "plain" / name).data);
  }
  VideoReader video(folder_ / "shaken" / "video.mp4");
  while (video.Next()) {
  }
  EXPECT_EQ(video.frames_read(), 4);
  EXPECT_NEAR(video.fps(), 30, 1e-6);
}

TEST_F(ShakyCapture, OfALensThatZoomsHasACameraAView) {
  SimulateOptions options = Options(
      "zoom",
      R"({"kind": "wave", "views": 3, "centre": [0, 0, 0], "direction": [0, 1, 0], "amplitude": [0, 0, 0], "zoom": [1, 4]})");
  Simulate(options, SilentProgress());
  const Scene scene = OpenScene(options.output, {}, SilentProgress());
  ASSERT_EQ(scene.cameras.size(), 3u);
  const double focal_px = scene.CameraOf(scene.views[0]).FocalPx().x();
  EXPECT_NEAR(scene.CameraOf(scene.views[1]).FocalPx().y(), 2 * focal_px, 1e-9);
  EXPECT_NEAR(scene.CameraOf(scene.views[2]).FocalPx().x(), 4 * focal_px, 1e-9);
  EXPECT_NEAR(Views("zoom", "cameras.json")[2]["params"][0].get<double>(), 4 * focal_px, 1e-9);
  // What is seen: a wall at one depth, as large as the zoom says.
  const Point& point = scene.points.front();
  for (const Observation& o : point.track) {
    const View& view = scene.views[static_cast<std::size_t>(o.view.value)];
    EXPECT_LT((*scene.CameraOf(view).Project(view.cam_from_world * point.x_in_world) - o.x_px).norm(), 1e-9);
  }
}

TEST_F(ShakyCapture, OfATripodRepeatsOnePicture) {
  SimulateOptions options = Options(
      "tripod", R"({"kind": "wave", "views": 2, "centre": [0, 0, 0], "direction": [0, 1, 0], "amplitude": [0, 0, 0]})");
  Simulate(options, SilentProgress());
  EXPECT_EQ(ReadImage8(options.output / "images/wall_0000.png").data,
            ReadImage8(options.output / "images/wall_0001.png").data);
}

TEST_F(ShakyCapture, WhereNothingShakesThereIsNothingToScale) {
  SimulateOptions options = Options("ring", R"({"kind": "ring", "radius": 2, "views": 3})");
  options.shake = 1;
  EXPECT_THROW(Simulate(options, SilentProgress()), UsageError);
  options.steady = true;
  EXPECT_TRUE(Validate(options).has_value());
  options = Options("drive", kDrive);
  options.shake = -1;
  EXPECT_TRUE(Validate(options).has_value());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "ring"));
}

}  // namespace
}  // namespace lumi
