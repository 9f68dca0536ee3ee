// lumi-timeperiodic as its user runs it: videos in, JSON, plots and masks out, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <random>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "tests/support/child_program.h"
#include "tests/timeperiodic/painted_video.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

fs::path Written(const PaintedVideo& painted, const fs::path& path) {
  VideoWriter writer(path, 30);
  for (const Image8& frame : painted.Frames()) writer.Add(frame);
  writer.Finish();
  return path;
}

TEST(PeriodProgram, PrintsThePeriodOfACompressedVideoAndPlotsIt) {
  const TemporaryFolder folder;
  PaintedVideo painted;
  painted.width = 96, painted.height = 72, painted.frames = 240;
  const fs::path video = Written(painted, folder / "fixed.mp4");
  const ProgramResult run = RunProgram({"lumi-timeperiodic", "period", video, "--plot", folder / "plot.svg", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_EQ(j["schema"], "lumi-timeperiodic");
  EXPECT_NEAR(j["period_frames"].get<double>(), 15.37, 5e-4 * 15.37);
  EXPECT_NEAR(j["period_s"].get<double>(), 15.37 / 30, 1e-3);
  EXPECT_GT(j["period_sigma_frames"].get<double>(), 0);
  EXPECT_NEAR(j["samples_per_window"].get<double>(), 240 / 15.37, 0.02);
  ASSERT_FALSE(j["harmonics_considered"].empty());
  EXPECT_EQ(j["harmonics_considered"][0]["relation"], "taken");
  EXPECT_THAT(ReadText(folder / "plot.svg"), HasSubstr("T = 15.37"));
  const ProgramResult again = RunProgram({"lumi-timeperiodic", "period", video, "--json", "--threads", "1"});
  EXPECT_EQ(json::parse(again.out)["period_frames"], j["period_frames"]);  // on any number of threads

  const ProgramResult counted =
      RunProgram({"lumi-timeperiodic", "period", video, "--frames", "3", "157", "--count", "10", "--json"});
  EXPECT_NEAR(json::parse(counted.out)["period_frames"].get<double>(), 15.4, 1e-9);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "period", video, "--frames", "3", "240", "--count", "10"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "period", video, "--frames", "3", "157"}).exit_code, 2);
  const ProgramResult aliased =
      RunProgram({"lumi-timeperiodic", "period", video, "--frames", "3", "18", "--count", "10", "--json"});
  EXPECT_EQ(aliased.exit_code, 1);
  EXPECT_THAT(json::parse(aliased.out)["error"]["message"].get<std::string>(), HasSubstr("aliased"));
}

TEST(PeriodProgram, OfAVariableRateAndOfADroppedFrameIsThatOfTheScene) {
  const TemporaryFolder folder;
  constexpr double kPeriod_s = 15.37 / 30;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> step_s(0.02, 0.04);
  std::vector<double> jittered{0}, dropped;
  while (jittered.size() < 240) jittered.push_back(jittered.back() + step_s(random));
  for (int i = 0; i < 300; ++i)
    if (i != 151) dropped.push_back(i / 30.0);
  for (const auto& times_s : {jittered, dropped}) {
    PaintedVideo painted;
    painted.width = 96, painted.height = 72, painted.frames = static_cast<int>(times_s.size());
    painted.turns = [&](double i) { return times_s[static_cast<std::size_t>(i)] / kPeriod_s; };
    const fs::path video = folder / "phone.mp4";
    VideoWriter writer(video, 30);
    for (int i = 0; i < painted.frames; ++i) writer.Add(painted.Frame(i), times_s[static_cast<std::size_t>(i)]);
    writer.Finish();
    const ProgramResult run = RunProgram({"lumi-timeperiodic", "period", video, "--json"});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr("unevenly spaced"));
    const json j = json::parse(run.out);
    EXPECT_NEAR(j["period_s"].get<double>(), kPeriod_s, 5e-4 * kPeriod_s);
    EXPECT_TRUE(j["slips"].empty());
    // Counted between frames 3 and 157: their times, not their numbers.
    const ProgramResult counted =
        RunProgram({"lumi-timeperiodic", "period", video, "--frames", "3", "157", "--count", "9", "--json"});
    EXPECT_NEAR(json::parse(counted.out)["period_s"].get<double>(), (times_s[157] - times_s[3]) / 9, 1e-4);
  }
}

TEST(PeriodProgram, MeasuresWhatThePeriodCosts) {
  const TemporaryFolder folder;
  PaintedVideo painted;
  painted.width = 96, painted.height = 72, painted.frames = 240;
  const fs::path video = Written(painted, folder / "fixed.mp4"), out = folder / "out";
  std::vector<std::string> command{"lumi-timeperiodic", "period", video, "--tradeoff", out, "--json"};
  const ProgramResult alone = RunProgram(command);
  ASSERT_EQ(alone.exit_code, 0) << alone.err;
  const json itself = json::parse(alone.out)["tradeoff"];
  EXPECT_EQ(itself["reference"], itself["points"][0]["name"]);  // no row has more pixels: it is the video's own size
  EXPECT_TRUE(itself["points"][0]["error_percent"].is_null());

  command.insert(command.end(), {"--true-period", "15.37"});
  const ProgramResult run = RunProgram(command);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json rows = json::parse(run.out)["tradeoff"]["points"];
  ASSERT_EQ(rows.size(), 7U);  // as given; 24 and 48 px; 30, 60 and 120 frames; 24 px and 30 frames
  EXPECT_EQ(rows[0]["name"], "as given: 96 px, 240 frames");
  EXPECT_EQ(rows[6]["settings"], (json{{"look_width", 24}, {"frames", 30}}));
  int front = 0;
  for (const json& row : rows) {
    EXPECT_GT(row["seconds"].get<double>(), 0);
    if (row.contains("failed")) continue;
    EXPECT_EQ(row["psnr_holdout_db"], nullptr);  // a video alone has no scene
    front += row["front"].get<bool>();
  }
  EXPECT_GE(front, 1);
  EXPECT_LT(rows[0]["error_percent"].get<double>(), 0.05);
  EXPECT_TRUE(rows[3].contains("failed") || rows[3]["error_percent"] > rows[0]["error_percent"]) << "two periods";
  EXPECT_EQ(json::parse(ReadText(out / "period.json"))["points"], rows);
  EXPECT_THAT(ReadText(out / "period.csv"), HasSubstr("setting,line,look_width,frames,seconds,period_frames,"));
  EXPECT_THAT(ReadText(out / "period.svg"), HasSubstr("240 frames"));
  command.erase(std::find(command.begin(), command.end(), "--json"));
  EXPECT_THAT(RunProgram(command).out, HasSubstr("errors against the known period"));
}

TEST(PeriodProgram, RefusesWhatHasNoPeriodByName) {
  const TemporaryFolder folder;
  PaintedVideo painted;
  painted.moves = false;
  painted.frames = 90;
  const ProgramResult still =
      RunProgram({"lumi-timeperiodic", "period", Written(painted, folder / "still.mp4"), "--json"});
  EXPECT_EQ(still.exit_code, 1);
  EXPECT_THAT(json::parse(still.out)["error"]["message"].get<std::string>(), HasSubstr("no period"));
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "period", folder / "absent.mp4"}).exit_code, 3);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "period", folder / "still.mp4", "--min-period", "1"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "period", folder / "still.mp4", "--true-period", "9"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "period", folder / "still.mp4", "--frames", "3", "30", "--count", "2",
                        "--tradeoff", folder / "out"})
                .exit_code,
            2);
  EXPECT_FALSE(fs::exists(folder / "out"));
  const fs::path scene = folder / "scene";
  EXPECT_EQ(
      RunProgram({"lumi-timeperiodic", "calibrate", folder / "still.mp4", "-o", scene, "--masks-only", "--tradeoff"})
          .exit_code,
      2);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "calibrate", folder / "still.mp4", "-o", scene, "--period-frames", "1.5"})
                .exit_code,
            1);
  EXPECT_EQ(RunProgram({"lumi-timeperiodic", "calibrate", folder / "still.mp4", "-o", scene, "--period-frames", "9",
                        "--fixed-video", folder / "still.mp4"})
                .exit_code,
            2);
  EXPECT_FALSE(fs::exists(scene));
}

TEST(CalibrateProgram, WritesMasksToBeLookedAt) {
  const TemporaryFolder folder;
  PaintedVideo painted;
  painted.width = 128, painted.height = 96, painted.frames = 120;
  painted.camera = [](double t) {
    return Eigen::Vector2d(4 * std::sin(t / 9.1) + std::sin(t / 23.7), std::sin(t / 6.3));
  };
  const fs::path video = Written(painted, folder / "moving.mp4"), scene = folder / "scene";
  const std::vector<std::string> command{"lumi-timeperiodic", "calibrate", video, "-o", scene,
                                         "--masks-only",      "--json"};
  const ProgramResult run = RunProgram(command);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_EQ(j["period_from"], "moving video");
  EXPECT_NEAR(j["period_frames"].get<double>(), 15.37, 2e-3 * 15.37);
  EXPECT_GT(j["masks"]["moving_share"].get<double>(), 0.02);
  EXPECT_LT(j["masks"]["moving_share"].get<double>(), 0.5);
  int masks = 0;
  for (const auto& file : fs::directory_iterator(scene / "timeperiodic" / "masks"))
    masks += file.path().extension() == ".png" ? 1 : 0;
  EXPECT_EQ(masks, 120);
  EXPECT_EQ(ReadImageInfo(scene / "timeperiodic" / "masks" / "frame_000007.jpg.png").width, 128);
  const ProgramResult again = RunProgram(command);
  EXPECT_TRUE(json::parse(again.out)["reused"].get<bool>());
  // Not where what it made is gone.
  fs::remove_all(scene / "timeperiodic" / "masks");
  const ProgramResult anew = RunProgram(command);
  EXPECT_FALSE(json::parse(anew.out)["reused"].get<bool>());
  const fs::path mask = scene / "timeperiodic" / "masks" / "frame_000007.jpg.png";
  EXPECT_TRUE(fs::exists(mask));
  // What was edited is not made anew.
  WriteImage(mask, Image8(128, 96, 1, 255));
  const std::string edited = ReadText(mask);
  const ProgramResult refused = RunProgram(command);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.out, HasSubstr("--masks"));
  EXPECT_EQ(ReadText(mask), edited);
}

TEST(PeriodProgram, CountsThePendulumWithinAFrame) {
  const fs::path video = fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data" / "pendulum" / "clock.mpg";
  if (!fs::exists(video)) GTEST_SKIP() << "no " << video;
  const ProgramResult run = RunProgram({"lumi-timeperiodic", "period", video, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_NEAR(j["period_frames"].get<double>(), 22, 1);  // as counted by eye
  EXPECT_TRUE(j["few_cycles"].get<bool>());
}

}  // namespace
}  // namespace lumi
