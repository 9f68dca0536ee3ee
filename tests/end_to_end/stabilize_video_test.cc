// lumi-pipeline VIDEO --stabilize as a user starts it: a shaky film of two shots with sound, and films that are none.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"
#include "tests/support/child_program.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kFirstShot = 50, kSecondShot = 36;

void Ffmpeg(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"ffmpeg", "-v", "error", "-y"});
  const SubprocessResult result = RunSubprocess(arguments);
  ASSERT_EQ(result.exit_code, 0) << (result.tail.empty() ? "" : result.tail.back());
}

int FramesOf(const fs::path& video) {
  VideoReader reader(video);
  int frames = 0;
  while (reader.Skip()) ++frames;
  return frames;
}

bool HasSound(const fs::path& video) {
  SubprocessOptions options;
  options.separate_stdout = true;
  return !RunSubprocess({"ffprobe", "-v", "error", "-select_streams", "a", "-show_entries", "stream=codec_name", "-of", "csv=p=0", video.string()}, options).out.empty();
}

class StabilizeVideo : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    work_ = new TemporaryFolder;
    for (const auto& [example, views] : {std::pair{"plaza", kFirstShot}, {"hallway", kSecondShot}}) {
      const auto made = RunProgram({"lumi-simulate", "--example", example, "--video", "--views", std::to_string(views), "--width", "256", "--shake", "2", "-o", (*work_ / example).string(), "--quiet"});
      ASSERT_EQ(made.exit_code, 0) << made.err;
    }
    Ffmpeg({"-i", (*work_ / "plaza" / "video.mp4").string(), "-i", (*work_ / "hallway" / "video.mp4").string(), "-f", "lavfi", "-i", "sine=frequency=440:duration=3", "-filter_complex",
            "[0:v][1:v]concat=n=2:v=1[v]", "-map", "[v]", "-map", "2:a", "-r", "30", "-shortest", (*work_ / "film.mp4").string()});
  }
  static void TearDownTestSuite() {
    delete work_;
    work_ = nullptr;
  }
  static TemporaryFolder* work_;
};
TemporaryFolder* StabilizeVideo::work_ = nullptr;

TEST_F(StabilizeVideo, AFilmOfTwoShotsIsSteadiedShotByShotAndKeepsItsSound) {
  const fs::path out = *work_ / "steady.mp4";
  const std::vector<std::string> arguments{"lumi-pipeline", (*work_ / "film.mp4").string(), "--stabilize", "smooth", "-o", out.string(), "--window-frames", "40", "--split-screen", "--no-score", "--json", "--quiet"};
  const auto run = RunProgram(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["frames"], kFirstShot + kSecondShot);
  EXPECT_EQ(FramesOf(out), kFirstShot + kSecondShot);
  EXPECT_EQ(FramesOf(summary["split_screen"].get<std::string>()), kFirstShot + kSecondShot);
  EXPECT_NEAR(summary["fps"].get<double>(), 30, 1e-6);
  EXPECT_TRUE(summary["sound"].get<bool>());
  EXPECT_TRUE(HasSound(out));
  EXPECT_TRUE(fs::exists(summary["report"].get<std::string>()));
  // Every frame is rendered once; no window reaches across the cut; the crop is one for all.
  int next = 0;
  bool cut = false;
  for (const json& window : summary["windows"]) {
    EXPECT_EQ(window["first"], next);
    next = window["last"].get<int>() + 1;
    const bool before = window["reconstructed"][0] < kFirstShot;
    EXPECT_EQ(before, window["reconstructed"][1] < kFirstShot);
    if (window["cut"].get<bool>()) {
      EXPECT_EQ(next, kFirstShot);
      cut = true;
    }
    if (window["reconstructed"][1].get<int>() - window["reconstructed"][0].get<int>() > 30) {
      EXPECT_LT(window["shake_after_px"].get<double>(), 0.5 * window["shake_before_px"].get<double>());
    }
  }
  EXPECT_TRUE(cut);
  EXPECT_EQ(next, kFirstShot + kSecondShot);
  EXPECT_GT(summary["windows"].size(), 2U);

  // Again: what is made stays; killed after the cameras, it would go on from them.
  const fs::path record = *work_ / "steady-work" / "window-000" / "window.json";
  const auto written = fs::last_write_time(record);
  const auto again = RunProgram(arguments);
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(fs::last_write_time(record), written);
  EXPECT_EQ(json::parse(again.out)["kept_scale"], summary["kept_scale"]);
}

TEST_F(StabilizeVideo, WhatIsNoVideoIsRefusedInOneLine) {
  const auto refused = [&](const fs::path& film, int code, const std::string& word) {
    const auto run = RunProgram({"lumi-pipeline", film.string(), "--stabilize", "smooth", "-o", (*work_ / "no.mp4").string(), "--quiet"});
    EXPECT_EQ(run.exit_code, code) << film;
    EXPECT_NE(run.err.find(word), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(*work_ / "no.mp4"));
  };
  WriteTextAtomically(*work_ / "words.mp4", "no film");
  refused(*work_ / "words.mp4", static_cast<int>(ExitCode::kCorruptInput), "words.mp4");
  Ffmpeg({"-f", "lavfi", "-i", "sine=frequency=440:duration=1", (*work_ / "sound.mp4").string()});
  refused(*work_ / "sound.mp4", static_cast<int>(ExitCode::kCorruptInput), "sound.mp4");
  Ffmpeg({"-i", (*work_ / "film.mp4").string(), "-frames:v", "1", "-an", (*work_ / "one.mp4").string()});
  refused(*work_ / "one.mp4", static_cast<int>(ExitCode::kDataRefused), "one frame");
  Ffmpeg({"-i", (*work_ / "film.mp4").string(), "-an", "-vf", "select='not(eq(mod(n,7),3))'", "-vsync", "vfr", (*work_ / "uneven.mp4").string()});
  refused(*work_ / "uneven.mp4", static_cast<int>(ExitCode::kDataRefused), "variable frame rate");
}

TEST_F(StabilizeVideo, AnOddSizedFilmOfAStillCameraComesOutAsItWentIn) {
  Ffmpeg({"-framerate", "30", "-loop", "1", "-i", (*work_ / "plaza" / "images" / "plaza_0000.jpg").string(), "-frames:v", "24", "-vf", "crop=201:151:20:20", "-c:v", "mpeg4", "-q:v", "2", (*work_ / "still.avi").string()});
  const fs::path out = *work_ / "still.mp4";
  const auto run = RunProgram({"lumi-pipeline", (*work_ / "still.avi").string(), "--stabilize", "smooth", "-o", out.string(), "--no-score", "--json", "--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["windows"][0]["structure"], "homographies");
  EXPECT_GT(summary["kept_scale"].get<double>(), 0.99);
  EXPECT_FALSE(summary["sound"].get<bool>());
  VideoReader before(*work_ / "still.avi"), after(out);
  const auto a = before.Next(), b = after.Next();
  ASSERT_TRUE(a && b);
  double difference = 0;
  for (int y = 2; y < 149; ++y)
    for (int x = 2; x < 199; ++x) difference += std::abs(a->rgb.At(x, y, 1) - b->rgb.At(x, y, 1)) / (147.0 * 197.0);
  EXPECT_LT(difference, 6);  // code values, mean: two lossy compressions
}

}  // namespace
}  // namespace lumi
