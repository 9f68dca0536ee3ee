// Captures on disk.
#include "simulate/capture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "simulate/examples.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

class Capture : public ::testing::Test {
 protected:
  Capture() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    std::string name = std::string("lumi_simulate_") + std::to_string(::getpid()) + "_" + test->name();
    std::replace(name.begin(), name.end(), '/', '_');
    root_ = fs::temp_directory_path() / name;
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  ~Capture() override { fs::remove_all(root_); }

  fs::path WriteSceneJson(const std::string& more = "") {
    const fs::path file = root_ / "scene.json";
    std::ofstream(file) << R"({"name": "toy", "image": {"format": "png"},
      "cameras": [{"size": [64, 48], "fov_deg": 50, "model": "OPENCV", "distortion": [-0.1, 0.02, 0, 0]}],
      "path": {"kind": "ring", "views": 8, "radius": 3, "height": 1.2},
      "materials": [{"name": "m", "texture": {"kind": "cells", "size": 0.2}}],
      "objects": [{"kind": "box", "size": [1, 1, 1], "material": "m"}, {"kind": "quad", "size": [4, 4], "position": [0, 0, -0.5], "material": "m"}])"
                        << (more.empty() ? "" : ", ") << more << "}";
    return file;
  }
  SimulateOptions Options(int views = 4) {
    SimulateOptions options;
    options.scene_file = root_ / "scene.json";
    options.output = root_ / "capture";
    options.views = views;
    return options;
  }
  static std::size_t FilesIn(const fs::path& folder) {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
  }

  fs::path root_;
};

TEST_F(Capture, IsASceneWithItsTruth) {
  WriteSceneJson();
  const SimulateSummary summary = Simulate(Options(), SilentProgress());
  EXPECT_EQ(summary.views, 4);
  EXPECT_EQ(summary.width_px, 64);
  EXPECT_EQ(summary.height_px, 48);
  EXPECT_EQ(summary.effects, std::vector<std::string>{"lens_distortion"});
  const fs::path capture = root_ / "capture";

  OpenOptions open;
  open.cache_folder = root_ / "cache";
  const Scene scene = OpenScene(capture, open, SilentProgress());
  EXPECT_EQ(scene.views.size(), 4u);
  EXPECT_EQ(scene.active_proxy, "truth");
  EXPECT_GT(scene.points.size(), 1000u);
  EXPECT_LT((scene.up - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_EQ(scene.views[1].frame_index, 2);
  EXPECT_TRUE(scene.cameras[0].IsPinhole());  // opened: undistorted
  const Mesh proxy = LoadProxy(scene, "");
  EXPECT_EQ(proxy.faces.size(), 14u);

  const Scene truth = ReadColmapModel(capture / "truth" / "sparse");
  EXPECT_EQ(truth.cameras[0].model, CameraModel::kOpenCV);
  EXPECT_EQ(truth.views.size(), 4u);
  EXPECT_EQ(ReadMesh(capture / "truth" / "mesh.ply").faces.size(), 14u);
  for (const View& view : truth.views) {
    const Image8 photo = ReadImage8(capture / "images" / view.name);
    const ImageF depth = ReadImageF(capture / "truth" / "depth" / fs::path(view.name).replace_extension(".exr"));
    const Image8 silhouette =
        ReadImage8(capture / "truth" / "silhouettes" / fs::path(view.name).replace_extension(".png"));
    EXPECT_EQ(photo.width, 64);
    EXPECT_EQ(depth.width, 64);
    // The box is in the middle of the picture, its front half a unit or so before its centre.
    EXPECT_NEAR(depth.At(32, 24, 0), 2.6, 0.3);
    EXPECT_EQ(silhouette.At(32, 24, 0), 255);
    EXPECT_EQ(silhouette.At(1, 47, 0), 0);
  }
  EXPECT_THAT(ReadText(capture / "truth" / "timestamps.csv"), ::testing::HasSubstr("toy_0002.png,2,2,1"));
  EXPECT_EQ(ReadText(capture / "truth" / "scene.json"), ReadText(root_ / "scene.json"));
  EXPECT_FALSE(fs::exists(capture / ".simulating"));
}

TEST_F(Capture, IsTheSameAgainAndThenHasNothingToDo) {
  WriteSceneJson(R"("effects": {"noise_sigma": 2})");
  SimulateOptions options = Options(3);
  EXPECT_FALSE(Simulate(options, SilentProgress()).reused);
  const std::string images = Fingerprint(root_ / "capture" / "images");
  const std::string sparse = Fingerprint(root_ / "capture" / "sparse");
  const auto written = fs::last_write_time(root_ / "capture" / "lumigraph.json");
  EXPECT_TRUE(Simulate(options, SilentProgress()).reused);
  EXPECT_EQ(fs::last_write_time(root_ / "capture" / "lumigraph.json"), written);

  options.output = root_ / "second";
  Simulate(options, SilentProgress());
  EXPECT_EQ(Fingerprint(root_ / "second" / "images"), images);
  EXPECT_EQ(Fingerprint(root_ / "second" / "sparse"), sparse);
}

TEST_F(Capture, IsMadeAnewWhereSomethingChanged) {
  WriteSceneJson();
  Simulate(Options(4), SilentProgress());
  EXPECT_EQ(FilesIn(root_ / "capture" / "images"), 4u);
  // Not in place of one made with other options, unless that is asked for.
  EXPECT_THROW(Simulate(Options(3), SilentProgress()), UsageError);
  EXPECT_EQ(FilesIn(root_ / "capture" / "images"), 4u);
  SimulateOptions three = Options(3);
  three.replace = true;
  EXPECT_FALSE(Simulate(three, SilentProgress()).reused);
  EXPECT_EQ(FilesIn(root_ / "capture" / "images"), 3u);  // nothing of the larger one is left
  EXPECT_EQ(FilesIn(root_ / "capture" / "truth" / "depth"), 3u);
  WriteSceneJson(R"("effects": {"vignetting": 0.2})");
  EXPECT_FALSE(Simulate(Options(3), SilentProgress()).reused);
  fs::remove(root_ / "capture" / "images" / "toy_0000.png");
  EXPECT_FALSE(Simulate(Options(3), SilentProgress()).reused);
  EXPECT_EQ(FilesIn(root_ / "capture" / "images"), 3u);
}

TEST_F(Capture, AFolderOfSomebodyElseIsLeftAlone) {
  WriteSceneJson();
  fs::create_directories(root_ / "capture");
  std::ofstream(root_ / "capture" / "letter.txt") << "dear";
  EXPECT_THROW(Simulate(Options(), SilentProgress()), UsageError);
  EXPECT_EQ(FilesIn(root_ / "capture"), 1u);
  EXPECT_EQ(ReadText(root_ / "capture" / "letter.txt"), "dear");
}

TEST_F(Capture, WhatAKilledRunLeftIsCleared) {
  WriteSceneJson();
  fs::create_directories(root_ / "capture" / ".simulating" / "images");
  std::ofstream(root_ / "capture" / ".simulating" / "images" / "toy_0099.png") << "half";
  Simulate(Options(), SilentProgress());
  EXPECT_EQ(FilesIn(root_ / "capture" / "images"), 4u);
}

TEST_F(Capture, ABadSceneLeavesNothingBehind) {
  WriteSceneJson(R"("lights": [{}])");
  EXPECT_THROW(Simulate(Options(), SilentProgress()), InputError);
  WriteSceneJson();
  EXPECT_THROW(Simulate(Options(9), SilentProgress()), UsageError);
  EXPECT_FALSE(fs::exists(root_ / "capture"));
}

TEST_F(Capture, BlurOfOnePhotoInSeveralIsTrueToItsList) {
  WriteSceneJson();
  SimulateOptions options = Options(7);
  options.blur_s = 0.3;
  options.blur_every = 3;
  Simulate(options, SilentProgress());
  const std::string list = ReadText(options.output / "truth" / "blur.csv");
  std::istringstream lines(list);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "name,median_px,low_px,high_px");
  const Scene scene = ReadColmapModel(options.output / "truth" / "sparse");
  for (std::size_t v = 0; v < 7; ++v) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(line.substr(0, line.find(',')), scene.views[v].name);
    EXPECT_EQ(std::stod(line.substr(line.find(',') + 1)) > 1, v == 1 || v == 4) << line;
  }
  options.blur_s = 0;
  options.output = root_ / "sharp";
  EXPECT_THROW(Simulate(options, SilentProgress()), UsageError) << "every third of none";
  options.blur_every = 0;
  Simulate(options, SilentProgress());
  EXPECT_FALSE(fs::exists(options.output / "truth" / "blur.csv"));
}

TEST_F(Capture, PortraitPhotosAreStoredOnTheirSideAndSaySo) {
  WriteSceneJson();
  std::string json = ReadText(root_ / "scene.json");
  json.replace(json.find("\"png\""), 5, "\"jpg\"");
  WriteTextAtomically(root_ / "scene.json", json);
  SimulateOptions options = Options();
  options.portrait_every = 2;
  Simulate(options, SilentProgress());
  OpenOptions as_they_are;
  as_they_are.undistort = false;
  const Scene scene = OpenScene(root_ / "capture", as_they_are, SilentProgress());
  ASSERT_EQ(scene.views.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    const View& view = scene.views[i];
    EXPECT_EQ(view.orientation, i % 2 == 1 ? 6 : 1);
    EXPECT_EQ(ReadImageInfo(scene.ImagePath(view)).orientation, view.orientation);
    // Level as it was held.
    const Eigen::Vector3d up = view.cam_from_world.R().transpose() * UpInCamera(view.orientation);
    EXPECT_GT(up.z(), 0.7) << view.name;
  }
  Scene estimated = scene;
  UpdateFrameOfReference(estimated);
  EXPECT_GT(estimated.up.z(), std::cos(0.02));
}

TEST_F(Capture, WithSkewIsPhotosAndTrueCamerasOnly) {
  WriteSceneJson(R"("effects": {"skew_px": 2})");
  const SimulateSummary summary = Simulate(Options(), SilentProgress());
  EXPECT_EQ(summary.effects, (std::vector<std::string>{"lens_distortion", "skew"}));
  EXPECT_FALSE(fs::exists(root_ / "capture" / "sparse"));
  EXPECT_FALSE(fs::exists(root_ / "capture" / "lumigraph.json"));
  EXPECT_THAT(ReadText(root_ / "capture" / "truth" / "cameras.json"), ::testing::HasSubstr("\"skew_px\": 2.0"));
  EXPECT_TRUE(Simulate(Options(), SilentProgress()).reused);
}

class ExampleCapture : public Capture, public ::testing::WithParamInterface<const char*> {};

TEST_P(ExampleCapture, RunsSmall) {
  SimulateOptions options;
  options.example = GetParam();
  options.output = root_ / "capture";
  options.views = 3;
  options.width_px = 64;
  const SimulateSummary summary = Simulate(options, SilentProgress());
  EXPECT_EQ(summary.width_px, 64);
  EXPECT_TRUE(summary.effects.empty());
  EXPECT_GT(summary.points, 100);
  for (const auto& file : fs::directory_iterator(root_ / "capture" / "images")) {
    const Image8 photo = ReadImage8(file.path());
    EXPECT_EQ(photo.width, 64);
    double sum = 0, sum2 = 0;
    for (const std::uint8_t value : photo.data) sum += value, sum2 += value * value;
    const double n = static_cast<double>(photo.data.size());
    EXPECT_GT(sum2 / n - (sum / n) * (sum / n), 15.0 * 15.0) << file.path();  // something is to be seen
  }
  for (const auto& file : fs::directory_iterator(root_ / "capture" / "truth" / "silhouettes")) {
    const Image8 silhouette = ReadImage8(file.path());
    const auto white = std::count(silhouette.data.begin(), silhouette.data.end(), 255);
    EXPECT_LT(white, static_cast<std::ptrdiff_t>(silhouette.data.size()));
    if (options.example == "car" || options.example == "person") {
      EXPECT_GT(white, static_cast<std::ptrdiff_t>(silhouette.data.size() / 20));
      // The object alone, all of it in the picture.
      for (int x = 0; x < silhouette.width; ++x) {
        EXPECT_EQ(silhouette.At(x, 0, 0), 0);
        EXPECT_EQ(silhouette.At(x, silhouette.height - 1, 0), 0);
      }
      for (int y = 0; y < silhouette.height; ++y) {
        EXPECT_EQ(silhouette.At(0, y, 0), 0);
        EXPECT_EQ(silhouette.At(silhouette.width - 1, y, 0), 0);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ExampleCapture,
                         ::testing::Values("desk", "plaza", "hallway", "car", "person", "vertigo"));

}  // namespace
}  // namespace lumi
