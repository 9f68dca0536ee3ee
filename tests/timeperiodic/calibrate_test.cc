// A small ray-traced turning lamp, filmed by a waved camera and from a tripod: all of lumi-timeperiodic calibrate,
// against the truth.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "simulate/capture.h"
#include "tests/support/child_program.h"
#include "tests/support/quick_lamp.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kFrames = 80;
constexpr double kLampPeriod = 15.37;

fs::path Capture(const TemporaryFolder& folder) {
  json scene = QuickLamp(240, 180, kLampPeriod);
  scene["name"] = "small";
  scene["path"]["views"] = kFrames;
  scene["path"]["period_s"] = 1.6;
  scene["fixed_video"]["frames"] = 60;
  WriteTextAtomically(folder / "scene.json", scene.dump());
  SimulateOptions options;
  options.scene_file = folder / "scene.json";
  options.output = folder / "capture";
  Simulate(options, SilentProgress());
  return folder / "capture";
}

TEST(CalibratedVideo, HasCamerasTimesAndPeriod) {
  const TemporaryFolder folder;
  const fs::path capture = Capture(folder), out = folder / "scene";
  const Scene truth = OpenScene(capture, {}, SilentProgress());
  const double focal = truth.cameras[0].FocalPx().x();
  std::vector<std::string> command{"lumi-timeperiodic",
                                   "calibrate",
                                   capture / "video.mp4",
                                   "-o",
                                   out,
                                   "--fixed-video",
                                   capture / "fixed.mp4",
                                   "--backend",
                                   "factorization",
                                   "--focal-px",
                                   std::to_string(focal),
                                   "--json"};
  const ProgramResult run = RunProgram(command);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_EQ(j["period_from"], "fixed video");
  EXPECT_NEAR(j["period_frames"].get<double>(), kLampPeriod, 5e-4 * kLampPeriod);
  EXPECT_EQ(j["images_registered"], kFrames);
  EXPECT_NEAR(j["samples_per_window"].get<double>(), kFrames / kLampPeriod, 0.01);

  const Scene scene = OpenScene(out, {}, SilentProgress());
  ASSERT_TRUE(scene.period_s.has_value());
  EXPECT_NEAR(*scene.period_s * 30, kLampPeriod, 5e-4 * kLampPeriod);
  ASSERT_EQ(scene.views.size(), static_cast<std::size_t>(kFrames));
  // Distances between cameras, in units of the farthest pair's: 1 % is what small, noisy frames allow.
  const auto distance = [](const Scene& s, std::size_t a, std::size_t b) {
    return (s.views[a].CentreInWorld() - s.views[b].CentreInWorld()).norm();
  };
  double longest_true = 0, longest = 0;
  std::size_t a = 0, b = 0;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (distance(truth, i, k) > longest_true) longest_true = distance(truth, i, k), a = i, b = k;
  longest = distance(scene, a, b);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    EXPECT_EQ(scene.views[i].frame_index, static_cast<int>(i));
    EXPECT_NEAR(*scene.views[i].time_s, static_cast<double>(i) / 30, 1e-6);
    EXPECT_NEAR(distance(scene, i, a) / longest, distance(truth, i, a) / longest_true, 0.01) << i;
  }

  // What moves is masked: the true moving pixels, but for their fringe; and most of the picture is not.
  double moving = 0, covered = 0, masked = 0, pixels = 0;
  for (int i = 0; i < kFrames; i += 13) {
    const Image8 found = ReadImage8(out / "masks" / (scene.views[static_cast<std::size_t>(i)].name + ".png"));
    const Image8 is = ReadImage8(capture / "truth" / "moving" /
                                 (fs::path(truth.views[static_cast<std::size_t>(i)].name).stem().string() + ".png"));
    ASSERT_EQ(found.width, is.width);
    for (int y = 0; y < is.height; ++y)
      for (int x = 0; x < is.width; ++x) {
        moving += is.At(x, y, 0) == 255;
        covered += is.At(x, y, 0) == 255 && found.At(x, y, 0) < 128;
        masked += found.At(x, y, 0) < 128;
        ++pixels;
      }
  }
  EXPECT_GT(covered / moving, 0.85);
  EXPECT_LT(masked / pixels, 0.35);

  EXPECT_TRUE(fs::exists(out / "timeperiodic" / "sampling.svg"));
  const ProgramResult sampling = RunProgram({"lumi-timeperiodic", "sampling", out, "--json"});
  ASSERT_EQ(sampling.exit_code, 0) << sampling.err;
  EXPECT_NEAR(json::parse(sampling.out)["samples_per_window"].get<double>(), kFrames / kLampPeriod, 0.01);

  // What the period costs, and what it brings: held-out frames of the scene that is there, rendered with each row's
  // period.
  command.push_back("--tradeoff");
  const ProgramResult measured = RunProgram(command);
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  const json with = json::parse(measured.out);
  EXPECT_EQ(with["reused"], true);
  EXPECT_EQ(OpenScene(out, {}, SilentProgress()).period_s, scene.period_s) << "the scene itself stays";
  double best_db = 0, worst_db = 1e9;
  for (const json& row : with["tradeoff"]["points"]) {
    EXPECT_GT(row["seconds"].get<double>(), 0);
    if (row.contains("failed")) continue;
    EXPECT_GT(row["period_frames"].get<double>(), 2);
    best_db = std::max(best_db, row["psnr_holdout_db"].get<double>());
    worst_db = std::min(worst_db, row["psnr_holdout_db"].get<double>());
  }
  EXPECT_GT(worst_db, 10);
  EXPECT_LT(best_db, 60);
  EXPECT_NEAR(with["tradeoff"]["points"][0]["psnr_holdout_db"].get<double>(), best_db, 0.5)
      << "all frames at their width find the period";
  for (const char* ending : {".json", ".csv", ".svg"})
    EXPECT_TRUE(fs::exists(out / "tradeoff" / (std::string("period") + ending))) << ending;

  // A part of the scene is gone: calibrated anew, which takes a while and is not waited for here.
  command.pop_back();
  for (const char* part : {"lumigraph.json", "images", "projective.json"}) {
    if (!fs::exists(out / part)) continue;
    fs::rename(out / part, folder / "away");
    ChildProgram anew(command, {{"LUMI_PROGRESS_PIPE", "1"}});
    EXPECT_TRUE(anew.WaitForErrorText("@progress")) << part << " is not missed: " << anew.Wait().out;
    anew.Signal(SIGINT);
    anew.Wait();
    fs::remove_all(out / part);
    fs::rename(folder / "away", out / part);
  }
}

}  // namespace
}  // namespace lumi
