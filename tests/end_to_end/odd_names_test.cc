// Photos may be called anything that a file may be called.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/printable.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::vector<std::string>& OddNames() {
  static const std::vector<std::string> names = {"a photo of us.PNG",
                                                 "O'Hara's \"best\" & <last>.jpg",
                                                 "line\nbreak.png",
                                                 "-rf.jpg",
                                                 "10:30 C:drive.PNG",
                                                 "100% %d %s.JPG",
                                                 std::string(251, 'n') + ".png",
                                                 "caf\xe9.jpg",  // Latin 1
                                                 "gr\xc3\xbc\xc3\x9f"
                                                 "e.png",
                                                 " outer.jpg",
                                                 "twin.jpg",
                                                 "TWIN.jpg",
                                                 "#1 what? $HOME;*.png",
                                                 "same.jpg",
                                                 "same.png"};
  return names;
}

std::vector<fs::path> PhotosOf(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

json JsonOf(std::vector<std::string> argv) {
  argv.emplace_back("--json");
  const ProgramResult done = RunProgram(argv);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  return json::parse(done.out, nullptr, false);
}

TEST(OddNames, GoThroughReconstructionProxyRenderAndReport) {
  const SimulatedCapture capture("desk", static_cast<int>(OddNames().size()), 480);
  const fs::path photos = capture / "photos", scene = capture / "scene";
  fs::create_directories(photos);
  const std::vector<fs::path> files = PhotosOf(capture.photos());
  ASSERT_EQ(files.size(), OddNames().size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const bool jpeg = OddNames()[i].ends_with(".jpg") || OddNames()[i].ends_with(".JPG");
    const fs::path temporary = capture / (jpeg ? "photo.jpg" : "photo.png");
    WriteImage(temporary, ReadImage8(files[i]), 95);
    fs::rename(temporary, photos / OddNames()[i]);
  }
  const std::string before = Contents(photos);
  const json done = JsonOf({"lumi-pipeline", photos.string(), "-o", scene.string(), "--proxy", "plane", "--holdout",
                            "5", "--width", "64", "--seconds", "0.2", "--quality", "low"});
  EXPECT_EQ(Contents(photos), before);
  ASSERT_TRUE(done.is_object());
  EXPECT_EQ(done["stages"][0]["summary"]["images_registered"], files.size()) << done["stages"][0].dump(1);

  const Scene opened = OpenScene(scene, {}, SilentProgress());
  std::set<std::string> names;
  for (const View& view : opened.views) {
    names.insert(view.name);
    EXPECT_TRUE(IsUtf8(view.name)) << view.name;
    EXPECT_LE(fs::path(view.name).filename().string().size(), 200U);
  }
  // Most keep their names; what cannot be listed or written is escaped.
  for (const char* kept : {"a photo of us.PNG", "-rf.jpg", "10:30 C:drive.PNG", "100% %d %s.JPG", "TWIN.jpg",
                           "twin.jpg", "same.jpg", "same.png", "line=0Abreak.png", "caf=E9.jpg", "=20outer.jpg"})
    EXPECT_TRUE(names.contains(kept)) << kept;

  // Two that differ by their ending alone are two pictures.
  const fs::path out = capture / "out";
  for (const char* name : {"same.jpg", "same.png"})
    JsonOf({"lumi-render", scene.string(), "-o", out.string(), "--view", name, "--width", "32"});
  EXPECT_TRUE(fs::exists(out / "same.jpg.png"));
  EXPECT_TRUE(fs::exists(out / "same.png.png"));
  // A name before a number.
  EXPECT_EQ(
      JsonOf({"lumi-render", scene.string(), "-o", out.string(), "--view", "3", "--width", "32"})["views"][0]["name"],
      opened.views[3].name);
  EXPECT_TRUE(fs::exists(scene / "report.html"));
}

// All of it again in a folder of such a name, by every program; a second run finds that nothing has changed.
TEST(OddNames, OfPhotosAndFoldersGoThroughEveryProgram) {
  const TemporaryFolder temporary;
  const fs::path folder = temporary / "caf\xe9 \"x\" 100%\nb";
  fs::create_directories(folder / "photos");
  const std::vector<std::string> names = {"line\nbreak.jpg",
                                          "-rf.jpg",
                                          "caf\xe9.jpg",
                                          "100% %d %s.jpg",
                                          "SAME.jpg",
                                          "<b>O'Hara \"q\" & c.jpg",
                                          std::string(251, 'n') + ".jpg",
                                          "same.jpg"};
  const SimulatedCapture capture("desk", static_cast<int>(names.size()), 320);
  const std::vector<fs::path> files = PhotosOf(capture.photos());
  for (std::size_t i = 0; i < files.size(); ++i) fs::copy_file(files[i], folder / "photos" / names[i]);
  const std::string before = Contents(folder / "photos");
  const auto at = [&](const std::string& name) { return (folder / name).string(); };
  const std::vector<std::string> pipeline = {"lumi-pipeline", at("photos"), "-o",        at("scene"), "--proxy",
                                             "delaunay",      "--holdout",  "4",         "--width",   "64",
                                             "--seconds",     "0.2",        "--quality", "low"};
  EXPECT_EQ(JsonOf(pipeline)["stages"][0]["summary"]["images_registered"], names.size());
  const json again = JsonOf(pipeline);
  for (const json& stage : again["stages"]) {
    if (stage["name"] != "report") {
      EXPECT_EQ(stage["reused"], true) << stage["name"];
    }
  }

  const std::string scene = at("scene"), long_name = std::string(250, 'f') + ".mp4";
  for (const std::vector<std::string>& argv : std::vector<std::vector<std::string>>{
           {"lumi-proxy", "auto", scene, "--candidates", "plane", "delaunay", "--holdout", "2", "--choose-width", "32"},
           {"lumi-proxy", "dense", scene, "--width", "64", "--iterations", "1"},
           {"lumi-proxy", "box", scene},
           {"lumi-proxy", "planes", scene},
           {"lumi-proxy", "simplify", scene, "--from", "delaunay", "--faces", "50"},
           {"lumi-proxy", "silhouettes", scene, "--rule", "R > 100"},
           {"lumi-proxy", "hull", scene, "--cell-px", "16"},
           {"lumi-export", "web", scene, "-o", at("page.html")},
           {"lumi-export", "web", scene, "-o", at("page")},
           {"lumi-export", "gltf", scene, "-o", at("model.glb"), "--points", at("points.ply")},
           {"lumi-reconstruct", "export", scene, "-o", at("transforms.json")},
           {"lumi-reconstruct", "export", scene, "-o", at("exported")},
           {"lumi-proxy", "import", at("scene/proxies/delaunay.ply"), scene, "--name", "copied"},
           {"lumi-proxy", "info", scene},
           {"lumi-render", scene, "-o", at(long_name), "--seconds", "0.5", "--width", "48"},
           {"lumi-stabilize", "score", at(long_name), at(long_name), "--plot", at("score.svg")},
           {"lumi-render", scene, "-o", at("views"), "--view", "-rf.jpg", "--width", "48"},
           {"lumi-render", "methods", scene, "-o", at("methods"), "--width", "32", "--methods", "ulr", "--methods",
            "pulli-1997"},
           {"lumi-pipeline", at("exported"), "-o", at("imported"), "--proxy", "plane", "--no-video"}}) {
    const ProgramResult run = RunProgram(argv);
    EXPECT_EQ(run.exit_code, 0) << argv[0] << " " << argv[1] << ": " << run.err;
  }
  EXPECT_TRUE(fs::exists(folder / long_name));
  // Names are text on pages, whatever they say.
  const std::string report = ReadText(folder / "scene/report.html");
  EXPECT_THAT(report, testing::HasSubstr("&lt;b&gt;O"));
  EXPECT_THAT(report, testing::Not(testing::HasSubstr("<b>O")));
  EXPECT_TRUE(IsUtf8(report));
  // No board is in these pictures: they are read, and refused for that.
  const ProgramResult boards = RunProgram({"lumi-calibrate", at("photos"), "--board", "9x6", "-o", at("camera.yaml")});
  EXPECT_EQ(boards.exit_code, 1) << boards.err;
  EXPECT_EQ(Contents(folder / "photos"), before);
}

// COLMAP's list of pairs parts names at blanks.
TEST(OddNames, WithBlanksAreMatchedInAListOfPairs) {
  constexpr int kPhotos = 24;
  const SimulatedCapture capture("desk", kPhotos, 160);
  const fs::path scene = capture / "scene", photos = capture / "photos", poses = capture / "poses";
  Scene known = ReadColmapModel(capture.path() / "sparse");
  fs::create_directories(photos);
  for (View& view : known.views) {
    const std::string name = "photo " + view.name;
    fs::copy_file(capture.photos() / view.name, photos / name);
    view.name = name;
  }
  WriteColmapModel(known, poses);
  const json done = JsonOf({"lumi-reconstruct", photos.string(), "-o", scene.string(), "--poses", poses.string(),
                            "--features", "colmap", "--matching", "similar", "--max-features", "256"});
  ASSERT_TRUE(done.is_object());
  EXPECT_TRUE(fs::exists(scene / "colmap/pairs.txt"));
  EXPECT_EQ(done["images_registered"], kPhotos);
  EXPECT_GT(done["points"].get<int>(), 100);
  EXPECT_EQ(OpenScene(scene, {}, SilentProgress()).views.front().name, known.views.front().name);
}

}  // namespace
}  // namespace lumi
