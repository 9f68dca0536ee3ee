#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "proxy/commands.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/proxy/hull_bodies.h"
#include "tests/proxy/simplify_meshes.h"
#include "tests/proxy/synthetic_scene.h"
#include "tests/support/summary_json.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

// An ellipsoid with stripes before a grey wall, from ten sides, with a mesh that is its hull.
void WriteHullScene(const fs::path& folder) {
  SceneBuilder builder(5);
  for (int n = 0; n < 10; ++n)
    builder.AddCamera({4 * std::cos(n * 0.628), 4 * std::sin(n * 0.628), n % 2 == 0 ? 2.0 : -1.0}, {0, 0, 0});
  Scene scene = builder.Build();
  scene.cameras[0] = scene.cameras[0].Scaled(160, 120);
  scene.folder = folder;
  scene.image_folder = folder / "images";
  const Body body = Ellipsoid({0.8, 0.6, 0.5});
  for (const View& view : scene.views) {
    const RenderView render = MakeRenderView(scene, view);
    Image8 photo(160, 120, 3, 110);
    for (int y = 0; y < 120; ++y) {
      for (int x = 0; x < 160; ++x) {
        if (!body(render.centre, *RayDirection(render.P, {x + 0.5, y + 0.5}))) continue;
        photo.At(x, y, 0) = static_cast<std::uint8_t>(200 + 8 * (x / 8 % 5));
        photo.At(x, y, 1) = photo.At(x, y, 2) = 30;
      }
    }
    WriteImage(fs::path(scene.image_folder / view.name), photo);
  }
  UpdateFrameOfReference(scene);
  WriteScene(scene, folder);
  SilhouetteSource source;
  source.rule = "R > 2 * G";
  RunSilhouettes(folder, source, {}, {}, SilentProgress());
  scene.active_proxy = "hull";
  WriteManifest(scene, folder);
  // In the visual hull's place a coarse mesh around the body: what is measured here is the command.
  WriteMesh(ProxyPath(folder, "hull"), MappedVertices(BallMesh(7), [](const Eigen::Vector3d& x) {
              return Eigen::Vector3d(1.05 * x.normalized().cwiseProduct(Eigen::Vector3d(0.8, 0.6, 0.5)));
            }));
}

TEST(SimplifyCommands, AKeptHullCoversTheSilhouettesAndASecondRunReusesIt) {
  const TemporaryFolder folder;
  const fs::path scene = folder / "scene";
  WriteHullScene(scene);
  SimplifyRequest request;
  request.faces = 120;
  request.keep_hull = true;
  const json kept = AsJson(RunSimplify(request, {scene, "", {}, true}, SilentProgress()));
  EXPECT_EQ(kept["name"], "hull-120-kept");
  EXPECT_EQ(kept["from"], "hull");
  EXPECT_LE(kept["faces"], 120);
  EXPECT_EQ(kept["closed"], true);
  EXPECT_EQ(kept["sound"], true);
  EXPECT_GE(kept["coverage_min"].get<double>(), 0.995);
  EXPECT_GE(kept["iou_median"].get<double>(), 0.85);
  EXPECT_TRUE(kept["views_missed"].empty());
  EXPECT_GE(kept["volume_ratio"].get<double>(), 1);
  EXPECT_GT(kept["mean_distance_px"].get<double>(), 0);
  EXPECT_EQ(ReadMesh(ProxyPath(scene, "hull-120-kept")).faces.size(), kept["faces"].get<std::size_t>());
  // It is the active one now: what is simplified stays the hull.
  const Made<SimplifyFigures> reused = RunSimplify(request, {scene, "", {}, true}, SilentProgress());
  const json again = AsJson(reused);
  EXPECT_EQ(again["name"], "hull-120-kept");
  EXPECT_EQ(again["reused"], true);
  EXPECT_EQ(again["iou_median"], kept["iou_median"]);
  EXPECT_THAT(Describe(reused), HasSubstr("10 silhouettes"));

  request.keep_hull = false;
  request.faces = 30;
  Made<SimplifyFigures> simplified = RunSimplify(request, {scene, "", {}, false}, SilentProgress());
  const json coarse = AsJson(simplified);
  EXPECT_EQ(coarse["name"], "hull-30");
  EXPECT_FALSE(coarse["views_missed"].empty());  // and it is said
  EXPECT_THAT(Describe(simplified), HasSubstr("not covered"));
  EXPECT_THAT(Describe(simplified), testing::Not(HasSubstr("of a wrap")));
  simplified.figures->wrapped = true;
  EXPECT_THAT(Describe(simplified), HasSubstr("--in-pixels"));
  request.in_pixels = true;
  request.faces = 60;
  const json in_pixels = AsJson(RunSimplify(request, {scene, "", {}, false}, SilentProgress()));
  EXPECT_EQ(in_pixels["method"], "in-pixels");
  EXPECT_EQ(in_pixels["faces"], 60);
  EXPECT_EQ(in_pixels["removed_parts"], 0);
  EXPECT_EQ(in_pixels["wrapped"], false);
  request.from = "nothing";
  EXPECT_THROW(RunSimplify(request, {scene, "", {}, false}, SilentProgress()), UsageError);
  request.from = "hull";
  EXPECT_THROW(RunSimplify(request, {scene, "hull", {}, false}, SilentProgress()), UsageError);
}

TEST(SimplifyCommands, AMeshFileAnywhereIsSimplifiedAndAgainWhereItChanged) {
  const TemporaryFolder folder;
  const fs::path scene = folder / "scene", file = folder / "out" / "mesh.ply";
  WriteHullScene(scene);
  fs::create_directories(folder / "out");
  fs::copy_file(ProxyPath(scene, "hull"), file);
  SimplifyRequest request;
  request.faces = 60;
  request.from = file.string();
  const json made = AsJson(RunSimplify(request, {scene, "", {}, false}, SilentProgress()));
  EXPECT_EQ(made["name"], "mesh-60");
  EXPECT_LE(made["faces"], 60);
  EXPECT_EQ(AsJson(RunSimplify(request, {scene, "", {}, false}, SilentProgress()))["reused"], true);
  WriteMesh(file, BallMesh(6));
  EXPECT_EQ(AsJson(RunSimplify(request, {scene, "", {}, false}, SilentProgress()))["reused"], false);
  RunSimplify(request, {scene, "", folder / "out" / "small.ply", false}, SilentProgress());
  EXPECT_LE(ReadMesh(folder / "out" / "small.ply").faces.size(), 60U);
}

TEST(SimplifyCommands, TheSilhouettesThatTheHullWasMadeFromCountAlsoElsewhere) {
  for (const bool within : {true, false}) {
    const TemporaryFolder folder;
    const fs::path scene = folder / "scene", moved = folder / "moved";
    WriteHullScene(scene);
    HullRequest hull;
    hull.silhouettes = (within ? scene : folder.path()) / "outlines";
    fs::rename(scene / "silhouettes", hull.silhouettes);
    RunHull(hull, {scene, "carved", {}, true}, SilentProgress());
    fs::rename(scene, moved);  // a folder within the scene goes with it
    SimplifyRequest request;
    request.faces = 200;
    request.from = "carved";
    request.keep_hull = true;
    const json kept = AsJson(RunSimplify(request, {moved, "", {}, false}, SilentProgress()));
    ASSERT_TRUE(kept.contains("coverage_min")) << within;
    EXPECT_GE(kept["coverage_min"].get<double>(), 0.99) << within;
  }
}

TEST(SimplifyCommands, TheTradeoffIsATableAndThreeFiles) {
  const TemporaryFolder folder;
  const fs::path scene = folder / "scene";
  WriteHullScene(scene);
  SimplifyTradeoffRequest request;
  request.scene = scene;
  request.faces = {2, 50, 200};
  request.width_px = 80;
  const SimplifyTradeoff tradeoff = RunSimplifyTradeoff(request, SilentProgress());
  const json points = AsJson(tradeoff)["tradeoff"]["points"];
  ASSERT_EQ(points.size(), 10u);  // three numbers of faces by three methods, and the mesh itself
  EXPECT_TRUE(points[0].contains("failed"));
  for (const json& p : points) {
    if (p.contains("failed")) continue;
    EXPECT_TRUE(p["psnr_mean_db"].is_number()) << p;
    EXPECT_GT(p["ms_per_frame"].get<double>(), 0);
  }
  EXPECT_GT(points[1]["mean_distance_px"].get<double>(), points[2]["mean_distance_px"].get<double>());
  EXPECT_EQ(points[9]["method"], "all");
  EXPECT_EQ(points[9]["mean_distance_px"].get<double>() < 1e-6, true);
  for (const char* ending : {".json", ".csv", ".svg"})
    EXPECT_TRUE(fs::exists(scene / "tradeoff" / ("simplify-hull" + std::string(ending)))) << ending;
  EXPECT_THAT(Describe(tradeoff), HasSubstr("keep-hull"));
  EXPECT_EQ(ListProxies(scene).size(), 1u);  // nothing is left behind
}

}  // namespace
}  // namespace lumi::test
