#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "proxy/commands.h"
#include "proxy/proxy_store.h"
#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/proxy/synthetic_scene.h"
#include "tests/support/child_program.h"
#include "tests/support/summary_json.h"

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

ImportRequest Importing(const fs::path& file) {
  ImportRequest request;
  request.file = file;
  return request;
}

// At half the scene's scale, its front towards the cameras.
Mesh WallMesh() {
  Mesh wall;
  wall.vertices = {{-5, -5, 2}, {5, -5, 2}, {5, 5, 2}, {-5, 5, 2}};
  wall.faces = {{0, 2, 1}, {0, 3, 2}};
  return wall;
}

void ExpectSaysTheSameAgain(json made, json again) {
  EXPECT_EQ(again["reused"], true);
  for (const char* differs : {"reused", "seconds"}) {
    made.erase(differs);
    again.erase(differs);
  }
  EXPECT_EQ(made.dump(), again.dump());
}

TEST(ProxyCommands, MovingStandsBeforeTheMeshWhereMasksAndTimesSaySo) {
  const TemporaryFolder folder;
  Scene scene = WritePlateScene(folder / "scene");
  const ProxyTarget target{folder / "scene", "moving", {}, false};
  EXPECT_THROW(RunMoving(target, {}, SilentProgress()), DataError);  // no masks
  for (const View& view : scene.views)
    WriteImage(folder / "scene" / "masks" / (view.name + ".png"), Image8(160, 120, 1));
  EXPECT_THROW(RunMoving(target, {}, SilentProgress()), DataError);  // no times
  // Filmed once a period: all photos show one moment.
  scene.period_s = 0.7;
  for (std::size_t i = 0; i < scene.views.size(); ++i) scene.views[i].time_s = 0.7 * static_cast<double>(i);
  WriteManifest(scene, folder / "scene");
  EXPECT_THROW(RunMoving(target, {.over = "wall"}, SilentProgress()), UsageError);
  RunPlane({folder / "scene", "plane", {}, false}, SilentProgress());
  const json over_plane =
      AsJson(RunMoving({folder / "scene", "before-plane", {}, false}, {.over = "plane"}, SilentProgress()));
  EXPECT_GT(over_plane["faces"], 100);
  EXPECT_EQ(over_plane["moments"], 1);
  const json moving =
      AsJson(RunMoving(target, {}, SilentProgress()));  // the mesh is made on the way, and is no proxy of the scene's
  EXPECT_EQ(moving["over"], "delaunay");
  EXPECT_THAT(ListProxies(folder / "scene"), testing::UnorderedElementsAre("plane", "before-plane", "moving"));
  ExpectSaysTheSameAgain(moving, AsJson(RunMoving(target, {}, SilentProgress())));
}

TEST(ProxyCommands, ARunThatHasNothingToDoSaysWhatTheOneBeforeSaid) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const auto target = [&](const char* name) { return ProxyTarget{folder / "scene", name, {}, false}; };
  const auto planes = [&] { return AsJson(RunPlanes(target("planes"), {}, SilentProgress())); };
  const json found = planes();
  EXPECT_GT(found["planes"][0]["points"], 0);
  ExpectSaysTheSameAgain(found, planes());
  WriteMesh(folder / "wall.ply", WallMesh());
  const auto import = [&] {
    ImportRequest request = Importing(folder / "wall.ply");
    request.scale = 2;
    request.axes = "-x,y,-z";
    return AsJson(RunImport(request, target("import"), SilentProgress()));
  };
  const json imported = import();
  EXPECT_EQ(imported["placement"]["scale"], 2);
  ExpectSaysTheSameAgain(imported, import());

  SceneBuilder builder(5);
  for (int i = 0; i < 12; ++i) builder.AddCamera({0.1, 0, 0.8 * i}, {0.1, 0, 0.8 * i + 5});
  for (const double side : {-1.1, 1.1}) {
    builder.AddSurface({{side, 0, 10}, {0, 1.4, 0}, {0, 0, 10}}, 200);
    builder.AddSurface({{0, 1.2 * side, 10}, {1.1, 0, 0}, {0, 0, 10}}, 200);
  }
  Scene hallway = builder.Build();
  hallway.image_folder = folder / "hallway" / "images";
  UpdateFrameOfReference(hallway);
  WriteScene(hallway, folder / "hallway");
  const auto box = [&] { return AsJson(RunBox({folder / "hallway", "box", {}, false}, 6, SilentProgress())); };
  const json walls = box();
  EXPECT_GT(walls["size"][0], 1);
  ExpectSaysTheSameAgain(walls, box());
}

TEST(ProxyCommands, FirstProxyBecomesActiveAndASecondRunReusesIt) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const json plane = AsJson(RunPlane({folder / "scene", "plane", {}, false}, SilentProgress()));
  EXPECT_EQ(plane["name"], "plane");
  EXPECT_EQ(plane["faces"], 2);
  EXPECT_EQ(plane["closed"], false);
  EXPECT_EQ(plane["reused"], false);
  EXPECT_EQ(plane["active"], true);
  const json mesh = AsJson(RunDelaunay({folder / "scene", "delaunay", {}, false}, 4, SilentProgress()));
  EXPECT_GT(mesh["faces"], 500);
  EXPECT_EQ(mesh["closed"], true);
  EXPECT_EQ(mesh["active"], false);
  EXPECT_TRUE(mesh["seconds"].is_number());
  const std::string bytes = ReadText(ProxyPath(folder / "scene", "delaunay"));
  const json again = AsJson(RunDelaunay({folder / "scene", "delaunay", {}, true}, 4, SilentProgress()));
  EXPECT_EQ(again["reused"], true);
  EXPECT_EQ(again["active"], true);
  EXPECT_EQ(again["faces"], mesh["faces"]);
  EXPECT_EQ(ReadText(ProxyPath(folder / "scene", "delaunay")), bytes);
  const json other = AsJson(RunDelaunay({folder / "scene", "delaunay", {}, false}, 8, SilentProgress()));
  EXPECT_EQ(other["reused"], false);
  EXPECT_EQ(OpenScene(folder / "scene", {}, SilentProgress()).active_proxy, "delaunay");
}

TEST(ProxyCommands, AProxyOfAnotherKindIsNeverOverwritten) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  RunPlane({folder / "scene", "plane", {}, false}, SilentProgress());
  const std::string bytes = ReadText(ProxyPath(folder / "scene", "plane"));
  EXPECT_THROW(RunDelaunay({folder / "scene", "plane", {}, false}, 4, SilentProgress()), UsageError);
  // Somebody's own file, with no record.
  WriteTextAtomically(ProxyPath(folder / "scene", "delaunay"), "mine");
  EXPECT_THROW(RunDelaunay({folder / "scene", "delaunay", {}, false}, 4, SilentProgress()), UsageError);
  EXPECT_EQ(ReadText(ProxyPath(folder / "scene", "delaunay")), "mine");
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
    for (const auto& entry : fs::recursive_directory_iterator(folder / "workspace"))
      names.push_back(entry.path().string());
    std::sort(names.begin(), names.end());
    return names;
  };
  const std::vector<std::string> before = files();
  try {
    RunDelaunay({folder / "workspace", "delaunay", {}, false}, 4, SilentProgress());
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_THAT(e.hint(), HasSubstr("-o FILE.ply"));
  }
  EXPECT_THROW(
      RunAuto(
          {.scene = folder / "workspace", .budget_ms = {}, .proxy_minutes = {}, .depth_width_px = {}, .candidates = {}},
          SilentProgress()),
      UsageError);
  const json made =
      AsJson(RunDelaunay({folder / "workspace", "delaunay", folder / "mesh.ply", false}, 4, SilentProgress()));
  EXPECT_EQ(ReadMesh(folder / "mesh.ply").faces.size(), made["faces"].get<std::size_t>());
  EXPECT_EQ(files(), before);
  EXPECT_THROW(RunDelaunay({folder / "workspace", "delaunay", folder / "mesh.txt", false}, 4, SilentProgress()),
               UsageError);
}

struct Listener : ProgressSink {
  std::string said;
  void Report(const std::string&, long, long, double, double) override {}
  void Finish(const std::string&, long, double) override {}
  void Message(const std::string& line) override { said += line; }
};

TEST(ProxyCommands, ImportScalesTurnsAndMendsAMesh) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  Mesh wall = WallMesh();
  WriteMesh(folder / "wall.ply", wall);
  ImportRequest request = Importing(folder / "wall.ply");
  request.scale = 2;
  const json in = AsJson(RunImport(request, {folder / "scene", "wall", {}, false}, SilentProgress()));
  EXPECT_EQ(in["faces"], 2);
  EXPECT_EQ(in["coverage"], 1.0);
  EXPECT_EQ(in["front_fraction"], 1.0);
  EXPECT_EQ(in["repaired"]["inside_out_parts"], 0);
  EXPECT_NEAR(ReadMesh(ProxyPath(folder / "scene", "wall")).vertices[0].z(), 4, 1e-12);

  // In millimetres, with its z axis along the scene's y: the same wall.
  Mesh turned = wall;
  for (Eigen::Vector3d& v : turned.vertices) v = 2000 * Eigen::Vector3d(v.x(), -v.z(), v.y());
  WriteMesh(folder / "turned.obj", turned);
  ImportRequest millimetres = Importing(folder / "turned.obj");
  millimetres.unit = "mm";
  millimetres.axes = "x,z,-y";
  RunImport(millimetres, {folder / "scene", "turned", {}, false}, SilentProgress());
  EXPECT_LT((ReadMesh(ProxyPath(folder / "scene", "turned")).vertices[0] - Eigen::Vector3d(-10, -10, 4)).norm(), 1e-9);
  // A scene whose unit was measured: half a metre.
  WriteScale(folder / "scene", 0.5);
  for (Eigen::Vector3d& v : turned.vertices) v *= 0.5;
  WriteMesh(folder / "half.obj", turned);
  millimetres.file = folder / "half.obj";
  RunImport(millimetres, {folder / "scene", "half", {}, false}, SilentProgress());
  EXPECT_LT((ReadMesh(ProxyPath(folder / "scene", "half")).vertices[0] - Eigen::Vector3d(-10, -10, 4)).norm(), 1e-9);

  // Inside out: mended and said, or refused.
  Listener listener;
  for (auto& f : wall.faces) std::swap(f[1], f[2]);
  WriteMesh(folder / "back.ply", wall);
  request.file = folder / "back.ply";
  const json back = AsJson(RunImport(request, {folder / "scene", "back", {}, false}, listener));
  EXPECT_THAT(listener.said, HasSubstr("1 part inside out"));
  EXPECT_EQ(back["front_fraction"], 1.0);
  request.repair = false;
  EXPECT_THROW(RunImport(request, {folder / "scene", "x", {}, false}, SilentProgress()), InputError);
  request.repair = true;

  listener.said.clear();
  for (Eigen::Vector3d& v : wall.vertices) v.z() = -2;  // behind every camera
  WriteMesh(folder / "behind.ply", wall);
  RunImport(Importing(folder / "behind.ply"), {folder / "scene", "behind", {}, false}, listener);
  EXPECT_THAT(listener.said, HasSubstr("no view sees"));

  request.scale = -1;
  EXPECT_THROW(RunImport(request, {folder / "scene", "x", {}, false}, SilentProgress()), UsageError);
  EXPECT_THROW(RunImport(Importing(folder / "absent.ply"), {folder / "scene", "x", {}, false}, SilentProgress()),
               InputError);
  WriteTextAtomically(folder / "points.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1\n");
  EXPECT_THROW(RunImport(Importing(folder / "points.obj"), {folder / "scene", "x", {}, false}, SilentProgress()),
               InputError);
  WriteTextAtomically(folder / "nan.obj", "v nan 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n");
  EXPECT_THROW(RunImport(Importing(folder / "nan.obj"), {folder / "scene", "x", {}, false}, SilentProgress()),
               InputError);
  EXPECT_FALSE(fs::exists(ProxyPath(folder / "scene", "x")));
}

TEST(ProxyCommands, ImportTakesBinaryFilesOfBothByteOrdersAndNumbersThatAreNone) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const auto big = [](auto value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    std::reverse(bytes.begin(), bytes.end());
    return bytes;
  };
  std::string ply =
      "ply\nformat binary_big_endian 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n";
  for (const float v :
       {-9.0F, -9.0F, 4.0F, 9.0F, -9.0F, 4.0F, 9.0F, 9.0F, 4.0F, -9.0F, 9.0F, 4.0F, std::nanf(""), 0.0F, 0.0F})
    ply += big(v);
  ply += '\4';
  for (const std::int32_t v : {0, 3, 2, 1}) ply += big(v);
  ply += '\3';
  for (const std::int32_t v : {0, 1, 4}) ply += big(v);
  WriteTextAtomically(folder / "big.ply", ply);
  Listener listener;
  const json in = AsJson(RunImport(Importing(folder / "big.ply"), {folder / "scene", "big", {}, false}, listener));
  EXPECT_EQ(in["faces"], 2);
  EXPECT_EQ(in["coverage"], 1.0);
  EXPECT_EQ(in["repaired"]["not_finite_vertices"], 1);
  EXPECT_THAT(listener.said, HasSubstr("no number"));
}

TEST(ProxyCommands, ImportIsPlacedByPairsAndByIcp) {
  const TemporaryFolder folder;
  Scene room = BoxRoom(150, 31);
  room.image_folder = folder / "scene" / "images";
  UpdateFrameOfReference(room);
  WriteScene(room, folder / "scene");
  Mesh truth;  // the room's walls, fronts inwards
  for (int i = 0; i < 8; ++i) truth.vertices.emplace_back(i & 1 ? 2 : -2, i & 2 ? 1.5 : -1.5, i & 4 ? 2 : -2);
  truth.faces = {{0, 1, 2}, {1, 3, 2}, {4, 6, 5}, {5, 6, 7}, {0, 4, 1}, {1, 4, 5},
                 {2, 3, 6}, {3, 7, 6}, {0, 2, 4}, {2, 6, 4}, {1, 5, 3}, {3, 5, 7}};
  const Similarity3 file_from_scene{
      0.2, Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 3).normalized())), {0.1, 0.05, -0.1}};
  Mesh moved = truth;
  for (Eigen::Vector3d& v : moved.vertices) v = file_from_scene * v;
  WriteMesh(folder / "moved.ply", moved);
  const auto off = [&](const std::string& name) {
    const Mesh mesh = ReadMesh(ProxyPath(folder / "scene", name));
    double worst = 0;
    for (std::size_t i = 0; i < truth.vertices.size(); ++i)
      worst = std::max(worst, (mesh.vertices.at(i) - truth.vertices[i]).norm());
    return worst;
  };
  std::string pairs_text = "{\"pairs\": [";
  for (const std::size_t i : {0U, 3U, 5U, 6U}) {
    const Eigen::Vector3d &a = moved.vertices[i], &b = truth.vertices[i];
    pairs_text +=
        json{{"mesh", {a.x(), a.y(), a.z()}}, {"scene", {b.x(), b.y(), b.z()}}}.dump() + (i == 6 ? "]}" : ",");
  }
  WriteTextAtomically(folder / "pairs.json", pairs_text);
  ImportRequest pairs = Importing(folder / "moved.ply");
  pairs.correspond = folder / "pairs.json";
  const json by_pairs = AsJson(RunImport(pairs, {folder / "scene", "pairs", {}, false}, SilentProgress()));
  EXPECT_NEAR(by_pairs["placement"]["scale"], 5, 1e-9);
  EXPECT_EQ(by_pairs["front_fraction"], 1.0);  // a room's fronts look inwards, where the views are
  EXPECT_EQ(by_pairs["repaired"]["inside_out_parts"], 0);
  EXPECT_LT(off("pairs"), 1e-9);
  pairs.scale = 2;
  EXPECT_THROW(RunImport(pairs, {folder / "scene", "x", {}, false}, SilentProgress()), UsageError);

  ImportRequest icp = Importing(folder / "moved.ply");
  icp.icp = true;
  icp.scale = 5.5;
  const Made<ImportFigures> aligned = RunImport(icp, {folder / "scene", "icp", {}, false}, SilentProgress());
  const json by_icp = AsJson(aligned);
  EXPECT_NEAR(by_icp["placement"]["scale"], 5, 1e-3);
  EXPECT_LT(by_icp["icp"]["rms_of_diagonal"], 1e-3);
  EXPECT_LT(off("icp"), 0.01);
  EXPECT_THAT(Describe(aligned), HasSubstr("aligned"));

  WriteMesh(folder / "wall.ply", WallMesh());
  ImportRequest flat = Importing(folder / "wall.ply");
  flat.icp = true;
  try {
    RunImport(flat, {folder / "scene", "x", {}, false}, SilentProgress());
    FAIL();
  } catch (const DataError& e) {
    EXPECT_THAT(e.hint(), HasSubstr("--correspond"));
  }
}

TEST(ProxyCommands, InfoMeasuresEveryProxyAndWritesNothing) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  EXPECT_TRUE(AsJson(RunInfo(folder / "scene", "", SilentProgress()))["proxies"].empty());
  RunPlane({folder / "scene", "plane", {}, false}, SilentProgress());
  RunDelaunay({folder / "scene", "delaunay", {}, false}, 4, SilentProgress());
  const InfoSummary summary = RunInfo(folder / "scene", "", SilentProgress());
  const json info = AsJson(summary);
  ASSERT_EQ(info["proxies"].size(), 2u);
  const json& mesh = info["proxies"][0];
  EXPECT_EQ(mesh["name"], "delaunay");
  EXPECT_EQ(mesh["coverage_min"], 1.0);
  EXPECT_LT(mesh["blocked_ray_fraction"], 0.02);
  EXPECT_LT(mesh["point_distance_median"], 1e-9);
  EXPECT_EQ(mesh["manifold"], true);
  EXPECT_EQ(mesh["degenerate_faces"], 0);
  EXPECT_GE(mesh["layers_mean"], 1.0);
  EXPECT_GE(mesh["layers_max"], 2);
  const json& plane = info["proxies"][1];
  EXPECT_EQ(plane["active"], true);
  EXPECT_EQ(plane["front_fraction"], 1.0);
  EXPECT_EQ(plane["closed"], false);
  EXPECT_EQ(plane["layers_mean"], 1.0);
  EXPECT_EQ(plane["layers_max"], 1);
  EXPECT_THAT(Describe(summary), HasSubstr("delaunay"));
  EXPECT_THAT(Describe(RunInfo(folder / "scene", "delaunay", SilentProgress())), HasSubstr("depth complexity"));
  EXPECT_THROW(RunInfo(folder / "scene", "none", SilentProgress()), UsageError);
}

const json* Row(const json& table, const std::string& name) {
  for (const json& c : table["candidates"])
    if (c["name"] == name) return &c;
  return nullptr;
}

TEST(ProxyProgram, AutoTakesTheBestOfWhatTheDataAllow) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const std::vector<std::string> argv = {
      "lumi-proxy", "auto", (folder / "scene").string(), "--choose-width", "160", "--holdout", "4", "--json"};
  const ProgramResult first = RunProgram(argv);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const json chosen = json::parse(first.out);
  ASSERT_EQ(chosen["candidates"].size(), 9u);
  for (const char* name : {"plane", "planes", "delaunay"})
    for (const char* key : {"psnr_mean_db", "ssim_mean", "coverage", "ms_per_frame", "faces", "seconds"})
      EXPECT_TRUE((*Row(chosen, name))[key].is_number()) << name << key;
  EXPECT_TRUE(Row(chosen, "box")->contains("refused"));
  EXPECT_THAT((*Row(chosen, "hull"))["refused"].get<std::string>(), HasSubstr("silhouettes"));
  EXPECT_THAT((*Row(chosen, "moving"))["refused"].get<std::string>(), HasSubstr("nothing is masked"));
  EXPECT_GT((*Row(chosen, "delaunay"))["psnr_mean_db"].get<double>(),
            (*Row(chosen, "plane"))["psnr_mean_db"].get<double>() + 1);
  double best = 0;
  for (const json& c : chosen["candidates"])
    if (!c.contains("refused")) best = std::max(best, c["psnr_mean_db"].get<double>());
  EXPECT_EQ((*Row(chosen, chosen["name"]))["psnr_mean_db"].get<double>(), best);
  EXPECT_NE(chosen["name"], "plane");
  EXPECT_EQ(OpenScene(folder / "scene", {}, SilentProgress()).active_proxy, chosen["name"].get<std::string>());
  const ProgramResult second = RunProgram(argv);
  EXPECT_EQ(json::parse(second.out)["reused"], true);
  EXPECT_EQ(json::parse(second.out)["candidates"], chosen["candidates"]);
  // A budget chooses among what was measured, without measuring again.
  std::vector<std::string> hurried = argv;
  hurried.insert(hurried.end(), {"--budget-ms", "0.000001"});
  const json fastest = json::parse(RunProgram(hurried).out);
  EXPECT_EQ(fastest["reused"], true);
  EXPECT_THAT(fastest["reason"].get<std::string>(), HasSubstr("fastest"));
  for (const json& c : chosen["candidates"])
    EXPECT_TRUE(c.contains("refused") || (*Row(chosen, fastest["name"]))["ms_per_frame"] <= c["ms_per_frame"]);
}

// A run ended after the mesh was written and before what is to be said of it was.
TEST(ProxyProgram, AutoMakesAnewWhatWasNotFinished) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const Scene scene = OpenScene(folder / "scene", {}, SilentProgress());
  StoreProxy(scene, "plane", WallMesh(), "", ProxyProvenance(scene, "plane", "plane", {}));
  Provenance begun = *RecordOf(scene, "plane");
  begun.version = "unfinished";
  begun.outputs.clear();
  WriteProvenance(scene.folder, begun);
  const ProgramResult result = RunProgram({"lumi-proxy", "auto", (folder / "scene").string(), "--candidates", "plane",
                                           "--choose-width", "160", "--holdout", "4"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto record = FinishedRecordOf(scene, "plane");
  ASSERT_TRUE(record.has_value());
  EXPECT_TRUE(record->outputs.contains("proxies/plane.json"));
  EXPECT_FALSE(LoadProxy(scene, "plane").vertices == WallMesh().vertices);
}

TEST(ProxyProgram, AutoTakesWhatIsThereAndKeepsToItsList) {
  const TemporaryFolder folder;
  WritePlateScene(folder / "scene");
  const std::string path = (folder / "scene").string();
  RunDelaunay({folder / "scene", "delaunay", {}, false}, 40, SilentProgress());  // somebody's own options
  const std::string bytes = ReadText(ProxyPath(folder / "scene", "delaunay"));
  WriteMesh(folder / "wall.ply", WallMesh());
  ImportRequest request = Importing(folder / "wall.ply");
  request.scale = 2;
  RunImport(request, {folder / "scene", "wall", {}, false}, SilentProgress());
  WriteTextAtomically(ProxyPath(folder / "scene", "plane"), "somebody's own, and no mesh");
  const ProgramResult result = RunProgram({"lumi-proxy", "auto", path, "--choose-width", "160", "--holdout", "4",
                                           "--candidates", "delaunay,wall,plane", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json chosen = json::parse(result.out);
  ASSERT_EQ(chosen["candidates"].size(), 3u);
  EXPECT_TRUE((*Row(chosen, "wall"))["psnr_mean_db"].is_number());
  EXPECT_TRUE(Row(chosen, "plane")->contains("refused"));
  EXPECT_EQ(ReadText(ProxyPath(folder / "scene", "delaunay")), bytes);
  EXPECT_EQ(RunProgram({"lumi-proxy", "auto", path, "--candidates", "delaunay,ball"}).exit_code, 2);
}

TEST(ProxyProgram, AutoTakesThePlaneWherePointsAreTooFew) {
  const TemporaryFolder folder;
  Scene scene = WritePlateScene(folder / "scene");
  scene.points.resize(2);
  WriteScene(scene, folder / "scene");
  const ProgramResult result = RunProgram({"lumi-proxy", "auto", (folder / "scene").string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json chosen = json::parse(result.out);
  EXPECT_EQ(chosen["name"], "plane");
  EXPECT_TRUE(Row(chosen, "delaunay")->contains("refused"));
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
  const json imported = AsJson(RunImport(Importing(proxy), {folder / "scene", "cube", {}, false}, SilentProgress()));
  EXPECT_GT(imported["faces"], 1000);
}

}  // namespace
}  // namespace lumi::test
