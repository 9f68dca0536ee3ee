// Each call on a file that a program makes fails once, and so does each kind of allocation: the program says so in one
// line, ends with the contract's exit code, leaves nothing half-written and nothing of the user's changed, and a second
// run makes what an undisturbed one makes.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <set>
#include <thread>

#include "scene/files/provenance.h"
#include "scene/program/subprocess.h"
#include "tests/end_to_end/fault_sweep.h"
#include "tests/support/child_program.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

// Losing power after the record is on the disk loses none of the outputs that it names.
TEST_F(FaultInjection, TheRecordOfAStageComesAfterItsOutputsAreOnTheDisk) {
  const auto flushed_before = [](const FaultRun& run, const fs::path& record, const std::string& call) {
    const auto& calls = run.calls;
    const auto last = std::find(calls.rbegin(), calls.rend(), "rename " + record.string());
    const auto flush = std::find(calls.rbegin(), calls.rend(), call);
    return last != calls.rend() && flush != calls.rend() && last < flush;
  };
  const FaultCase hull{{"lumi-proxy", "hull", "@/scene", "--silhouettes", "@/capture/truth/silhouettes", "--cell-px",
                        "16", "--name", "again"},
                       {}};
  Reset(hull);
  const FaultRun few = RunWithFault(Arguments(hull), FaultKind::kWrite, 0, Work());
  for (const char* written : {"proxies/again.ply", "proxies/again.json", "proxies"})
    EXPECT_TRUE(flushed_before(few, Work() / "scene/provenance/proxy-again.json",
                               "fsync " + (Work() / "scene" / written).lexically_normal().string()))
        << written << "\n"
        << testing::PrintToString(few.calls);
  const FaultRun many = RunWithFault(
      Arguments({{"lumi-simulate", "--example", "desk", "--views", "24", "--width", "16", "-o", "@/new"}, {}}),
      FaultKind::kWrite, 0, Work());
  EXPECT_TRUE(flushed_before(many, Work() / "new/provenance/simulate.json", "syncfs " + (Work() / "new").string()));
}

// What a scene holds, some stage's record names; but for what each run checks by itself and may make anew.
TEST_F(FaultInjection, TheRecordsOfASceneNameAllItsFiles) {
  Reset({{}, {"workspace", "capture"}});
  const std::string scene = (Work() / "new").string();
  Make({"lumi-pipeline", (Work() / "workspace").string(), "-o", scene, "--proxy", "auto", "--proxy-minutes", "0.05",
        "--holdout", "2", "--width", "32", "--seconds", "0.1"});
  Make({"lumi-proxy", "delaunay", scene});
  Make({"lumi-proxy", "dense", scene, "--width", "64", "--iterations", "1"});
  Make({"lumi-proxy", "hull", scene, "--silhouettes", (Work() / "capture/truth/silhouettes").string(), "--cell-px",
        "16"});
  Make({"lumi-proxy", "hull", scene, "--silhouettes", (Work() / "capture/truth/silhouettes").string(), "--cell-px",
        "16", "--tradeoff"});
  Make({"lumi-proxy", "simplify", scene, "--from", "delaunay", "--tradeoff", "--table-faces", "100", "--holdout", "2",
        "--choose-width", "32"});
  Make({"lumi-render", "tradeoff", scene, "-o", (Work() / "measured").string(), "--quick", "--width", "32", "--holdout",
        "2"});
  std::set<std::string> named;
  for (const auto& entry : fs::directory_iterator(Work() / "new/provenance")) {
    if (entry.path().extension() != ".json") continue;
    const auto record = ReadProvenance(scene, entry.path().stem().string());
    ASSERT_TRUE(record) << entry.path();
    for (const auto& [output, fingerprint] : record->outputs)
      named.insert(fs::path(output).lexically_normal().string());
  }
  const auto is_named = [&](fs::path name) {
    for (; !name.empty(); name = name.parent_path())
      if (named.contains(name.string())) return true;
    return false;
  };
  for (const auto& entry : fs::recursive_directory_iterator(scene)) {
    const fs::path name = entry.path().lexically_relative(scene);
    const bool made_anew = *name.begin() == "provenance" || *name.begin() == "small-photos" ||
                           name.parent_path() == fs::path("stereo/planes");
    if (entry.is_regular_file() && !made_anew) {
      EXPECT_TRUE(is_named(name)) << name;
    }
  }
}

TEST_F(FaultInjection, Simulate) {
  SweepAll({{"lumi-simulate", "--example", "desk", "--views", "2", "--width", "32", "-o", "@/new"}, {"capture"}});
}
TEST_F(FaultInjection, ProxyPlane) { SweepAll({{"lumi-proxy", "plane", "@/scene", "--activate"}, {"scene/images"}}); }
TEST_F(FaultInjection, ProxyPlanes) { SweepAll({{"lumi-proxy", "planes", "@/scene"}, {"scene/images"}}); }
TEST_F(FaultInjection, ProxyDelaunay) { SweepAll({{"lumi-proxy", "delaunay", "@/scene"}, {"scene/images"}}); }
TEST_F(FaultInjection, ProxyHull) {
  SweepAll({{"lumi-proxy", "hull", "@/scene", "--silhouettes", "@/capture/truth/silhouettes", "--cell-px", "16",
             "--name", "again"},
            {"scene/images", "capture"}});
}
TEST_F(FaultInjection, ProxySimplify) {
  SweepAll({{"lumi-proxy", "simplify", "@/scene", "--from", "sparse", "--faces", "100"}, {"scene/images"}});
}
TEST_F(FaultInjection, ProxySilhouettes) {
  SweepAll({{"lumi-proxy", "silhouettes", "@/scene", "--masks", "@/capture/truth/silhouettes"},
            {"scene/images", "capture"}});
}
TEST_F(FaultInjection, ProxyImport) {
  SweepAll({{"lumi-proxy", "import", "@/capture/truth/mesh.ply", "@/scene"}, {"scene/images", "capture"}});
}
TEST_F(FaultInjection, RenderHoldout) {
  SweepAll({{"lumi-render", "@/scene", "-o", "@/holdout", "--holdout", "2"}, {"scene"}, {"render.json"}});
}
TEST_F(FaultInjection, RenderFrames) {
  SweepAll({{"lumi-render", "@/scene", "-o", "@/frames", "--seconds", "0.1", "--width", "48"},
            {"scene"},
            {"render.json"},
            "frames/render.json"});
}
TEST_F(FaultInjection, RenderVideo) {
  SweepAll({{"lumi-render", "@/scene", "-o", "@/film.mp4", "--seconds", "0.1", "--width", "48"}, {"scene"}});
}
TEST_F(FaultInjection, ExportWeb) {
  SweepAll({{"lumi-export", "web", "@/scene", "-o", "@/page.html", "--as-scene", "@/page-data"}, {"scene"}});
}
TEST_F(FaultInjection, ExportWebFolder) {
  SweepAll({{"lumi-export", "web", "@/scene", "-o", "@/page", "--proxy", "sparse"}, {"scene"}});
}
TEST_F(FaultInjection, ExportGltf) {
  SweepAll({{"lumi-export", "gltf", "@/scene", "-o", "@/model.glb", "--points", "@/points.ply"}, {"scene"}});
}
TEST_F(FaultInjection, Reconstruct) {
  SweepAll({{"lumi-reconstruct", "@/taken/images", "-o", "@/new", "--poses", "@/taken/truth/sparse", "--database",
             "@/database.db"},
            {"taken", "database.db"},
            {"provenance/"}});
}
TEST_F(FaultInjection, ReconstructFindsAndMatchesFeatures) {
  SweepAll(
      {{"lumi-reconstruct", "@/taken/images", "-o", "@/new", "--poses", "@/taken/truth/sparse", "--quality", "low"},
       {"taken"},
       {"provenance/"},
       "",
       true});
}
TEST_F(FaultInjection, ReconstructByFactorization) {
  SweepAll({{"lumi-reconstruct", "@/walk/video.mp4", "-o", "@/new", "--backend", "factorization", "--projective",
             "--all-frames"},
            {"walk"},
            {"provenance/"},
            "",
            true});
}
TEST_F(FaultInjection, Calibrate) {
  SweepAll({{"lumi-calibrate", "@/boards", "--board", "9x6", "--square-mm", "25", "-o", "@/new/camera.yaml"},
            {"boards"},
            {},
            "",
            true});
}
TEST_F(FaultInjection, CalibrateUndistortsAndMeasures) {
  SweepAll({{"lumi-calibrate", "@/boards", "--board", "9x6", "--square-mm", "25", "-o", "@/new/camera.yaml",
             "--undistort", "@/straight", "--tradeoff"},
            {"boards"},
            {},
            "",
            true,
            {"new/camera.tradeoff", "new/report"}});
}
TEST_F(FaultInjection, ReconstructExports) {
  SweepAll({{"lumi-reconstruct", "export", "@/scene", "-o", "@/transforms.json"}, {"scene"}});
  SweepAll({{"lumi-reconstruct", "export", "@/scene", "-o", "@/exported"}, {"scene"}});
}
TEST_F(FaultInjection, ProxyBox) { SweepAll({{"lumi-proxy", "box", "@/walk"}, {"walk/images"}}); }
TEST_F(FaultInjection, ProxyDense) {
  SweepAll({{"lumi-proxy", "dense", "@/scene", "--width", "64", "--iterations", "1"},
            {"scene/images"},
            {"stereo/"},
            "",
            true});
}
TEST_F(FaultInjection, ProxyDenseDepthMapsOnly) {
  SweepAll({{"lumi-proxy", "dense", "@/scene", "--width", "64", "--iterations", "1", "--depth-only"},
            {"scene/images"},
            {"stereo/"},
            "",
            true});
}
TEST_F(FaultInjection, ProxyAuto) {
  SweepAll(
      {{"lumi-proxy", "auto", "@/scene", "--candidates", "plane", "delaunay", "--holdout", "2", "--choose-width", "32"},
       {"scene/images"},
       {"lumigraph.json", "provenance/proxy-auto"},
       "",
       true});
}
TEST_F(FaultInjection, ProxyHullTradeoff) {
  SweepAll({{"lumi-proxy", "hull", "@/scene", "--silhouettes", "@/capture/truth/silhouettes", "--cell-px", "16",
             "--tradeoff"},
            {"scene/images", "capture"},
            {},
            "",
            true,
            {"scene/tradeoff/", "scene/provenance/measured-"}});
}
TEST_F(FaultInjection, ProxySimplifyTradeoff) {
  SweepAll({{"lumi-proxy", "simplify", "@/scene", "--from", "sparse", "--tradeoff", "--table-faces", "100", "--holdout",
             "2", "--choose-width", "32"},
            {"scene/images"},
            {},
            "",
            true,
            {"scene/tradeoff/", "scene/provenance/measured-"}});
}
TEST_F(FaultInjection, RenderTradeoff) {
  SweepAll({{"lumi-render", "tradeoff", "@/scene", "-o", "@/measured", "--quick", "--width", "32", "--holdout", "2",
             "--proxy", "sparse", "--views", "1", "--repeats", "1"},
            {"scene/images"},
            {},
            "",
            true,
            {"scene/fronts/", "measured/", "scene/provenance/measured-"}});
}
TEST_F(FaultInjection, RenderMethods) {
  SweepAll({{"lumi-render", "methods", "@/scene", "-o", "@/methods", "--proxy", "sparse", "--width", "32", "--views",
             "1", "--repeats", "1", "--methods", "ulr", "--methods", "pighin-1998"},
            {"scene"},
            {},
            "",
            true,
            {"methods/"}});
}
TEST_F(FaultInjection, Stabilize) {
  SweepAll(
      {{"lumi-stabilize", "@/walk", "-o", "@/path.json", "--plot", "@/tracks.svg"}, {"walk/images", "walk/sparse"}});
}
TEST_F(FaultInjection, StabilizeScore) {
  SweepAll({{"lumi-stabilize", "score", "@/walk/video.mp4", "@/walk/video.mp4", "--plot", "@/score.svg"}, {"walk"}});
}
TEST_F(FaultInjection, TimePeriodicPeriod) {
  SweepAll({{"lumi-timeperiodic", "period", "@/fixed.mp4", "--plot", "@/period.svg"}, {"fixed.mp4"}});
}
TEST_F(FaultInjection, TimePeriodicPeriodTradeoff) {
  SweepAll({{"lumi-timeperiodic", "period", "@/fixed.mp4", "--tradeoff", "@/front"},
            {"fixed.mp4"},
            {},
            "",
            true,
            {"front/"}});
}
TEST_F(FaultInjection, TimePeriodicSampling) {
  SweepAll({{"lumi-timeperiodic", "sampling", "@/turning", "--plot", "@/sampling.svg"}, {"turning"}});
}
TEST_F(FaultInjection, TimePeriodicMasks) {
  SweepAll(
      {{"lumi-timeperiodic", "calibrate", "@/waved.mp4", "-o", "@/new", "--fixed-video", "@/fixed.mp4", "--masks-only"},
       {"fixed.mp4", "waved.mp4"},
       {"timeperiodic/"},
       "",
       true});
}
TEST_F(FaultInjection, PipelineStabilizes) {
  SweepAll({{"lumi-pipeline", "@/film.mp4", "--stabilize", "smooth", "-o", "@/steady.mp4", "--no-score"},
            {"film.mp4"},
            {"steady-work/"},
            "",
            true,
            // These say how many frames were there already.
            {"steady-work/report", "steady-work/window-000/steady/render.json"}});
}
TEST_F(FaultInjection, PipelineFromAWorkspace) {
  SweepAll({{"lumi-pipeline", "@/workspace", "-o", "@/new", "--proxy", "plane", "--holdout", "0", "--no-video"},
            {"workspace"},
            // The mark says that an import has not ended: where a run ends without unwinding it stays, as after a kill.
            {"lumigraph.json", "provenance/", "IMPORT-UNFINISHED"}});
}
TEST_F(FaultInjection, PipelineFromPhotos) {
  SweepAll({{"lumi-pipeline", "@/taken/images", "-o", "@/new", "--poses", "@/taken/truth/sparse", "--quality", "low",
             "--proxy", "plane", "--holdout", "2", "--width", "48", "--seconds", "0.1", "--fidelity-db", "0"},
            {"taken"},
            {"lumigraph.json", "provenance/"},
            "",
            true});
}
TEST_F(FaultInjection, PipelineOfABatch) {
  SweepAll(
      {{"lumi-pipeline", "--batch", "@/list.txt", "-o", "@/new", "--proxy", "plane", "--holdout", "0", "--no-video"},
       {"workspace", "list.txt"},
       {"lumigraph.json", "provenance/", "IMPORT-UNFINISHED", "batch.json"},
       "",
       true});
}

// A screen for the viewer, for as long as it lives.
class Display {
 public:
  explicit Display(const fs::path& folder)
      : number_file_(folder / "display"),
        server_({FindProgram("sh")->string(), "-c",
                 "exec Xvfb -displayfd 3 -screen 0 640x480x24 3>" + number_file_.string()}) {
    for (int i = 0; i < 300 && number_.empty(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      std::ifstream(number_file_) >> number_;
    }
    ::setenv("DISPLAY", (":" + number_).c_str(), 1);
    ::setenv("XDG_CONFIG_HOME", (folder / "config").c_str(), 1);
  }
  bool Works() const { return !number_.empty(); }

 private:
  fs::path number_file_;
  ChildProgram server_;
  std::string number_;
};
FaultCase OfTheViewer(const std::string& script) {
  return {{"lumi-view", "@/scene", "--width", "160", "--height", "120", "--no-ui", "--script", script},
          {"scene/images"}};
}
constexpr const char* kPathOfTwo = "wait; key-add; jump 1; key-add; path-save @/path.json";
TEST_F(FaultInjection, ViewerWrites) {
  if (!FindProgram("Xvfb")) GTEST_SKIP() << "Xvfb is not installed";
  const Display display(folder_->path());
  ASSERT_TRUE(display.Works()) << "Xvfb does not start";
  const FaultCase c = OfTheViewer(
      "wait; screenshot @/shot.png; key-add; jump 1; key-add; path-save @/path.json; "
      "path-save-nerfstudio @/nerfstudio.json");
  PlantTemporaries(c);
  Sweep(c, FaultKind::kWrite);
}
// Photos that cannot be read are left out of its picture, and said: what is compared is a path without pictures.
TEST_F(FaultInjection, ViewerReads) {
  if (!FindProgram("Xvfb")) GTEST_SKIP() << "Xvfb is not installed";
  const Display display(folder_->path());
  ASSERT_TRUE(display.Works()) << "Xvfb does not start";
  Sweep(OfTheViewer(kPathOfTwo), FaultKind::kRead);
}
TEST_F(FaultInjection, ViewerAllocates) {
  if (!FindProgram("Xvfb")) GTEST_SKIP() << "Xvfb is not installed";
  const Display display(folder_->path());
  ASSERT_TRUE(display.Works()) << "Xvfb does not start";
  Sweep(OfTheViewer(kPathOfTwo), FaultKind::kMemory);
}

}  // namespace
}  // namespace lumi
