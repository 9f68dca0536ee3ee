// From a folder of videos that fixed cameras took at once to a picture of any moment: small, and ray-traced, so that it
// is known when each began.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/image_difference/image_difference.h"
#include "simulate/capture.h"
#include "simulate/examples.h"
#include "tests/support/child_program.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kCameras = 6, kFrames = 56;
constexpr int kStarts[kCameras] = {4, 11, 0, 7, 17, 2};
constexpr double kFps = 30;

// The stage, by six of its eight cameras, as coarse as a test can wait for.
fs::path Videos(const TemporaryFolder& folder) {
  json scene = json::parse(ExampleJson("stage"));
  scene["name"] = "small";
  scene["image"] = {{"samples_per_pixel", 1}, {"quality", 95}};
  scene["cameras"][0]["size"] = {240, 180};
  for (json& light : scene["lights"]) light.erase("size_deg");
  scene["videos"].erase(scene["videos"].begin() + kCameras, scene["videos"].end());
  scene["path"]["poses"].erase(scene["path"]["poses"].begin() + 2, scene["path"]["poses"].end());
  for (int c = 0; c < kCameras; ++c)
    scene["videos"][static_cast<std::size_t>(c)].update({{"frames", kFrames}, {"start_frame", kStarts[c]}});
  WriteTextAtomically(folder / "scene.json", scene.dump());
  SimulateOptions options;
  options.scene_file = folder / "scene.json";
  options.output = folder / "capture";
  Simulate(options, SilentProgress());
  return folder / "capture" / "videos";
}

TEST(SynchronisedVideos, BecomeALumigraphOfEveryMoment) {
  const TemporaryFolder folder;
  const fs::path videos = Videos(folder), scene_folder = folder / "scene";
  const ProgramResult made = RunProgram(
      {"lumi-pipeline", videos, "-o", scene_folder, "--proxy", "plane", "--holdout", "0", "--no-video", "--json"});
  ASSERT_EQ(made.exit_code, 0) << made.err;

  // When each video began, but for where the clock begins: exact, or for one of them a frame off, as COLMAP places the
  // cameras of so small pictures differently from run to run.
  const Scene scene = OpenScene(scene_folder, {}, SilentProgress());
  ASSERT_EQ(scene.views.size(), static_cast<std::size_t>(kCameras * kFrames));
  std::map<std::string, double> began;
  for (const View& view : scene.views) {
    const std::string video = fs::path(view.name).parent_path().string();
    const double first = *view.time_s * kFps - *view.frame_index;
    const auto [it, fresh] = began.emplace(video, first);
    EXPECT_NEAR(it->second, first, 1e-3) << view.name;
  }
  ASSERT_EQ(began.size(), static_cast<std::size_t>(kCameras));
  std::vector<int> off;
  for (int c = 0; c < kCameras; ++c)
    off.push_back(static_cast<int>(std::lround(began["camera_0" + std::to_string(c)])) - kStarts[c]);
  std::vector<int> sorted = off;
  std::sort(sorted.begin(), sorted.end());
  int exact = 0;
  for (int& o : off) {
    o -= sorted[kCameras / 2];
    exact += o == 0 ? 1 : 0;
    EXPECT_LE(std::abs(o), 1);
  }
  EXPECT_GE(exact, kCameras - 1) << testing::PrintToString(off);

  // A camera's place at a moment that --time-s names, whatever the frame whose place it is: what that camera saw then.
  const auto render = [&](const std::string& time_s) {
    fs::remove_all(folder / "out");
    const ProgramResult r = RunProgram({"lumi-render", scene_folder, "-o", folder / "out", "--view",
                                        "camera_03/frame_000005.jpg", "--time-s", time_s, "--json"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    for (const auto& file : fs::recursive_directory_iterator(folder / "out"))
      if (file.path().extension() == ".png") return ReadImage8(file.path(), 3);
    return Image8();
  };
  constexpr double kItself_db = 35,
                   kOtherMoment_db =
                       5;  // of what H.264 and JPEG leave; the stage's two turning things fill a tenth of the picture
  for (const int frame : {20, 36}) {
    const Image8 picture = render(std::to_string(began["camera_03"] / kFps + frame / kFps));
    const auto seen = [&](int index) {
      std::string name = std::to_string(index);
      name = "frame_" + std::string(6 - name.size(), '0') + name + ".jpg";
      return ReadImage8(scene_folder / "images" / "camera_03" / name, 3);
    };
    ASSERT_EQ(picture.width, seen(frame).width);
    const double then_db = Compare(picture, seen(frame)).psnr_db;
    EXPECT_GT(then_db, kItself_db) << frame;
    EXPECT_GT(then_db, Compare(picture, seen(frame - 10)).psnr_db + kOtherMoment_db) << frame;
  }
}

}  // namespace
}  // namespace lumi
