// lumi-stabilize as its user runs it: a scene in, PATH.json and a plot out, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/matrix_path.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "tests/stabilize/walks.h"
#include "tests/support/child_program.h"

namespace lumi {
namespace {

using namespace test;
namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;

fs::path SceneOn(const fs::path& folder, const Walk& walk) {
  Scene scene = Told(walk);
  fs::create_directories(folder / "images");
  WriteImage(folder / "images" / scene.views.front().name, Image8(kWidthPx, kHeightPx, 3, 90));
  for (std::size_t v = 1; v < scene.views.size(); ++v)
    fs::copy_file(folder / "images" / scene.views.front().name, folder / "images" / scene.views[v].name,
                  fs::copy_options::overwrite_existing);
  scene.folder = folder;
  scene.image_folder = folder / "images";
  UpdateFrameOfReference(scene);
  WriteScene(scene, folder);
  return folder;
}

TEST(StabilizeProgram, WritesAPathThatTheRendererReadsAndAPlot) {
  const TemporaryFolder folder;
  const Walk walk = Sideways(75);
  const fs::path scene = SceneOn(folder / "scene", walk), path = folder / "path.json";
  const ProgramResult run = RunProgram({"lumi-stabilize", scene, "-o", path, "--model", "linear", "--plot",
                                        folder / "tracks.svg", "--border", "fill", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json j = json::parse(run.out);
  EXPECT_EQ(j["model"], "linear");
  EXPECT_EQ(j["frames"], 75);
  EXPECT_EQ(j["structure"], "points");
  EXPECT_GT(j["shake_before_px"].get<double>(), 5);
  EXPECT_LT(j["shake_after_px"].get<double>(), 0.5);
  EXPECT_FALSE(j["cropped"].get<bool>());
  const MatrixPath read = ReadMatrixPath(path);
  ASSERT_EQ(read.keys.size(), 75U);
  EXPECT_NEAR(read.fps, kFps, 1e-9);
  EXPECT_EQ(read.keys[3].view, "frame_000003.png");
  EXPECT_LT(JitterPx(walk, InWalk(read, {})), 0.1);
  EXPECT_THAT(ReadText(folder / "tracks.svg"), HasSubstr("<svg"));
  const auto record = ReadProvenance(scene, "stabilize-path");
  ASSERT_TRUE(record);
  EXPECT_EQ(record->options.at("model"), "linear");
  for (const char* file : {"../path.json", "../tracks.svg"})
    EXPECT_EQ(record->outputs.at(file), Fingerprint(scene / file)) << file;
  // The same bytes again, and a window that goes on from it.
  ASSERT_EQ(RunProgram({"lumi-stabilize", scene, "-o", folder / "again.json", "--model", "linear", "--border", "fill",
                        "--threads", "1"})
                .exit_code,
            0);
  EXPECT_EQ(ReadText(path), ReadText(folder / "again.json"));
  ASSERT_EQ(RunProgram({"lumi-stabilize", scene, "-o", path, "--anchors", "75"}).exit_code, 0);
  MatrixPath anchored = ReadMatrixPath(path);
  EXPECT_NEAR(anchored.keys[70].filmed.norm(), 1, 1e-9);
  EXPECT_LT((anchored.keys[70].filmed - anchored.keys[70].steady).norm(), 0.5);
  anchored.object_px = {1, 2, 3.5, 4};
  WriteMatrixPath(folder / "copy.json", anchored);
  const MatrixPath copy = ReadMatrixPath(folder / "copy.json");
  EXPECT_EQ(copy.object_px, anchored.object_px);
  EXPECT_EQ(copy.keys[70].steady, anchored.keys[70].steady);
  const ProgramResult next =
      RunProgram({"lumi-stabilize", scene, "-o", folder / "next.json", "--continue", path, "--json"});
  ASSERT_EQ(next.exit_code, 0) << next.err;
  EXPECT_EQ(json::parse(next.out)["joined_frames"], 75);
  EXPECT_EQ(json::parse(next.out)["shown"],
            (json{"frame_000005.png", "frame_000074.png"}));  // from where its own frames can fill a picture
}

TEST(StabilizeProgram, RefusesByNameAndExitCode) {
  const TemporaryFolder folder;
  const fs::path scene = SceneOn(folder / "scene", Sideways(40)), path = folder / "path.json";
  const auto refused = [&](std::vector<std::string> more, int code, const char* words) {
    std::vector<std::string> argv = {"lumi-stabilize", scene, "-o", path};
    argv.insert(argv.end(), more.begin(), more.end());
    const ProgramResult run = RunProgram(argv);
    EXPECT_EQ(run.exit_code, code) << words << run.out << run.err;
    EXPECT_THAT(run.err, HasSubstr(words));
    EXPECT_FALSE(fs::exists(path)) << words;
  };
  refused({"--model", "circular"}, 1, "circular: ");
  refused({"--model", "vertigo", "--object", "200,100,200,150"}, 1, "vertigo: ");
  refused({"--model", "vertigo"}, 2, "--object");
  refused({"--model", "vertigo", "--object", "200,100,0,150"}, 2, "--object");
  refused({"--model", "vertigo", "--object", "200,100,200,150", "--object-frame", "40"}, 2, "--object-frame");
  refused({"--model", "spiral"}, 2, "spiral");
  refused({"--cutoff-hz", "0"}, 2, "--cutoff-hz");
  refused({"--min-scale", "1.5"}, 2, "--min-scale");
  refused({"--fps", "-3"}, 2, "--fps");
  refused({"--fps", "2000"}, 2, "--fps");
  refused({"--window", "10"}, 2, "--window: takes an odd number");
  WriteTextAtomically(folder / "mine.svg", "mine");
  refused({"--plot", folder / "mine.svg"}, 2, "no SVG");
  EXPECT_EQ(ReadText(folder / "mine.svg"), "mine");
  refused({"--plot", folder / "tracks.png"}, 2, ".svg");
  refused({"--plot", folder / "mine.svg" / "tracks.svg"}, 4, "tracks.svg");
  refused({"--continue", folder / "absent.json"}, 3, "absent.json");
  WriteTextAtomically(folder / "other.json", "{}");
  refused({"--continue", folder / "other.json"}, 3, "not a path of matrices");
  EXPECT_EQ(RunProgram({"lumi-stabilize", folder / "nothing", "-o", path}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-stabilize"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-stabilize", scene, "-o", folder / "scene"}).exit_code, 2);
  // Neither a film nor another file of the user's becomes a path.
  for (const fs::path& own : {folder / "walk.mp4", folder / "notes.json"}) {
    WriteTextAtomically(own, "mine");
    EXPECT_EQ(RunProgram({"lumi-stabilize", scene, "-o", own}).exit_code, 2) << own;
    EXPECT_EQ(ReadText(own), "mine");
  }
}

}  // namespace
}  // namespace lumi
