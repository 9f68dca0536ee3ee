#include "render/path/camera_path.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "capture.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

struct TemporaryFile {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("lumi-path-test-" + std::to_string(::getpid()) + ".json");
  ~TemporaryFile() { std::filesystem::remove(path); }
};

TEST(CameraPath, ComesBackFromItsFile) {
  const test::Capture c = test::MakeCapture(6, 16);
  const CameraPath path = PathThroughPhotos(c.scene, 4, 25);
  TemporaryFile file;
  WriteCameraPath(file.path, path);
  const CameraPath back = ReadCameraPath(file.path);
  ASSERT_EQ(back.keys.size(), path.keys.size());
  EXPECT_EQ(back.fps, 25);
  for (std::size_t i = 0; i < path.keys.size(); ++i) {
    EXPECT_LT((back.keys[i].cam_from_world.OriginInSource() - path.keys[i].cam_from_world.OriginInSource()).norm(), 1e-12);
    EXPECT_NEAR(back.keys[i].time_s, path.keys[i].time_s, 1e-12);
  }
}

TEST(CameraPath, GoesThroughItsKeysWithoutJumps) {
  CameraPath path;
  path.fps = 50;
  for (int i = 0; i < 5; ++i)
    path.keys.push_back({LookAt({std::cos(i * 0.4) * 3, std::sin(i * 0.4) * 3, 1}, {0, 0, 0}, {0, 0, 1}), 0.8, i * i * 0.25});
  const auto views = SamplePath(path, 64, 48);
  ASSERT_EQ(views.size(), 200u);
  EXPECT_LT((views.front().centre - path.keys.front().cam_from_world.OriginInSource()).norm(), 1e-9);
  EXPECT_LT((views.back().centre - path.keys.back().cam_from_world.OriginInSource()).norm(), 1e-9);
  double longest = 0;
  for (std::size_t i = 1; i < views.size(); ++i) longest = std::max(longest, (views[i].centre - views[i - 1].centre).norm());
  // The fastest stretch goes 1.2 units in 0.25 s: 0.096 a frame on the mean, not twice that anywhere.
  EXPECT_LT(longest, 0.19);
}

TEST(CameraPath, StraightAndEvenKeysGiveAStraightEvenPath) {
  CameraPath path;
  path.fps = 10;
  for (int i = 0; i < 4; ++i) path.keys.push_back({Rigid3{Eigen::Quaterniond::Identity(), {-1.0 * i, 0, 0}}, 0.8, 1.0 * i});
  const auto views = SamplePath(path, 64, 48);
  for (std::size_t i = 0; i < views.size(); ++i)
    EXPECT_LT((views[i].centre - Eigen::Vector3d(3.0 * static_cast<double>(i) / static_cast<double>(views.size() - 1), 0, 0)).norm(), 1e-9);
}

TEST(CameraPath, ThroughAScenesPhotosStaysNearThem) {
  const test::Capture c = test::MakeCapture(12, 16);
  for (const RenderView& v : SamplePath(PathThroughPhotos(c.scene, 3, 30), 32, 24)) {
    double nearest = 1e9;
    for (const View& view : c.scene.views) nearest = std::min(nearest, (view.CentreInWorld() - v.centre).norm());
    EXPECT_LT(nearest, 1.0);
  }
}

TEST(CameraPath, ASinglePhotoAndNoneAreHandled) {
  const test::Capture c = test::MakeCapture(1, 16);
  EXPECT_EQ(SamplePath(PathThroughPhotos(c.scene, 3, 30), 32, 24).size(), 1u);
  EXPECT_THROW(PathThroughPhotos(Scene{}, 3, 30), DataError);
}

TEST(CameraPath, BadFilesAreRefusedWithTheirReason) {
  TemporaryFile file;
  const auto write = [&](const std::string& text) { std::ofstream(file.path) << text; };
  const std::string key = R"({"time_s": 0, "position": [0,0,0], "cam_from_world_xyzw": [0,0,0,1], "vertical_fov_deg": 40})";
  write(R"({"format": "lumigraph-path", "version": 1, "keys": [)" + key + "]}");
  EXPECT_NO_THROW(ReadCameraPath(file.path));
  for (const std::string& text :
       {std::string("{"), std::string("[]"), std::string(R"({"format": "other"})"), R"({"format": "lumigraph-path", "version": 9, "keys": [)" + key + "]}",
        std::string(R"({"format": "lumigraph-path", "version": 1, "keys": []})"),
        R"({"format": "lumigraph-path", "version": 1, "keys": [)" + key + "," + key + "]}",   // times do not ascend
        R"({"format": "lumigraph-path", "version": 1, "fps": 0, "keys": [)" + key + "]}"}) {
    write(text);
    EXPECT_THROW(ReadCameraPath(file.path), InputError) << text;
  }
}

}  // namespace
}  // namespace lumi
