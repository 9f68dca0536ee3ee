// lumi-pipeline VIDEO --stabilize as a user starts it: a shaky film of two shots with sound, and films that are none.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
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
  return !RunSubprocess({"ffprobe", "-v", "error", "-select_streams", "a", "-show_entries", "stream=codec_name", "-of",
                         "csv=p=0", video.string()},
                        options)
              .out.empty();
}

class StabilizeVideo : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    work_ = new TemporaryFolder;
    for (const auto& [example, views] : {std::pair{"plaza", kFirstShot}, {"hallway", kSecondShot}}) {
      const auto made = RunProgram({"lumi-simulate", "--example", example, "--video", "--views", std::to_string(views),
                                    "--width", "256", "--shake", "2", "-o", (*work_ / example).string(), "--quiet"});
      ASSERT_EQ(made.exit_code, 0) << made.err;
    }
    Ffmpeg({"-i", (*work_ / "plaza" / "video.mp4").string(), "-i", (*work_ / "hallway" / "video.mp4").string(), "-f",
            "lavfi", "-i", "sine=frequency=440:duration=3", "-filter_complex", "[0:v][1:v]concat=n=2:v=1[v]", "-map",
            "[v]", "-map", "2:a", "-r", "30", (*work_ / "film.mp4").string()});
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
  const std::vector<std::string> arguments{"lumi-pipeline",
                                           (*work_ / "film.mp4").string(),
                                           "--stabilize",
                                           "smooth",
                                           "-o",
                                           out.string(),
                                           "--window-frames",
                                           "40",
                                           "--split-screen",
                                           "--no-score",
                                           "--json",
                                           "--quiet"};
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

// Of the files below `folder` whose parent folder has that name: which file it is and when it was written.
using Stamps = std::map<std::string, std::pair<ino_t, fs::file_time_type>>;
Stamps StampsOf(const fs::path& folder, const std::string& parent, const std::string& extension) {
  Stamps stamps;
  std::error_code gone;
  for (fs::recursive_directory_iterator it(folder, gone), end; !gone && it != end; it.increment(gone)) {
    struct stat status = {};
    if (it->path().extension() == extension && !it->path().filename().string().starts_with(".") &&
        it->path().parent_path().parent_path().filename() == parent && ::stat(it->path().c_str(), &status) == 0)
      stamps[fs::relative(it->path(), folder).string()] = {status.st_ino, it->last_write_time()};
  }
  return stamps;
}

TEST_F(StabilizeVideo, KilledInTheMiddleOfAWindowItGoesOnWithEveryFrameThatItHasRendered) {
  constexpr int kFrames = 36;
  const fs::path out = *work_ / "killed.mp4", folder = *work_ / "killed-work", film = *work_ / "walk.mp4";
  Ffmpeg({"-i", (*work_ / "plaza" / "video.mp4").string(), "-frames:v", std::to_string(kFrames), film.string()});
  const auto command = [&](const fs::path& to) {
    return std::vector<std::string>{"lumi-pipeline", film.string(),     "--stabilize", "smooth",     "-o",
                                    to.string(),     "--window-frames", "30",          "--no-score", "--json"};
  };
  const auto whole = RunProgram(command(*work_ / "whole.mp4"));
  ASSERT_EQ(whole.exit_code, 0) << whole.err;
  ASSERT_EQ(json::parse(whole.out)["windows"].size(), 2U);
  EXPECT_EQ(json::parse(whole.out)["frames_reused"], 0);
  EXPECT_GT(json::parse(whole.out)["peak_memory_mb"].get<double>(), 50);
  EXPECT_LT(json::parse(whole.out)["peak_memory_mb"].get<double>(), 4096);

  const std::map<std::string, std::string> environment = {{"LUMI_PROGRESS_PIPE", "1"}};
  const auto ended = [&](ChildProgram& run, int code) {
    const ProgramResult result = run.Wait();
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_TRUE(WaitForNoProcessNaming(folder));
    EXPECT_FALSE(fs::exists(out));
    if (code == 130) {
      EXPECT_TRUE(!result.ErrorLines().empty() && result.ErrorLines().back().starts_with("lumi-pipeline: "))
          << result.err;
    }
  };
  const auto rendered = [&](const char* window) { return StampsOf(folder / window, "steady", ".png"); };
  const auto wait_for_frames = [&](const char* window, std::size_t frames) {
    for (int i = 0; i < 60000 && rendered(window).size() < frames; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    EXPECT_GE(rendered(window).size(), frames);
  };
  {
    ChildProgram run(command(out), environment);
    ASSERT_TRUE(run.WaitForErrorText("stage 2/2 cameras: ")) << run.Wait().err;
    run.Signal(SIGKILL);
    ended(run, 128 + SIGKILL);
  }
  const fs::path first_path = folder / "window-000" / "path.json";
  const auto solved = fs::last_write_time(first_path);
  const Stamps photos = StampsOf(folder, "window-000", ".jpg");
  EXPECT_GT(photos.size(), 20U);
  Stamps kept;
  const auto none_is_lost = [&] {
    EXPECT_EQ(fs::last_write_time(first_path), solved);
    EXPECT_EQ(StampsOf(folder, "window-000", ".jpg"), photos);  // what the rendered frames are recognised by
    const Stamps now = StampsOf(folder, "steady", ".png");
    for (const auto& [name, stamp] : kept) EXPECT_TRUE(now.contains(name) && now.at(name) == stamp) << name;
    kept = now;
  };
  for (const auto& [window, signal] : {std::pair{"window-000", SIGINT}, {"window-001", SIGKILL}}) {
    SCOPED_TRACE(window);
    ChildProgram run(command(out), environment);
    wait_for_frames(window, 3);
    run.Signal(signal);
    ended(run, signal == SIGINT ? 130 : 128 + signal);
    none_is_lost();
  }
  const auto last = RunProgram(command(out));
  ASSERT_EQ(last.exit_code, 0) << last.err;
  EXPECT_EQ(json::parse(last.out)["frames_reused"], kept.size());
  none_is_lost();
  EXPECT_EQ(kept.size(), static_cast<std::size_t>(kFrames));
  // As if nothing had happened.
  for (const auto& [name, stamp] : kept)
    EXPECT_EQ(ReadText(folder / name), ReadText(*work_ / "whole-work" / name)) << name;
  EXPECT_EQ(ReadText(out), ReadText(*work_ / "whole.mp4"));
  for (const auto& entry : fs::recursive_directory_iterator(work_->path()))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".") && entry.path().filename() != ".undistorted" &&
                 entry.path().filename() != ".written-in")
        << entry.path() << " was left half-written";
}

TEST_F(StabilizeVideo, ALaterShotThatIsTooShortForItsModelIsSmoothAndTheFilmIsNotLost) {
  Ffmpeg({"-i", (*work_ / "plaza" / "video.mp4").string(), "-i", (*work_ / "hallway" / "video.mp4").string(),
          "-filter_complex", "[0:v]trim=end_frame=30[a];[1:v]trim=end_frame=2[b];[a][b]concat=n=2:v=1[v]", "-map",
          "[v]", "-r", "30", (*work_ / "end.mp4").string()});
  const auto run = RunProgram({"lumi-pipeline", (*work_ / "end.mp4").string(), "--stabilize", "linear", "-o",
                               (*work_ / "end-steady.mp4").string(), "--no-score", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json windows = json::parse(run.out)["windows"];
  ASSERT_EQ(windows.size(), 2U);
  EXPECT_EQ(windows[0]["model"], "linear");
  EXPECT_EQ(windows[1]["model"], "smooth");
  EXPECT_NE(run.err.find("warning: frames 30 to 31: "), std::string::npos) << run.err;
  EXPECT_EQ(FramesOf(*work_ / "end-steady.mp4"), 32);
}

TEST_F(StabilizeVideo, WhatIsNoVideoIsRefusedInOneLine) {
  const auto refused = [&](const fs::path& film, int code, const std::string& word) {
    const auto run = RunProgram(
        {"lumi-pipeline", film.string(), "--stabilize", "smooth", "-o", (*work_ / "no.mp4").string(), "--quiet"});
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
}

TEST_F(StabilizeVideo, AnOddSizedFilmOfAStillCameraComesOutAsItWentIn) {
  Ffmpeg({"-framerate", "30", "-loop", "1", "-i", (*work_ / "plaza" / "images" / "plaza_0000.jpg").string(),
          "-frames:v", "24", "-vf", "crop=201:151:20:20", "-c:v", "mpeg4", "-q:v", "2",
          (*work_ / "still.avi").string()});
  const fs::path out = *work_ / "still.mp4";
  const auto run = RunProgram({"lumi-pipeline", (*work_ / "still.avi").string(), "--stabilize", "smooth", "-o",
                               out.string(), "--no-score", "--json", "--quiet"});
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
