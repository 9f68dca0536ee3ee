#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/commands.h"
#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "tests/proxy/synthetic_scene.h"
#include "tests/support/child_program.h"
#include "scene/files/temporary_folder.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

// The plate before the wall as a scene on disk, with photos painted by the geometry itself.
Scene WritePlateScene(const fs::path& folder, int width_px = 160) {
  Scene scene = PlateBeforeWall(700, 120, 21);
  const double scale = width_px / 640.0;
  scene.cameras[0] = scene.cameras[0].Scaled(width_px, width_px * 3 / 4);
  for (Point& p : scene.points) {
    for (Observation& o : p.track) o.x_px *= scale;
  }
  scene.folder = folder;
  scene.image_folder = folder / "images";
  const auto shade = [](double u, double v, double phase) {
    return static_cast<std::uint8_t>(std::lround(127 + 60 * std::sin(9 * u + phase) + 60 * std::sin(11 * v + 3 * u)));
  };
  for (const View& view : scene.views) {
    const RenderView render = MakeRenderView(scene, view);
    Image8 photo(render.size_px.x(), render.size_px.y(), 3);
    for (int y = 0; y < photo.height; ++y) {
      for (int x = 0; x < photo.width; ++x) {
        const Eigen::Vector3d d = *RayDirection(render.P, {x + 0.5, y + 0.5});
        Eigen::Vector3d p = render.centre + d * (2 - render.centre.z()) / d.z();
        const bool plate = std::abs(p.x()) <= 0.5 && std::abs(p.y()) <= 0.5;
        if (!plate) p = render.centre + d * (4 - render.centre.z()) / d.z();
        for (int c = 0; c < 3; ++c) photo.At(x, y, c) = shade(p.x(), p.y(), c + (plate ? 2.0 : 0.0));
      }
    }
    WriteImage(scene.image_folder / view.name, photo);
  }
  UpdateFrameOfReference(scene);
  WriteScene(scene, folder);
  return scene;
}

json Parse(const std::string& text) { return json::parse(text); }

TEST(ProxyCommands, FirstProxyBecomesActiveAndASecondRunReusesIt) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const json plane = Parse(RunPlane({folder / "scene", "plane", {}, false}, SilentProgress()));
  EXPECT_EQ(plane["name"], "plane");
  EXPECT_EQ(plane["faces"], 2);
  EXPECT_EQ(plane["closed"], false);
  EXPECT_EQ(plane["reused"], false);
  EXPECT_EQ(plane["active"], true);
  const json mesh = Parse(RunDelaunay({folder / "scene", "mesh", {}, false}, 4, SilentProgress()));
  EXPECT_GT(mesh["faces"], 500);
  EXPECT_EQ(mesh["closed"], true);
  EXPECT_EQ(mesh["active"], false);
  EXPECT_TRUE(mesh["seconds"].is_number());
  const std::string bytes = ReadText(ProxyPath(folder / "scene", "mesh"));
  const json again = Parse(RunDelaunay({folder / "scene", "mesh", {}, true}, 4, SilentProgress()));
  EXPECT_EQ(again["reused"], true);
  EXPECT_EQ(again["active"], true);
  EXPECT_EQ(again["faces"], mesh["faces"]);
  EXPECT_EQ(ReadText(ProxyPath(folder / "scene", "mesh")), bytes);
  const json other = Parse(RunDelaunay({folder / "scene", "mesh", {}, false}, 8, SilentProgress()));
  EXPECT_EQ(other["reused"], false);
  EXPECT_EQ(OpenScene(folder / "scene", {}, SilentProgress()).active_proxy, "mesh");
}

TEST(ProxyCommands, AProxyOfAnotherKindIsNeverOverwritten) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  RunPlane({folder / "scene", "plane", {}, false}, SilentProgress());
  const std::string bytes = ReadText(ProxyPath(folder / "scene", "plane"));
  EXPECT_THROW(RunDelaunay({folder / "scene", "plane", {}, false}, 4, SilentProgress()), UsageError);
  // Somebody's own file, with no record.
  WriteTextAtomically(ProxyPath(folder / "scene", "mesh"), "mine");
  EXPECT_THROW(RunDelaunay({folder / "scene", "mesh", {}, false}, 4, SilentProgress()), UsageError);
  EXPECT_EQ(ReadText(ProxyPath(folder / "scene", "mesh")), "mine");
  EXPECT_EQ(ReadText(ProxyPath(folder / "scene", "plane")), bytes);
  for (const char* name : {"", "../x", "a/b", ".hidden", "auto"}) {
    EXPECT_THROW(RunDelaunay({folder / "scene", name, {}, false}, 4, SilentProgress()), UsageError) << name;
  }
}

TEST(ProxyCommands, AnotherToolsWorkspaceIsNotWrittenTo) {
  const TemporaryFolder folder;
  const Scene scene = WritePlateScene(folder / "scene");
  fs::create_directories(folder / "workspace");
  fs::rename(folder / "scene" / "images", folder / "workspace" / "images");
  WriteColmapModel(scene, folder / "workspace" / "sparse");
  const auto files = [&] {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(folder / "workspace")) names.push_back(entry.path().string());
    std::sort(names.begin(), names.end());
    return names;
  };
  const std::vector<std::string> before = files();
  try {
    RunDelaunay({folder / "workspace", "mesh", {}, false}, 4, SilentProgress());
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_THAT(e.hint(), HasSubstr("--output"));
  }
  EXPECT_THROW(RunAuto({folder / "workspace"}, SilentProgress()), UsageError);
  const json made = Parse(RunDelaunay({folder / "workspace", "mesh", folder / "mesh.ply", false}, 4, SilentProgress()));
  EXPECT_EQ(ReadMesh(folder / "mesh.ply").faces.size(), made["faces"].get<std::size_t>());
  EXPECT_EQ(files(), before);
  EXPECT_THROW(RunDelaunay({folder / "workspace", "mesh", folder / "mesh.txt", false}, 4, SilentProgress()), UsageError);
}

TEST(ProxyCommands, ImportScalesAndJudgesAMesh) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  Mesh wall;  // at half the scene's scale, its front towards the cameras
  wall.vertices = {{-5, -5, 2}, {5, -5, 2}, {5, 5, 2}, {-5, 5, 2}};
  wall.faces = {{0, 2, 1}, {0, 3, 2}};
  WriteMesh(folder / "wall.ply", wall);
  const json in = Parse(RunImport(folder / "wall.ply", 2, {folder / "scene", "wall", {}, false}, SilentProgress()));
  EXPECT_EQ(in["faces"], 2);
  EXPECT_EQ(in["coverage"], 1.0);
  EXPECT_EQ(in["front_fraction"], 1.0);
  EXPECT_NEAR(ReadMesh(ProxyPath(folder / "scene", "wall")).vertices[0].z(), 4, 1e-12);

  struct Listener : ProgressSink {
    std::string said;
    void Report(const std::string&, long, long, double, double) override {}
    void Finish(const std::string&, long, double) override {}
    void Message(const std::string& line) override { said += line; }
  } listener;
  for (auto& f : wall.faces) std::swap(f[1], f[2]);
  WriteMesh(folder / "turned.ply", wall);
  RunImport(folder / "turned.ply", 2, {folder / "scene", "turned", {}, false}, listener);
  EXPECT_THAT(listener.said, HasSubstr("inside out"));
  listener.said.clear();
  for (Eigen::Vector3d& v : wall.vertices) v.z() = -2;  // behind every camera
  WriteMesh(folder / "behind.ply", wall);
  RunImport(folder / "behind.ply", 1, {folder / "scene", "behind", {}, false}, listener);
  EXPECT_THAT(listener.said, HasSubstr("no view sees"));

  EXPECT_THROW(RunImport(folder / "wall.ply", -1, {folder / "scene", "x", {}, false}, SilentProgress()), UsageError);
  EXPECT_THROW(RunImport(folder / "absent.ply", 1, {folder / "scene", "x", {}, false}, SilentProgress()), InputError);
  WriteTextAtomically(folder / "points.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\n");
  EXPECT_THROW(RunImport(folder / "points.obj", 1, {folder / "scene", "x", {}, false}, SilentProgress()), InputError);
  EXPECT_FALSE(fs::exists(ProxyPath(folder / "scene", "x")));
}

TEST(ProxyCommands, InfoMeasuresEveryProxyAndWritesNothing) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  EXPECT_TRUE(Parse(RunInfo(folder / "scene", "", SilentProgress()))["proxies"].empty());
  RunPlane({folder / "scene", "plane", {}, false}, SilentProgress());
  RunDelaunay({folder / "scene", "mesh", {}, false}, 4, SilentProgress());
  const json info = Parse(RunInfo(folder / "scene", "", SilentProgress()));
  ASSERT_EQ(info["proxies"].size(), 2u);
  const json& mesh = info["proxies"][0];
  EXPECT_EQ(mesh["name"], "mesh");
  EXPECT_EQ(mesh["coverage_min"], 1.0);
  EXPECT_LT(mesh["blocked_ray_fraction"], 0.02);
  EXPECT_LT(mesh["point_distance_median"], 1e-9);
  const json& plane = info["proxies"][1];
  EXPECT_EQ(plane["active"], true);
  EXPECT_EQ(plane["front_fraction"], 1.0);
  EXPECT_EQ(plane["closed"], false);
  EXPECT_THAT(DescribeProxy(info.dump()), HasSubstr("mesh"));
  EXPECT_THROW(RunInfo(folder / "scene", "none", SilentProgress()), UsageError);
}

TEST(ProxyProgram, AutoTakesTheMeshWhereThePlaneCannotShowThePlate) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const std::vector<std::string> argv = {"lumi-proxy", "auto", (folder / "scene").string(), "--choose-width", "160", "--holdout", "4", "--json"};
  const ProgramResult first = RunProgram(argv);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const json chosen = Parse(first.out);
  EXPECT_EQ(chosen["name"], "mesh");
  EXPECT_EQ(chosen["closed"], true);
  ASSERT_EQ(chosen["candidates"].size(), 2u);
  for (const json& c : chosen["candidates"]) {
    for (const char* key : {"psnr_mean_db", "ssim_mean", "coverage", "faces", "seconds"}) EXPECT_TRUE(c[key].is_number()) << key;
  }
  EXPECT_GT(chosen["candidates"][1]["psnr_mean_db"].get<double>(), chosen["candidates"][0]["psnr_mean_db"].get<double>() + 1);
  EXPECT_EQ(OpenScene(folder / "scene", {}, SilentProgress()).active_proxy, "mesh");
  const ProgramResult second = RunProgram(argv);
  EXPECT_EQ(Parse(second.out)["reused"], true);
  EXPECT_EQ(Parse(second.out)["candidates"], chosen["candidates"]);
}

TEST(ProxyProgram, AutoTakesThePlaneWherePointsAreTooFew) {
  const TemporaryFolder folder;
  Scene scene = WritePlateScene(folder / "scene");
  scene.points.resize(2);
  WriteScene(scene, folder / "scene");
  const ProgramResult result = RunProgram({"lumi-proxy", "auto", (folder / "scene").string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json chosen = Parse(result.out);
  EXPECT_EQ(chosen["name"], "plane");
  EXPECT_TRUE(chosen["candidates"][1].contains("refused"));
}

TEST(ProxyProgram, ExitCodesAreTheContracts) {
  const TemporaryFolder folder;
  Scene scene = WritePlateScene(folder / "scene");
  const std::string path = (folder / "scene").string();
  EXPECT_EQ(RunProgram({"lumi-proxy"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-proxy", "sphere", path}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-proxy", "plane", (folder / "absent").string()}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-proxy", "auto", path, "--holdout", "1"}).exit_code, 2);
  EXPECT_EQ(RunProgram({"lumi-proxy", "delaunay", path, "--merge-px", "-1"}).exit_code, 2);
  WriteTextAtomically(folder / "bad.ply", "ply\nformat ascii 1.0\nelement vertex 1000000000000\n");
  EXPECT_EQ(RunProgram({"lumi-proxy", "import", (folder / "bad.ply").string(), path}).exit_code, 3);
  scene.points.clear();
  WriteScene(scene, folder / "scene");
  const ProgramResult refused = RunProgram({"lumi-proxy", "delaunay", path});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("lumi-proxy plane"));
  EXPECT_FALSE(fs::exists(folder / "scene" / "proxies"));
  EXPECT_EQ(RunProgram({"lumi-proxy", "--help"}).exit_code, 0);
}

TEST(ProxyProgram, TheCubesOwnProxyCanBeImported) {
  const fs::path proxy = fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data" / "cube" / "proxy.obj";
  if (!fs::exists(proxy)) GTEST_SKIP() << "no captures at " << proxy;
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const json imported = Parse(RunImport(proxy, 1, {folder / "scene", "cube", {}, false}, SilentProgress()));
  EXPECT_GT(imported["faces"], 1000);
}

}  // namespace
}  // namespace lumi::test
