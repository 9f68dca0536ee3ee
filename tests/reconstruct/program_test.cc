// The real program, run on small photos: what it writes, what it refuses, and that it leaves the user's files alone.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "scene/program/subprocess.h"
#include "tests/support/child_program.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

const fs::path kProgram = fs::path(LUMI_BIN_DIR) / "lumi-reconstruct";
const fs::path kFox = fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data" / "fox" / "images";

struct Outcome {
  int code = 0;
  nlohmann::json json;
  std::string messages;
};

Outcome RunReconstruct(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), kProgram.string());
  arguments.push_back("--json");
  SubprocessOptions options;
  options.separate_stdout = true;
  Outcome outcome;
  options.on_line = [&](const std::string& line) { outcome.messages += line + "\n"; };
  const auto result = RunSubprocess(arguments, options);
  outcome.code = result.exit_code;
  outcome.json = nlohmann::json::parse(result.out, nullptr, false);
  return outcome;
}

// A failure is one clear line on stderr beside progress, and the same as JSON.
void ExpectRefusal(const Outcome& o, int code, const std::string& expected) {
  EXPECT_EQ(o.code, code) << o.messages;
  ASSERT_TRUE(o.json.is_object() && o.json.contains("error")) << o.messages;
  EXPECT_EQ(o.json["error"]["code"], code);
  const std::string message = o.json["error"]["message"].get<std::string>() +
                              o.json["error"]["file"].get<std::string>() + o.json["error"]["hint"].get<std::string>();
  EXPECT_NE(message.find(expected), std::string::npos) << message;
  EXPECT_EQ(o.json["error"]["message"].get<std::string>().find('\n'), std::string::npos);
}

class ReconstructProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("lumi-reconstruct-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Six photos of a real thing, small enough for COLMAP to take seconds. False where the data are absent.
  bool MakePhotos(const fs::path& target, int count = 6) const {
    if (!fs::exists(kFox)) return false;
    std::vector<fs::path> names;
    for (const auto& entry : fs::directory_iterator(kFox)) names.push_back(entry.path());
    std::sort(names.begin(), names.end());
    fs::create_directories(target);
    for (int i = 0; i < count; ++i)
      WriteImage(target / names[static_cast<std::size_t>(2 * i)].filename(),
                 Resize(ReadImage8(names[static_cast<std::size_t>(2 * i)]), 270, 480), 95);
    return true;
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

#define REQUIRE_PHOTOS(target) \
  if (!MakePhotos(target)) GTEST_SKIP() << "no ../shared/data/fox here"

Image8 Noise(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> byte(0, 255);
  Image8 coarse(60, 45, 3);
  for (auto& v : coarse.data) v = static_cast<std::uint8_t>(byte(random));
  return Resize(coarse, 480, 360);
}

TEST_F(ReconstructProgram, AnEmptyFolderIsRefused) {
  fs::create_directories(folder_ / "photos");
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene")}), 3, "empty");
  EXPECT_FALSE(fs::exists(folder_ / "scene"));
}

TEST_F(ReconstructProgram, AFolderOfTextFilesIsRefused) {
  WriteTextAtomically(folder_ / "photos" / "notes.txt", "no photo");
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene")}), 3, "notes.txt");
  EXPECT_FALSE(fs::exists(folder_ / "scene"));
}

TEST_F(ReconstructProgram, AnAbsentInputAndAStrangeFileAreRefused) {
  ExpectRefusal(RunReconstruct({Path("absent"), "-o", Path("scene")}), 3, "no such");
  WriteTextAtomically(folder_ / "file.bin", "bytes");
  ExpectRefusal(RunReconstruct({Path("file.bin"), "-o", Path("scene")}), 3, "neither a folder of photos nor a video");
  WriteTextAtomically(folder_ / "video.mp4", "not a video at all");
  ExpectRefusal(RunReconstruct({Path("video.mp4"), "-o", Path("scene2")}), 3, "video.mp4");
}

TEST_F(ReconstructProgram, WrongUsageIsTold) {
  EXPECT_EQ(RunReconstruct({Path("photos")}).code, 2);
  EXPECT_EQ(RunReconstruct({Path("photos"), "-o", Path("scene"), "--rig", "square"}).code, 2);
  EXPECT_EQ(RunReconstruct({Path("photos"), "-o", Path("scene"), "--focal-px", "long"}).code, 2);
  EXPECT_EQ(RunReconstruct({Path("photos"), "-o", Path("scene"), "--backend", "magic"}).code, 2);
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene"), "--focal-px", "500"}), 2, "--camera");
}

TEST_F(ReconstructProgram, OnePhotoIsRefused) {
  WriteImage(folder_ / "photos" / "a.png", Noise(1));
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene")}), 1, "only one photo");
  EXPECT_FALSE(fs::exists(folder_ / "scene"));
}

TEST_F(ReconstructProgram, TwoUnrelatedPhotosAreRefused) {
  WriteImage(folder_ / "photos" / "a.png", Noise(1));
  WriteImage(folder_ / "photos" / "b.png", Noise(2));
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene")}), 1, "photos of one thing");
  EXPECT_FALSE(fs::exists(folder_ / "scene" / "lumigraph.json"));
}

TEST_F(ReconstructProgram, AnOutputThatCannotBeWrittenIsAMachineError) {
  WriteImage(folder_ / "photos" / "a.png", Noise(1));
  WriteImage(folder_ / "photos" / "b.png", Noise(2));
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("photos/a.png/scene")}), 4, "cannot");
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", "/proc/lumi-scene"}), 4, "cannot");
}

TEST_F(ReconstructProgram, SomebodyElsesFolderIsLeftAlone) {
  WriteImage(folder_ / "photos" / "a.png", Noise(1));
  WriteImage(folder_ / "photos" / "b.png", Noise(2));
  WriteTextAtomically(folder_ / "mine" / "thesis.doc", "years of work");
  const std::string before = Fingerprint(folder_ / "mine");
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("mine")}), 2, "not ours");
  EXPECT_EQ(Fingerprint(folder_ / "mine"), before);
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", folder_.string()}), 2, "not ours");  // the photos' own parent
}

TEST_F(ReconstructProgram, PhotosBecomeAScene) {
  REQUIRE_PHOTOS(folder_ / "photos");
  WriteTextAtomically(folder_ / "photos" / "notes.txt", "a text file among the photos");
  const std::string before = Fingerprint(folder_ / "photos");
  const Outcome first = RunReconstruct({Path("photos"), "-o", Path("scene")});
  ASSERT_EQ(first.code, 0) << first.messages;
  EXPECT_EQ(Fingerprint(folder_ / "photos"), before);  // nothing of the user's is changed
  EXPECT_NE(first.messages.find("notes.txt"), std::string::npos);
  EXPECT_EQ(first.json["images_total"], 6);
  EXPECT_EQ(first.json["images_registered"], 6);
  EXPECT_TRUE(first.json["missing"].empty());
  EXPECT_EQ(first.json["backend"], "colmap");
  EXPECT_EQ(first.json["upgrade"], "metric");
  EXPECT_LT(first.json["mean_reprojection_error_px"].get<double>(), 1.0);
  EXPECT_GT(first.json["points"].get<int>(), 200);
  EXPECT_GT(first.json["colmap_seconds"].get<double>(), 0);

  OpenOptions open;
  const Scene scene = OpenScene(folder_ / "scene", open, SilentProgress());
  ASSERT_EQ(scene.views.size(), 6u);
  for (const Camera& camera : scene.cameras) EXPECT_EQ(camera.model, CameraModel::kPinhole);
  for (const View& view : scene.views) {
    const Image8 photo = ReadImage8(scene.ImagePath(view));
    EXPECT_EQ(photo.width, scene.CameraOf(view).width_px);
    EXPECT_EQ(photo.height, scene.CameraOf(view).height_px);
    EXPECT_GT(PointDepths(scene, ViewId{static_cast<std::int32_t>(&view - scene.views.data())}).size(), 20u);
  }

  // The same again has nothing to do; another option reuses what does not depend on it.
  const auto written = fs::last_write_time(folder_ / "scene" / "lumigraph.json");
  const Outcome again = RunReconstruct({Path("photos"), "-o", Path("scene")});
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.json["reused"], nlohmann::json({"everything"}));
  EXPECT_EQ(fs::last_write_time(folder_ / "scene" / "lumigraph.json"), written);
  const Outcome other = RunReconstruct({Path("photos"), "-o", Path("scene"), "--seed", "5"});
  EXPECT_EQ(other.code, 0) << other.messages;
  EXPECT_EQ(other.json["reused"], nlohmann::json({"features", "matches"}));
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene"), "--component", "3"}), 1, "no component 3");
  // The input inside the output would be overwritten.
  ExpectRefusal(RunReconstruct({Path("scene/images"), "-o", Path("scene")}), 2, "inside the output");

  // A photo more: the others' features stay. And a database beside the photos is reused without being touched.
  fs::create_directories(folder_ / "project");
  fs::copy(folder_ / "photos", folder_ / "project" / "images");
  fs::copy_file(folder_ / "scene" / "colmap" / "database.db", folder_ / "project" / "database.db");
  const std::string project = Fingerprint(folder_ / "project");
  const Outcome reused = RunReconstruct({Path("project/images"), "-o", Path("scene2")});
  EXPECT_EQ(reused.code, 0) << reused.messages;
  EXPECT_EQ(reused.json["reused"], nlohmann::json({"features", "matches"}));
  EXPECT_EQ(Fingerprint(folder_ / "project"), project);

  // The cameras just found, given as known ones: held to the last bit, points triangulated anew.
  const Outcome held = RunReconstruct({Path("scene/images"), "-o", Path("scene3"), "--poses", Path("scene/sparse")});
  ASSERT_EQ(held.code, 0) << held.messages;
  EXPECT_EQ(held.json["images_registered"], 6);
  EXPECT_LT(held.json["mean_reprojection_error_px"].get<double>(), 1.0);
  EXPECT_GT(held.json["points"].get<int>(), 200);
  const Scene given = ReadColmapModel(folder_ / "scene" / "sparse"),
              kept = ReadColmapModel(folder_ / "scene3" / "sparse");
  for (std::size_t i = 0; i < given.views.size(); ++i) {
    EXPECT_LT((given.views[i].cam_from_world.Matrix() - kept.views[i].cam_from_world.Matrix()).cwiseAbs().maxCoeff(),
              1e-12);
    EXPECT_EQ(given.CameraOf(given.views[i]).params, kept.CameraOf(kept.views[i]).params);
  }

  // Photos that the poses do not name are not searched for features.
  Scene three = given;
  three.views.resize(3);
  three.points.clear();
  WriteColmapModel(three, folder_ / "three");
  const Outcome some = RunReconstruct({Path("scene/images"), "-o", Path("scene4"), "--poses", Path("three")});
  ASSERT_EQ(some.code, 0) << some.messages;
  EXPECT_EQ(some.json["images_registered"], 3);
  EXPECT_EQ(some.json["missing"].size(), 3);
  const std::string searched = ReadText(folder_ / "scene4/colmap/photos.txt");
  EXPECT_EQ(std::ranges::count(searched, '\n'), 3) << searched;
}

TEST_F(ReconstructProgram, ATruncatedPhotoIsLeftOutAndNamed) {
  REQUIRE_PHOTOS(folder_ / "photos");
  const fs::path victim = *fs::directory_iterator(folder_ / "photos");
  fs::resize_file(victim, fs::file_size(victim) / 2);
  const Outcome o = RunReconstruct({Path("photos"), "-o", Path("scene")});
  ASSERT_EQ(o.code, 0) << o.messages;
  EXPECT_EQ(o.json["images_total"], 6);
  bool named = false;
  for (const auto& m : o.json["missing"])
    named =
        named || (m["name"] == victim.filename().string() && m["reason"].get<std::string>().find("unreadable") == 0);
  EXPECT_TRUE(named) << o.json.dump();
  EXPECT_FALSE(fs::exists(folder_ / "scene" / "images" / victim.filename()));
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene"), "--min-registered", "1"}), 1, "100 %");
}

TEST_F(ReconstructProgram, PhotosOfDifferentSizesDepthsAndChannelsAreAllowed) {
  REQUIRE_PHOTOS(folder_ / "photos");
  std::vector<fs::path> photos;
  for (const auto& entry : fs::directory_iterator(folder_ / "photos")) photos.push_back(entry.path());
  std::sort(photos.begin(), photos.end());
  // One larger, one grey, one with alpha, one in floating point (COLMAP cannot read that: it gets a copy).
  const Image8 big = Resize(ReadImage8(photos[0]), 324, 576);
  WriteImage(photos[0], big, 95);
  const Image8 rgb = ReadImage8(photos[2]);
  Image8 grey(rgb.width, rgb.height, 1);
  for (int y = 0; y < rgb.height; ++y)
    for (int x = 0; x < rgb.width; ++x) grey.At(x, y, 0) = rgb.At(x, y, 1);
  WriteImage(folder_ / "photos" / "grey.png", grey);
  WriteImage(folder_ / "photos" / "alpha.png", ReadImage8(photos[3], 4));
  const Image8 source = ReadImage8(photos[4]);
  ImageF deep(source.width, source.height, 3);
  for (std::size_t i = 0; i < deep.data.size(); ++i) deep.data[i] = static_cast<float>(source.data[i]) / 255;
  WriteImage(folder_ / "photos" / "deep.exr", deep);
  for (const int i : {2, 3, 4}) fs::remove(photos[static_cast<std::size_t>(i)]);
  const Outcome o = RunReconstruct({Path("photos"), "-o", Path("scene")});
  ASSERT_EQ(o.code, 0) << o.messages;
  EXPECT_EQ(o.json["images_total"], 6);
  EXPECT_GE(o.json["images_registered"].get<int>(), 5) << o.json.dump();
}

TEST_F(ReconstructProgram, AKilledRunGoesOnAndLeavesNoHalfScene) {
  REQUIRE_PHOTOS(folder_ / "photos");
  // Killed hard at several moments of the work, features to undistortion.
  for (const int after_ms : {300, 900, 1600}) {
    const pid_t pid = fork();
    if (pid == 0) {
      execl(kProgram.c_str(), kProgram.c_str(), Path("photos").c_str(), "-o", Path("scene").c_str(), "--quiet",
            nullptr);
      _exit(127);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(after_ms));
    kill(pid, SIGKILL);
    int status = 0;
    waitpid(pid, &status, 0);
    if (fs::exists(folder_ / "scene" / "lumigraph.json")) {
      EXPECT_NO_THROW(OpenScene(folder_ / "scene", OpenOptions{}, SilentProgress()));
    }
  }
  const Outcome o = RunReconstruct({Path("photos"), "-o", Path("scene")});
  ASSERT_EQ(o.code, 0) << o.messages;
  EXPECT_EQ(o.json["images_registered"], 6);
  EXPECT_EQ(OpenScene(folder_ / "scene", OpenOptions{}, SilentProgress()).views.size(), 6u);
}

TEST_F(ReconstructProgram, CtrlCEndsWith130AndEndsColmap) {
  REQUIRE_PHOTOS(folder_ / "photos");
  const pid_t pid = fork();
  if (pid == 0) {
    execl(kProgram.c_str(), kProgram.c_str(), Path("photos").c_str(), "-o", Path("scene").c_str(), "--quiet", nullptr);
    _exit(127);
  }
  // When COLMAP is at work, and not before: its database has appeared.
  for (int i = 0; i < 3000 && !fs::exists(folder_ / "scene" / "colmap" / "database.db"); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  kill(pid, SIGINT);
  int status = 0;
  waitpid(pid, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_FALSE(fs::exists(folder_ / "scene" / "lumigraph.json"));
  EXPECT_FALSE(fs::exists(folder_ / "scene" / "LOCK"));
  // No process is left that was given our folder.
  EXPECT_TRUE(WaitForNoProcessNaming(folder_));
}

TEST_F(ReconstructProgram, AFolderThatIsBeingWrittenIsRefused) {
  WriteImage(folder_ / "photos" / "a.png", Noise(1));
  WriteImage(folder_ / "photos" / "b.png", Noise(2));
  const FolderLock lock(folder_ / "scene");
  ExpectRefusal(RunReconstruct({Path("photos"), "-o", Path("scene")}), 4, std::to_string(::getpid()));
}

TEST_F(ReconstructProgram, AVideoThatStandsStillIsRefused) {
  VideoWriter writer(folder_ / "still.mp4", 10);
  for (int i = 0; i < 12; ++i) writer.Add(Noise(1));
  writer.Finish();
  ExpectRefusal(RunReconstruct({Path("still.mp4"), "-o", Path("scene")}), 1, "hardly moves");
}

}  // namespace
}  // namespace lumi
