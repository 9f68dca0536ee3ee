// Films whose frames come when they come: a phone's variable rate, frames that were dropped, sound that is shorter or
// longer than the pictures, times that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
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

constexpr double kMillisecond = 1e-3;

void RunFfmpeg(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"ffmpeg", "-v", "error", "-y"});
  const SubprocessResult result = RunSubprocess(arguments);
  ASSERT_EQ(result.exit_code, 0) << (result.tail.empty() ? "" : result.tail.back());
}

// What ffprobe says of one entry: "a:0", "stream=duration".
double Probed(const fs::path& video, const std::string& stream, const std::string& entry) {
  SubprocessOptions options;
  options.separate_stdout = true;
  const std::string out = RunSubprocess({"ffprobe", "-v", "error", "-select_streams", stream, "-show_entries", entry,
                                         "-of", "csv=p=0", "file:" + video.string()},
                                        options)
                              .out;
  return std::strtod(out.c_str(), nullptr);
}

json Steadied(const fs::path& film, const fs::path& out, std::vector<std::string> more = {}) {
  std::vector<std::string> argv{"lumi-pipeline", film.string(), "--stabilize", "smooth", "-o",
                                out.string(),    "--json",      "--quiet"};
  argv.insert(argv.end(), more.begin(), more.end());
  const auto run = RunProgram(argv);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? json::parse(run.out) : json();
}

void ExpectSameTimes(const fs::path& film, const fs::path& out) {
  const std::vector<double> in_s = ReadVideoTimes(film).time_s, out_s = ReadVideoTimes(out).time_s;
  ASSERT_EQ(in_s.size(), out_s.size());
  for (std::size_t i = 0; i < in_s.size(); ++i) EXPECT_NEAR(out_s[i], in_s[i], kMillisecond) << i;
}

// A shaky walk along crates before a wall, every 10 ms.
class FilmTimes : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    work_ = new TemporaryFolder;
    json scene = json::parse(R"({"name": "film", "cameras": [{"size": [240, 180], "fov_deg": 60}],
      "lights": [{"towards": [-0.4, -0.8, 1], "size_deg": 1}], "ambient": {"sky": "#909090", "ground": "#605848"},
      "materials": [
        {"name": "wall", "texture": {"kind": "cells", "size": 0.25, "colors": ["#a06040", "#e0d0b0", "#304860"]}},
        {"name": "crate", "texture": {"kind": "glyphs", "size": [0.06, 0.09], "colors": ["#d8c090", "#402010"]}}],
      "objects": [{"kind": "quad", "size": [30, 12], "position": [0, 3, 1], "rotate_deg": [90, 0, 0],
                   "material": "wall"}],
      "path": {"kind": "walk", "views": 221, "fps": 100, "from": [-0.75, -4, 1.4], "to": [0.75, -4, 1.4],
               "direction": [0, 1, -0.1], "gait": {"bob": 0.03, "sway": 0.02, "shake_deg": 0.8}}})");
    const double crates[][3] = {{-2.2, 1.5, 1.2}, {-0.9, 0.2, 0.7}, {0.6, 1.0, 1.0}, {1.7, -0.3, 0.6}};
    for (const auto& [x, y, height] : crates)
      scene["objects"].push_back({{"kind", "box"},
                                  {"size", {0.7, 0.7, height}},
                                  {"position", {x, y, height / 2}},
                                  {"rotate_deg", {0, 0, 20 * x}},
                                  {"material", "crate"}});
    WriteTextAtomically(*work_ / "film.json", scene.dump());
    const auto made =
        RunProgram({"lumi-simulate", *work_ / "film.json", "--video", "--quiet", "-o", (*work_ / "film").string()});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    // Frames that are taken, by their number: at 20, 40, 30, 30, 20, 40 ms from one to the next, and at 30 throughout.
    Take("jittered.mp4",
         "eq(mod(n,18),0)+eq(mod(n,18),2)+eq(mod(n,18),6)+eq(mod(n,18),9)+eq(mod(n,18),12)+eq(mod(n,18),14)");
    Take("even.mp4", "not(mod(n,3))");
    Take("dropped.mp4", "not(mod(n,3))*not(eq(n,108))");
  }
  static void TearDownTestSuite() {
    delete work_;
    work_ = nullptr;
  }
  static void Take(const std::string& file, const std::string& frames) {
    // Without macroblock trees x264 makes the same film on every processor (scene/files/ffmpeg/encoder.cc says why).
    RunFfmpeg({"-i", (*work_ / "film" / "video.mp4").string(), "-vf", "select='" + frames + "'", "-vsync", "vfr",
               "-crf", "12", "-x264-params", "mbtree=0", (*work_ / file).string()});
  }
  static TemporaryFolder* work_;
};
TemporaryFolder* FilmTimes::work_ = nullptr;

TEST_F(FilmTimes, AVariableRateAndADroppedFrameAreSteadiedAsAConstantRateIs) {
  const json even = Steadied(*work_ / "even.mp4", *work_ / "even-steady.mp4");
  ASSERT_TRUE(even.is_object());
  EXPECT_TRUE(even["constant_rate"].get<bool>());
  EXPECT_NEAR(even["fps"].get<double>(), 1 / 0.03, 1e-3);
  const double even_px = even["score"]["videos"][1]["jitter_px"];
  for (const char* name : {"jittered", "dropped"}) {
    const fs::path film = *work_ / (std::string(name) + ".mp4"), out = *work_ / (std::string(name) + "-steady.mp4");
    const json summary = Steadied(film, out);
    ASSERT_TRUE(summary.is_object()) << name;
    EXPECT_FALSE(summary["constant_rate"].get<bool>()) << name;
    EXPECT_EQ(summary["windows"].size(), 1U) << name;
    ExpectSameTimes(film, out);
    const json& filmed = summary["score"]["videos"][0];
    const json& steady = summary["score"]["videos"][1];
    // The same walk, other moments of it: what differs is the measure's own noise.
    EXPECT_NEAR(steady["jitter_px"].get<double>(), even_px, 0.05) << name;
    EXPECT_LT(steady["jitter_px"].get<double>(), 0.2 * filmed["jitter_px"].get<double>()) << name;
    EXPECT_NEAR(summary["kept_scale"].get<double>(), even["kept_scale"].get<double>(), 0.03) << name;
    EXPECT_NEAR(summary["windows"][0]["shake_before_px"].get<double>(),
                even["windows"][0]["shake_before_px"].get<double>(),
                0.15 * even["windows"][0]["shake_before_px"].get<double>())
        << name;
  }
}

TEST_F(FilmTimes, AVariableRateInWindowsIsAConstantOneOnRequest) {
  const fs::path film = *work_ / "jittered.mp4", out = *work_ / "asked.mp4";
  const json summary = Steadied(film, out, {"--window-frames", "40", "--fps", "25", "--no-score"});
  ASSERT_TRUE(summary.is_object());
  EXPECT_GT(summary["windows"].size(), 1U);
  EXPECT_EQ(summary["fps"], 25);
  EXPECT_TRUE(summary["constant_rate"].get<bool>());
  const VideoTimes in = ReadVideoTimes(film), times = ReadVideoTimes(out);
  EXPECT_TRUE(times.constant);
  EXPECT_NEAR(times.fps, 25, 1e-6);
  EXPECT_NEAR(static_cast<double>(times.time_s.size()) / 25, in.time_s.back() + 0.03, 0.021);  // no faster, no slower
  const auto refused =
      RunProgram({"lumi-pipeline", film.string(), "--stabilize", "smooth", "-o", out.string(), "--fps", "0"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, testing::HasSubstr("--fps"));
}

TEST_F(FilmTimes, APathOfUnevenTimesIsAFilmOfThem) {
  const fs::path film = *work_ / "jittered.mp4", work = *work_ / "path-work";
  ASSERT_TRUE(Steadied(film, *work_ / "path.mp4", {"--no-score"}).is_object());
  const fs::path window = work / "window-000", out = *work_ / "drawn.mp4";
  const auto draw = [&](std::vector<std::string> more) {
    std::vector<std::string> argv{"lumi-render", (window / "scene").string(),
                                  "--path",      (window / "path.json").string(),
                                  "--proxy",     "per-view",
                                  "--width",     "120",
                                  "--quiet"};
    argv.insert(argv.end(), more.begin(), more.end());
    return RunProgram(argv);
  };
  ASSERT_EQ(draw({"-o", out.string()}).exit_code, 0);
  ExpectSameTimes(film, out);
  ASSERT_EQ(draw({"-o", out.string(), "--fps", "20"}).exit_code, 0);
  EXPECT_TRUE(ReadVideoTimes(out).constant);
  EXPECT_NEAR(ReadVideoTimes(out).fps, 20, 1e-6);
  const auto nothing = draw({"-o", (*work_ / "pictures").string(), "--fps", "20"});
  EXPECT_EQ(nothing.exit_code, 2);
  EXPECT_THAT(nothing.err, testing::HasSubstr("--video"));
}

TEST(FilmSound, NeverEndsTheFilmAndEndsWithIt) {
  const TemporaryFolder folder;
  const std::string pictures = "color=c=gray:s=160x120:r=30:d=4";
  struct Given {
    const char* sound_s;
    double expected_s;
  };
  for (const auto& [sound_s, expected_s] : {Given{"2", 2}, Given{"7", 4}}) {
    RunFfmpeg({"-f", "lavfi", "-i", pictures, "-f", "lavfi", "-i",
               std::string("sine=frequency=440:duration=") + sound_s, "-c:v", "mpeg4", (folder / "film.mp4").string()});
    const json summary = Steadied(folder / "film.mp4", folder / "steady.mp4", {"--no-score"});
    ASSERT_TRUE(summary.is_object());
    EXPECT_TRUE(summary["sound"].get<bool>());
    EXPECT_EQ(ReadVideoTimes(folder / "steady.mp4").time_s.size(), 120U) << sound_s;
    EXPECT_NEAR(Probed(folder / "steady.mp4", "v:0", "stream=duration"), 4, 1e-2);
    EXPECT_NEAR(Probed(folder / "steady.mp4", "a:0", "stream=duration"), expected_s, 0.05) << sound_s;
    fs::remove_all(folder / "steady-work");
  }
}

TEST(FilmSound, BeginsWhereItDidBesideThePictures) {
  const TemporaryFolder folder;
  // The pictures begin half a second after the sound, which is silent but for a tone from 1 s on: 0.5 s of the film.
  RunFfmpeg(
      {"-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=2", "-c:v", "mpeg4", (folder / "pictures.mp4").string()});
  RunFfmpeg({"-f", "lavfi", "-i", "sine=frequency=440:duration=2.5", "-af", "volume=0:enable='lt(t,1)'", "-c:a", "aac",
             (folder / "sound.m4a").string()});
  RunFfmpeg({"-itsoffset", "0.5", "-i", (folder / "pictures.mp4").string(), "-i", (folder / "sound.m4a").string(), "-c",
             "copy", (folder / "film.mp4").string()});
  ASSERT_TRUE(Steadied(folder / "film.mp4", folder / "steady.mp4", {"--no-score"}).is_object());
  const SubprocessResult heard =
      RunSubprocess({"ffmpeg", "-hide_banner", "-nostats", "-i", (folder / "steady.mp4").string(), "-af",
                     "silencedetect=n=-40dB:d=0.1", "-f", "null", "-"});
  double silent_until_s = -1;
  for (const std::string& line : heard.tail)
    if (const auto at = line.find("silence_end: "); at != std::string::npos && silent_until_s < 0)
      silent_until_s = std::strtod(line.c_str() + at + 13, nullptr);
  EXPECT_NEAR(silent_until_s, 0.5, 0.05);
}

TEST(FilmSound, OfARelativeNameWithAColonIsKept) {
  const TemporaryFolder folder;
  RunFfmpeg({"-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=1", "-f", "lavfi", "-i",
             "sine=frequency=440:duration=1", "-c:v", "mpeg4", (folder / "film.mp4").string()});
  fs::rename(folder / "film.mp4", folder / "clip:1.mp4");
  struct InFolder {
    fs::path before = fs::current_path();
    explicit InFolder(const fs::path& folder) { fs::current_path(folder); }
    ~InFolder() { fs::current_path(before); }
  } here(folder.path());
  const json summary = Steadied("clip:1.mp4", "out:1.mp4", {"--no-score"});
  ASSERT_TRUE(summary.is_object());
  EXPECT_TRUE(summary["sound"].get<bool>());
  EXPECT_NEAR(Probed(folder / "out:1.mp4", "a:0", "stream=duration"), 1, 0.05);
}

TEST(FilmSound, OfAFilmThatIsTurnedComesWithPicturesThatAreAndSayNothingOfIt) {
  const TemporaryFolder folder;
  RunFfmpeg({"-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=1", "-f", "lavfi", "-i",
             "sine=frequency=440:duration=1", "-c:v", "mpeg4", (folder / "lying.mp4").string()});
  const std::string lying = (folder / "lying.mp4").string(), film = (folder / "film.mp4").string();
  // Since FFmpeg 6 by an option of the input, before by a tag.
  if (RunSubprocess({"ffmpeg", "-v", "error", "-y", "-display_rotation", "90", "-i", lying, "-c", "copy", film})
          .exit_code != 0)
    RunFfmpeg({"-i", lying, "-c", "copy", "-metadata:s:v:0", "rotate=90", film});
  const fs::path out = folder / "steady.mp4";
  const json summary = Steadied(film, out, {"--no-score"});
  ASSERT_TRUE(summary.is_object());
  EXPECT_TRUE(summary["sound"].get<bool>());
  EXPECT_EQ(VideoReader(film).width(), 120);  // it was turned
  EXPECT_EQ(VideoReader(out).width(), 120);
  EXPECT_EQ(Probed(out, "v:0", "stream=width"), 120);  // as it is coded: not turned a second time
  EXPECT_EQ(Probed(out, "v:0", "stream_side_data=rotation"), 0);
}

TEST(FilmTimesRefused, ThatFallAreRefusedBeforeAnythingIsComputed) {
  const TemporaryFolder folder;
  RunFfmpeg({"-f", "lavfi", "-i", "testsrc=s=160x120:r=25:d=0.2", "-c:v", "mpeg2video", (folder / "part.ts").string()});
  const std::string part = ReadText(folder / "part.ts");
  std::string parts;  // a clock that begins anew every five frames
  for (int i = 0; i < 20; ++i) parts += part;
  WriteTextAtomically(folder / "falls.ts", parts);
  const std::string film = (folder / "falls.ts").string();
  for (const std::vector<std::string>& argv :
       {std::vector<std::string>{"lumi-pipeline", film, "--stabilize", "smooth", "-o", (folder / "out.mp4").string(),
                                 "--window-frames", "30"},
        std::vector<std::string>{"lumi-timeperiodic", "period", film},
        std::vector<std::string>{"lumi-stabilize", "score", film}}) {
    const auto run = RunProgram(argv);
    EXPECT_EQ(run.exit_code, static_cast<int>(ExitCode::kDataRefused)) << argv[0] << run.out << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr("falls.ts")) << argv[0];
    EXPECT_THAT(run.err, testing::HasSubstr("do not increase")) << argv[0];
    EXPECT_THAT(run.err, testing::HasSubstr("ffmpeg")) << argv[0];
  }
  EXPECT_FALSE(fs::exists(folder / "out.mp4"));
  for (const auto& entry : fs::recursive_directory_iterator(folder.path()))
    EXPECT_FALSE(entry.path().string().find("frame_") != std::string::npos) << entry.path();
}

}  // namespace
}  // namespace lumi
