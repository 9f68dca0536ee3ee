// Scenes that repeat themselves: videos, and truth at any place and time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

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

namespace fs = std::filesystem;

// A ball on a circle of radius 0.5 in front of a wall, 10 frames a turn.
constexpr const char* kTurningBall = R"({"name": "ball", "image": {"format": "png"}, "period_s": 0.5,
  "cameras": [{"size": [64, 48], "fov_deg": 50}],
  "path": {"kind": "wave", "views": 24, "fps": 20, "centre": [0, -3, 0], "look_at": [0, 0, 0], "period_s": 1.1, "hand": {"drift": 0.05, "shake_deg": 0.5}},
  "fixed_video": {"eye": [0, -3, 0], "target": [0, 0, 0], "frames": 20},
  "materials": [{"name": "wall", "texture": {"kind": "cells", "size": 0.3}}, {"name": "ball", "color": "#ff0000", "lit": false}],
  "objects": [{"kind": "quad", "size": [9, 9], "position": [0, 1.5, 0], "rotate_deg": [90, 0, 0], "material": "wall"},
              {"kind": "sphere", "radius": 0.15, "position": [0.5, 0, 0], "material": "ball", "spin": {"axis": [0, 1, 0], "centre": [0, 0, 0], "period_s": 0.5}}]
  )";

class PeriodicCapture : public ::testing::Test {
 protected:
  SimulateOptions Options(const std::string& name, const std::string& effects = "") {
    std::ofstream(folder_ / "scene.json") << kTurningBall << effects << "}";
    SimulateOptions options;
    options.scene_file = folder_ / "scene.json";
    options.output = folder_ / name;
    return options;
  }
  // One key a line: "phase" or "time_s" with its value, at the tripod's place.
  fs::path WritePath(const std::vector<std::string>& when) {
    std::string keys;
    for (const std::string& w : when)  // looks along +y: x right, y = -z, z = y
      keys +=
          (keys.empty() ? "" : ", ") + std::string("{") + w +
          R"(, "position": [0, -3, 0], "cam_from_world_xyzw": [0.7071067811865476, 0, 0, 0.7071067811865476], "vertical_fov_deg": 38.55})";
    std::ofstream(folder_ / "path.json") << R"({"format": "lumigraph-path", "keys": [)" << keys << "]}";
    return folder_ / "path.json";
  }
  TemporaryFolder folder_;
};

TEST_F(PeriodicCapture, IsAVideoWithItsPeriodAndOneOfATripodBeside) {
  SimulateOptions options = Options("capture");
  options.views = 12;
  EXPECT_EQ(Simulate(options, SilentProgress()).views, 12);
  const Scene scene = OpenScene(options.output, {}, SilentProgress());
  ASSERT_TRUE(scene.period_s.has_value());
  EXPECT_EQ(*scene.period_s, 0.5);
  for (int i = 0; i < 12; ++i) {  // the video's beginning, frame by frame
    EXPECT_EQ(scene.views[static_cast<std::size_t>(i)].frame_index, i);
    EXPECT_NEAR(*scene.views[static_cast<std::size_t>(i)].time_s, i / 20.0, 1e-12);
  }
  // The proxy for all times: the wall, and a rectangle in the ball's circle that covers it, across the view.
  EXPECT_EQ(scene.active_proxy, "billboard");
  const Mesh billboard = LoadProxy(scene, "");
  ASSERT_GE(billboard.vertices.size(), 4u);
  for (std::size_t i = billboard.vertices.size() - 4; i < billboard.vertices.size(); ++i) {
    EXPECT_NEAR(std::abs(billboard.vertices[i].x()), 0.65, 0.03);
    EXPECT_NEAR(billboard.vertices[i].y(), 0, 0.03);
    EXPECT_NEAR(std::abs(billboard.vertices[i].z()), 0.65, 0.03);
  }
  VideoReader video(options.output / "video.mp4");
  while (video.Next()) {
  }
  EXPECT_EQ(video.frames_read(), 12);
  EXPECT_NEAR(video.fps(), 20, 1e-6);
  VideoReader fixed(options.output / "fixed.mp4");
  std::vector<Image8> frames;
  while (auto frame = fixed.Next()) frames.push_back(frame->rgb);
  ASSERT_EQ(frames.size(), 20u);
  const auto difference = [](const Image8& a, const Image8& b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::abs(a.data[i] - b.data[i]);
    return sum / static_cast<double>(a.data.size());
  };
  // Half a turn moves the ball across the picture, a turn brings everything back; compression costs a level or so.
  EXPECT_LT(difference(frames[0], frames[10]), 1);
  EXPECT_GT(difference(frames[0], frames[5]), 3);
}

TEST_F(PeriodicCapture, TruthAtAPhaseIsTheTripodsPicture) {
  SimulateOptions options = Options("truth", R"(, "effects": {"noise_sigma": 9})");
  options.at_file = WritePath({R"("phase": 0)", R"("time_s": 1e-12)", R"("phase": 0.25)", R"("phase": 1.25)"});
  Simulate(options, SilentProgress());
  const auto photo = [&](int i) {
    return ReadImage8(options.output / "images" / ("ball_000" + std::to_string(i) + ".png"));
  };
  EXPECT_EQ(photo(0).data, photo(1).data);
  EXPECT_NE(photo(0).data, photo(2).data);
  EXPECT_EQ(photo(2).data, photo(3).data);  // noise would differ
  // A quarter of a turn about y takes x to -z: from the right to below. 3 m away, 64 px are 2.8 m.
  EXPECT_GT(photo(0).At(43, 24, 0), 200);
  EXPECT_LT(photo(0).At(43, 24, 1), 60);
  EXPECT_GT(photo(2).At(32, 35, 0), 200);
  const Image8 moving = ReadImage8(options.output / "truth" / "moving" / "ball_0000.png");
  EXPECT_EQ(moving.At(43, 24, 0), 255);
  EXPECT_EQ(moving.At(32, 35, 0), 128);  // at another time
  EXPECT_EQ(moving.At(32, 24, 0), 0);
  const Scene scene = OpenScene(options.output, {}, SilentProgress());
  EXPECT_NEAR(*scene.views[3].time_s, 0.625, 1e-12);
}

TEST_F(PeriodicCapture, RefusesAPathThatSaysNoTime) {
  SimulateOptions options = Options("truth");
  options.at_file = WritePath({R"("fps": 3)"});
  try {
    Simulate(options, SilentProgress());
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("time_s"));
  }
  EXPECT_FALSE(fs::exists(options.output));
}

TEST(PeriodicExamples, HaveThePeriodsOfTheThesis) {
  const SceneDescription lamp = ParseScene(ExampleJson("lamp"), "lamp", "."),
                         heli = ParseScene(ExampleJson("helicopter"), "helicopter", ".");
  EXPECT_EQ(PlanViews(lamp, 0).size(), 2000u);
  EXPECT_NEAR(*lamp.period_s * lamp.paths[0].fps, 150.37, 1e-9);
  EXPECT_EQ(PlanViews(heli, 0).size(), 900u);
  EXPECT_NEAR(*heli.period_s * heli.paths[0].fps, 15.37, 1e-9);
  EXPECT_TRUE(heli.effects.motion_blur_s.has_value());
  EXPECT_FALSE(lamp.effects.motion_blur_s.has_value());
}

}  // namespace
}  // namespace lumi
