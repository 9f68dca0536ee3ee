// What comes from other tools and goes to them: transforms.json, COLMAP workspaces, meshes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/transforms_json.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"
#include "tests/support/small_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr double kRoundTrip = 1e-9;
constexpr int kViewsOfDesk = 12;

ProgramResult RunWell(const std::vector<std::string>& argv) {
  ProgramResult done = RunProgram(argv);
  EXPECT_EQ(done.exit_code, 0) << done.err;
  return done;
}

// By the last part of their names.
void ExpectSameCameras(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.views.size(), b.views.size());
  for (std::size_t i = 0; i < a.views.size(); ++i) {
    EXPECT_EQ(fs::path(a.views[i].name).filename(), fs::path(b.views[i].name).filename());
    EXPECT_LT((a.views[i].cam_from_world.Matrix() - b.views[i].cam_from_world.Matrix()).cwiseAbs().maxCoeff(),
              kRoundTrip);
    const Camera &ca = a.CameraOf(a.views[i]), &cb = b.CameraOf(b.views[i]);
    EXPECT_LT((ca.FocalPx() - cb.FocalPx()).norm() + (ca.PrincipalPointPx() - cb.PrincipalPointPx()).norm(),
              kRoundTrip);
    EXPECT_EQ(ca.width_px, cb.width_px);
  }
}

// A folder as nerfstudio leaves it: photos, halves of them, and transforms.json.
class NerfstudioFolder : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    capture_ = new SimulatedCapture("desk", kViewsOfDesk, 400);
    const fs::path folder = Folder();
    RunWell({"lumi-reconstruct", "export", capture_->path().string(), "-o", (folder / "transforms.json").string()});
    for (const auto& photo : fs::directory_iterator(folder / "images"))
      WriteImage(folder / "images_2" / photo.path().filename(), Resize(ReadImage8(photo.path()), 200, 150));
  }
  static void TearDownTestSuite() {
    delete capture_;
    capture_ = nullptr;
  }
  static fs::path Folder() { return *capture_ / "nerf"; }
  static Scene Truth() { return ReadColmapModel(capture_->path() / "sparse"); }
  static SimulatedCapture* capture_;
};
SimulatedCapture* NerfstudioFolder::capture_ = nullptr;

TEST_F(NerfstudioFolder, ComesBackAsItWasWritten) {
  OpenOptions open;
  open.undistort = false;
  ExpectSameCameras(OpenScene(Folder() / "transforms.json", open, SilentProgress()), Truth());
  // And from there to COLMAP, and back.
  const fs::path colmap = *capture_ / "colmap", again = *capture_ / "colmap" / "transforms.json";
  const auto exported = [&](const fs::path& from, const fs::path& to) {
    return json::parse(RunWell({"lumi-reconstruct", "export", from.string(), "-o", to.string(), "--json"}).out);
  };
  EXPECT_EQ(exported(Folder(), colmap)["photos_copied"], kViewsOfDesk);
  ExpectSameCameras(OpenScene(colmap, open, SilentProgress()), Truth());
  EXPECT_EQ(exported(colmap, again)["photos_copied"], 0) << "they lie beside it already";
  ExpectSameCameras(ReadTransformsJson(again), Truth());
  EXPECT_THAT(ReadText(again), HasSubstr("\"file_path\": \"images/"));
  // What is whole is not replaced; what an export that ended early has left is.
  const auto refused = [&](const fs::path& to) {
    return RunProgram({"lumi-reconstruct", "export", Folder().string(), "-o", to.string()}).exit_code == 2;
  };
  EXPECT_TRUE(refused(colmap) && refused(again));
  WriteTextAtomically(colmap / ".exporting", "");
  EXPECT_EQ(exported(Folder(), colmap)["photos_copied"], kViewsOfDesk);
  WriteTextAtomically(colmap / ".transforms.json.exporting", "");
  EXPECT_EQ(exported(colmap, again)["photos_copied"], 0);
  EXPECT_TRUE(refused(colmap) && refused(again));
}

TEST_F(NerfstudioFolder, IsReconstructedFromItsCameras) {
  const fs::path scene = *capture_ / "scene";
  const std::string before = Contents(Folder());
  const ProgramResult done = RunWell({"lumi-pipeline", Folder().string(), "-o", scene.string(), "--proxy", "plane",
                                      "--holdout", "0", "--no-video", "--quality", "low", "--json"});
  EXPECT_THAT(done.err, HasSubstr("the cameras come from " + (Folder() / "transforms.json").string()));
  EXPECT_THAT(done.err, HasSubstr("--poses none"));
  EXPECT_EQ(Contents(Folder()), before);
  const json cameras = json::parse(done.out)["stages"][0]["summary"];
  EXPECT_EQ(cameras["images_total"], kViewsOfDesk) << "not the halves beside them";
  ExpectSameCameras(OpenScene(scene, {}, SilentProgress()), Truth());
  // The file itself is the same input.
  const ProgramResult file =
      RunWell({"lumi-reconstruct", (Folder() / "transforms.json").string(), "-o", scene.string(), "--quality", "low"});
  EXPECT_THAT(file.err, HasSubstr("nothing to do"));
}

TEST_F(NerfstudioFolder, WhoNamesThePhotosAloneIsTold) {
  // Masks that are not there end the run soon after.
  const ProgramResult done = RunProgram({"lumi-reconstruct", (Folder() / "images").string(), "-o",
                                         (*capture_ / "alone").string(), "--masks", (*capture_ / "none").string()});
  EXPECT_THAT(done.err, HasSubstr("--poses " + (Folder() / "transforms.json").string()));
}

// ---- somebody's COLMAP workspace, from which pictures are made without a scene of ours

class OthersWorkspace : public testing::Test {
 protected:
  OthersWorkspace() {
    WriteColmapModel(MakeSmallScene(folder_ / "capture/images", 5), folder_ / "capture/sparse");
    RunWell({"lumi-proxy", "plane", capture(), "-o", mesh()});
  }
  std::string capture() const { return (folder_ / "capture").string(); }
  std::string mesh() const { return (folder_ / "mesh.ply").string(); }
  std::string out() const { return (folder_ / "out").string(); }
  TemporaryFolder folder_;
};

TEST_F(OthersWorkspace, IsRenderedOverAMeshInAFile) {
  const std::string before = Contents(capture());
  const ProgramResult done = RunWell(
      {"lumi-render", capture(), "-o", out(), "--proxy", mesh(), "--view", "photo12", "--width", "16", "--json"});
  EXPECT_EQ(json::parse(done.out)["proxy"], mesh());
  EXPECT_GT(json::parse(done.out)["coverage"].get<double>(), 0.9);
  WriteMesh(folder_ / "mesh.obj", ReadMesh(mesh()));
  RunWell({"lumi-render", capture(), "-o", out(), "--proxy", (folder_ / "mesh.obj").string(), "--width", "16",
           "--seconds", "0.1"});
  RunWell({"lumi-render", capture(), "-o", (folder_ / "own").string(), "--proxy", "per-view", "--view", "1", "--width",
           "16"});
  EXPECT_EQ(Contents(capture()), before);
}

TEST_F(OthersWorkspace, BecomesASceneWhereAFailedRunLeftItsFiles) {
  fs::create_directories(folder_ / "out/provenance");
  WriteTextAtomically(folder_ / "out/colmap/colmap.log", "no luck");
  RunWell({"lumi-pipeline", capture(), "-o", out(), "--proxy", "plane", "--holdout", "0", "--no-video"});
  EXPECT_TRUE(fs::exists(folder_ / "out/lumigraph.json"));
}

TEST_F(OthersWorkspace, AFilmDoesNotOutliveItsFrames) {
  std::vector<std::string> line = {"lumi-render", capture(), "-o", out(), "--proxy", mesh(), "--seconds", "0.1"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> argv = line;
    argv.insert(argv.end(), more.begin(), more.end());
    RunWell(argv);
  };
  with({"--width", "32", "--video"});
  EXPECT_TRUE(fs::exists(folder_ / "out/path.mp4"));
  with({"--width", "32"});
  EXPECT_TRUE(fs::exists(folder_ / "out/path.mp4")) << "the same frames";
  with({"--width", "48"});
  EXPECT_FALSE(fs::exists(folder_ / "out/path.mp4"));
}

TEST_F(OthersWorkspace, FiguresAreSaidWhateverElseIsNot) {
  const std::vector<std::string> line = {"lumi-render", capture(), "--proxy", mesh(), "--quiet", "--width", "32"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> argv = line;
    argv.insert(argv.end(), more.begin(), more.end());
    return RunWell(argv);
  };
  const ProgramResult holdout = with({"--holdout", "each"});
  EXPECT_THAT(holdout.out, testing::MatchesRegex("5 held-out photos: PSNR [^\n]* dB[^\n]*\n"));
  EXPECT_EQ(holdout.err, "");
  const ProgramResult own = with({"--view", "photo12", "-o", out()});
  EXPECT_THAT(own.out, HasSubstr("--leave-out"));
  EXPECT_THAT(with({"--view", "photo12", "--leave-out", "-o", out()}).out, testing::Not(HasSubstr("--leave-out")));
}

TEST_F(OthersWorkspace, ABudgetThatIsMissedSaysWhatWouldMeetIt) {
  const ProgramResult done = RunWell({"lumi-render", capture(), "-o", out(), "--proxy", mesh(), "--view", "photo12",
                                      "--width", "256", "--budget-ms", "0.0001"});
  EXPECT_THAT(done.out, HasSubstr("budget not met: "));
  EXPECT_THAT(done.out, testing::ContainsRegex("; --budget-ms [0-9]+ would meet it"));
  const json kept = json::parse(RunWell({"lumi-render", capture(), "-o", out(), "--proxy", mesh(), "--view", "photo12",
                                         "--width", "64", "--budget-ms", "100000", "--json"})
                                    .out)["budget"];
  EXPECT_EQ(kept["met"], true);
  EXPECT_FALSE(kept.contains("meets_it"));
}

}  // namespace
}  // namespace lumi
