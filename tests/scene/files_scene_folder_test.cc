#include "scene/files/scene_folder.h"

#include <nlohmann/json.hpp>
#include <set>

#include "files_test_util.h"
#include "scene/files/colmap_model.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/mesh_io.h"
#include "scene/model/orientation.h"

namespace lumi::test {
namespace {

constexpr double kReadBack = 1e-15;

// A scene with photos in folder/images.
Scene SceneWithPhotos(const fs::path& folder, int points = 20, CameraModel second = CameraModel::kPinhole) {
  Scene scene = SmallScene(points, second);
  scene.folder = folder;
  scene.image_folder = folder / "images";
  for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(64, 48));
  return scene;
}

Scene Open(const fs::path& path, OpenOptions options = {}) { return OpenScene(path, options, SilentProgress()); }

TEST(SceneFolder, IsCalledByItsNameHoweverItIsGiven) {
  for (const char* given :
       {"captures/desk", "captures/desk/", "captures/desk/.", "desk", "./desk/", "captures/x/../desk"})
    EXPECT_EQ(NameOfFolder(given), "desk") << given;
  EXPECT_EQ(NameOfFolder("."), std::filesystem::current_path().filename().string());
}

TEST(SceneFolder, AWrittenSceneOpensAsItWas) {
  const TempFolder folder;
  Scene scene = SceneWithPhotos(folder.path());
  scene.views[1].time_s = 0.125;
  scene.views[1].frame_index = 7;
  scene.views[2].gain = 1.25;
  scene.views[3].orientation = 6;
  scene.period_s = 2.5;
  scene.active_proxy = "auto";
  scene.up = Eigen::Vector3d(0.6, 0, 0.8);
  scene.normalized_from_world = {0.25, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {1, 2, 3}};
  WriteScene(scene, folder.path());
  const Scene back = Open(folder.path());
  ExpectSame(back, scene, kReadBack);
  EXPECT_EQ(back.views[1].time_s, 0.125);
  EXPECT_EQ(back.views[1].frame_index, 7);
  EXPECT_FALSE(back.views[0].time_s);
  EXPECT_EQ(back.views[2].gain, 1.25);
  EXPECT_EQ(back.views[2].orientation, 1);
  EXPECT_EQ(back.views[3].orientation, 6);
  EXPECT_EQ(back.period_s, 2.5);
  EXPECT_EQ(back.active_proxy, "auto");
  EXPECT_LT((back.up - scene.up).norm(), kReadBack);
  EXPECT_EQ(back.normalized_from_world.scale, 0.25);
  EXPECT_LT((back.normalized_from_world.rotation.coeffs() - scene.normalized_from_world.rotation.coeffs()).norm(),
            kReadBack);
  EXPECT_EQ(back.normalized_from_world.translation, scene.normalized_from_world.translation);
  EXPECT_TRUE(fs::exists(back.ImagePath(back.views[1])));
  ExpectSame(Open(folder / "lumigraph.json"), scene, kReadBack);
}

TEST(SceneFolder, AMovedSceneStillFindsItsPhotos) {
  const TempFolder folder;
  Scene inside = SceneWithPhotos(folder / "a");
  WriteScene(inside, folder / "a");
  fs::rename(folder.path(), folder.path().string() + "-moved");
  const fs::path moved = folder.path().string() + "-moved";
  EXPECT_EQ(Open(moved / "a").views.size(), 4u);
  fs::rename(moved, folder.path());
}

TEST(SceneFolder, PhotosLieInTheScenesFolderOrWhereALinkInItLeads) {
  const TempFolder folder;
  Scene beside = SceneWithPhotos(folder / "photos-of-mine");
  EXPECT_REFUSED(ExitCode::kUsage, "outside of the scene's folder", WriteScene(beside, folder / "scenes/b"));
  fs::create_directories(folder / "a");
  fs::create_directory_symlink(beside.image_folder, folder / "a/images");
  beside.image_folder = folder / "a/images";
  WriteScene(beside, folder / "a");
  EXPECT_EQ(Open(folder / "a").views.size(), 4u);
  const std::string manifest = Read(folder / "a/lumigraph.json");
  for (const std::string elsewhere : {"../photos-of-mine", "images/../../photos-of-mine", "/etc", ""}) {
    auto json = nlohmann::json::parse(manifest);
    json["images"] = elsewhere;
    Write(folder / "a/lumigraph.json", json.dump());
    EXPECT_REFUSED(ExitCode::kCorruptInput, "leads out of the scene's folder", Open(folder / "a"));
  }
}

TEST(SceneFolder, ANewerManifestIsRefusedByItsVersion) {
  const TempFolder folder;
  WriteScene(SceneWithPhotos(folder.path()), folder.path());
  auto json = nlohmann::json::parse(Read(folder / "lumigraph.json"));
  json["version"] = kSceneFormatVersion + 1;
  Write(folder / "lumigraph.json", json.dump());
  EXPECT_REFUSED(ExitCode::kCorruptInput, "this program reads up to " + std::to_string(kSceneFormatVersion),
                 Open(folder.path()));
}

TEST(SceneFolder, KeysOfLaterVersionsAreIgnoredAndBrokenOnesRefusedByName) {
  const TempFolder folder;
  WriteScene(SceneWithPhotos(folder.path()), folder.path());
  const auto whole = nlohmann::json::parse(Read(folder / "lumigraph.json"));
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    auto json = whole;
    json[nlohmann::json::json_pointer(pointer)] = value;
    Write(folder / "lumigraph.json", json.dump());
  };
  with("/future", {{"a", {1, 2}}});
  EXPECT_EQ(Open(folder.path()).views.size(), 4u);
  const auto refused = [&](const char* pointer, const nlohmann::json& value, const char* reason) {
    with(pointer, value);
    EXPECT_REFUSED(ExitCode::kCorruptInput, reason, Open(folder.path()));
  };
  refused("/format", "other", "format");
  refused("/version", "1", "version is not a whole number");
  refused("/version", 0, "version");
  refused("/frame", "curved", "curved");
  refused("/up", {1, 2}, "up is not an array");
  refused("/up", {0, 0, 0}, "up is not a direction");
  refused("/normalisation/scale", -1, "normalisation.scale");
  refused("/normalisation/rotation_xyzw", {0, 0, 0, 0}, "rotation_xyzw");
  refused("/period_s", "long", "period_s is not a number");
  refused("/active_proxy", "../../etc", "active_proxy");
  refused("/views", 3, "views is not an array");
  refused("/views/1/gain", 0, "views[1].gain is not positive");
  refused("/views/1/orientation", 9, "views[1].orientation is not 1 to 8");
  refused("/views/1/frame_index", 1.5, "views[1].frame_index");
  refused("/views/1/name", nullptr, "views[1].name");
  refused("/views/1/name", whole["views"][0]["name"], "comes twice");
  Write(folder / "lumigraph.json", "{\n  \"format\": \"lumigraph\",\n  oops\n}");
  EXPECT_REFUSED(ExitCode::kCorruptInput, "line 3", Open(folder.path()));
  Write(folder / "lumigraph.json", "");
  EXPECT_REFUSED(ExitCode::kCorruptInput, "lumigraph.json", Open(folder.path()));
}

TEST(SceneFolder, WorkspacesOpenInEveryLayoutWithoutBeingWrittenTo) {
  struct Layout {
    const char* model;
    const char* photos;
    const char* open;
  };
  for (const Layout& layout : {Layout{"sparse", "images", ""}, Layout{"sparse/0", "images", ""},
                               Layout{"sparse/0", "images", "sparse/0"}, Layout{"sparse", "images", "sparse"},
                               Layout{"sparse", ".", ""}, Layout{".", ".", ""}, Layout{".", "images", ""}}) {
    SCOPED_TRACE(std::string(layout.model) + " " + layout.photos + " " + layout.open);
    const TempFolder folder;
    Scene scene = SmallScene(20);
    scene.image_folder = folder / layout.photos;
    for (const View& v : scene.views) WriteImage(scene.ImagePath(v), ColorfulImage(64, 48));
    WriteColmapModel(scene, folder / layout.model);
    std::set<fs::path> before, after;
    for (const auto& e : fs::recursive_directory_iterator(folder.path())) before.insert(e.path());
    const Scene opened = Open(folder / layout.open);
    for (const auto& e : fs::recursive_directory_iterator(folder.path())) after.insert(e.path());
    ExpectSame(opened, scene, kReadBack);
    EXPECT_EQ(before, after);
    constexpr double kUpAngle = 0.2;  // the photos' own up is -y, give or take the tilt of the views
    EXPECT_LT((opened.up + Eigen::Vector3d::UnitY()).norm(), kUpAngle);
    EXPECT_GT(opened.normalized_from_world.scale, 0);
  }
}

// Photos as a phone stores them, held upright: the workspace's cameras are those of the stored pixels, its up is
// theirs.
TEST(SceneFolder, AWorkspacesUpIsThatOfItsPhotosAsTheyAreHeld) {
  const TempFolder folder;
  Scene scene = SmallScene(20);
  scene.image_folder = folder / "images";
  const Eigen::Vector3d up = scene.up;
  for (View& v : scene.views) {
    v.cam_from_world = StoredPose(v.cam_from_world, 6);
    WriteImage(scene.ImagePath(v), ColorfulImage(64, 48), 92, 6);
  }
  WriteColmapModel(scene, folder / "sparse");
  const Scene opened = Open(folder.path());
  EXPECT_LT((opened.up - up).norm(), 1e-6);
  for (const View& v : opened.views) EXPECT_EQ(v.orientation, 6) << v.name;
}

TEST(SceneFolder, AWorkspaceMadeOfLinksOpens) {
  const TempFolder folder;
  const Scene scene = SceneWithPhotos(folder / "photos");
  WriteColmapModel(scene, folder / "models/7");
  fs::create_directories(folder / "work");
  fs::create_directory_symlink(folder / "photos/images", folder / "work/images");
  fs::create_directory_symlink(folder / "models/7", folder / "work/sparse");
  EXPECT_EQ(Open(folder / "work").views.size(), 4u);
  EXPECT_EQ(Open((folder / "work").string() + "/").views.size(), 4u);
}

TEST(SceneFolder, AbsentPhotosAndPlacesWithoutAnySceneAreNamed) {
  const TempFolder folder;
  EXPECT_REFUSED(ExitCode::kUsage, "nowhere", Open(folder / "nowhere"));
  EXPECT_REFUSED(ExitCode::kUsage, "transforms.json", Open(folder.path()));
  Write(folder / "letter.txt", "Dear");
  EXPECT_REFUSED(ExitCode::kUsage, "letter.txt", Open(folder / "letter.txt"));
  WriteColmapModel(SmallScene(5), folder / "sparse");
  EXPECT_REFUSED(ExitCode::kCorruptInput, "a one.jpg", Open(folder.path()));
  const Scene scene = SceneWithPhotos(folder.path(), 5);
  EXPECT_EQ(Open(folder.path()).views.size(), 4u);
  fs::remove(scene.ImagePath(scene.views[2]));
  EXPECT_REFUSED(ExitCode::kCorruptInput, "c.jpg", Open(folder.path()));
  OpenOptions unchecked;
  unchecked.check_photos = false;
  EXPECT_EQ(Open(folder.path(), unchecked).views.size(), 4u);
}

TEST(SceneFolder, ACameraThatDoesNotFitItsPhotosIsRefusedAndScaledOnRequest) {
  const TempFolder folder;
  const Scene scene = SceneWithPhotos(folder.path());
  WriteColmapModel(scene, folder / "sparse");
  WriteImage(scene.ImagePath(scene.views[2]), ColorfulImage(32, 24));
  const auto caught = Catch([&] { Open(folder.path()); });
  EXPECT_EQ(caught.code, ExitCode::kCorruptInput);
  for (const char* part : {"c.jpg", "32 x 24", "64 x 48", "--rescale-cameras"})
    EXPECT_NE(caught.text.find(part), std::string::npos) << caught.text;

  OpenOptions options;
  options.rescale_cameras = true;
  const Scene scaled = Open(folder.path(), options);
  EXPECT_EQ(scaled.cameras.size(), 3u);
  EXPECT_EQ(scaled.CameraOf(scaled.views[2]).width_px, 32);
  EXPECT_EQ(scaled.CameraOf(scaled.views[0]).width_px, 64);
  // The points are seen where the scaled cameras project them.
  constexpr double kPixels = 1e-9;
  for (const Point& p : scaled.points)
    for (const Observation& o : p.track) {
      const View& view = scaled.views[static_cast<std::size_t>(o.view.value)];
      EXPECT_LT((*scaled.CameraOf(view).Project(view.cam_from_world * p.x_in_world) - o.x_px).norm(), kPixels)
          << view.name;
    }
}

TEST(SceneFolder, APhotoTurnedAgainstItsCameraIsRefusedEvenIfCamerasMayBeScaled) {
  const TempFolder folder;
  const Scene scene = SceneWithPhotos(folder.path());
  WriteColmapModel(scene, folder / "sparse");
  WriteImage(scene.ImagePath(scene.views[1]), ColorfulImage(48, 64));
  OpenOptions options;
  options.rescale_cameras = true;
  EXPECT_REFUSED(ExitCode::kCorruptInput, "turned by 90 degrees", Open(folder.path(), options));
}

TEST(SceneFolder, TheCubeIsRefusedWithItsSizesAndOpensRescaled) {
  const fs::path cube = SharedData("cube");
  if (!fs::exists(cube)) GTEST_SKIP() << "no " << cube;
  const auto caught = Catch([&] { Open(cube); });
  EXPECT_EQ(caught.code, ExitCode::kCorruptInput);
  for (const char* part : {"1000 x 7", "1280 x 960", "--rescale-cameras", ".jpg"})
    EXPECT_NE(caught.text.find(part), std::string::npos) << caught.text;
  const TempFolder cache;
  OpenOptions options;
  options.rescale_cameras = true;
  options.cache_folder = cache.path();
  const Scene scene = Open(cube, options);
  EXPECT_EQ(scene.views.size(), 13u);
  for (const View& v : scene.views) {
    EXPECT_TRUE(scene.CameraOf(v).IsPinhole());
    EXPECT_EQ(ReadImageInfo(scene.ImagePath(v)).width, 1000);
    EXPECT_EQ(ReadImageInfo(scene.ImagePath(v)).height, scene.CameraOf(v).height_px);
  }
  EXPECT_EQ(LoadProxy(
                [&] {
                  Scene with = scene;
                  with.folder = cache.path();
                  WriteMesh(ProxyPath(cache.path(), "given"), ReadMesh(cube / "proxy.obj"));
                  return with;
                }(),
                "given")
                .faces.size(),
            ReadMesh(cube / "proxy.obj").faces.size());
}

TEST(SceneFolder, TheFoxOpensFromItsTransforms) {
  const fs::path fox = SharedData("fox");
  if (!fs::exists(fox)) GTEST_SKIP() << "no " << fox;
  OpenOptions options;
  options.undistort = false;
  const Scene scene = Open(fox, options);
  EXPECT_EQ(scene.views.size(), 50u);
  EXPECT_GT(scene.up.z(), 0.7);
}

TEST(EvaluationProxy, IsKnownByItsName) {
  for (const char* name :
       {"mesh-without-8", "mesh-without-2", "a-without-3-without-12", "hull-500-without-each-4-of-5"})
    EXPECT_TRUE(IsForEvaluation(name)) << name;
  for (const char* name : {"mesh", "without-8", "-without-8", "mesh-without-", "mesh-without-1", "mesh-without-0",
                           "mesh-without-08", "mesh-without-floor", "mesh-without-8b", "mesh-without-each-5-of-5",
                           "mesh-without-each-1-of-4", "mesh-without-each", ""})
    EXPECT_FALSE(IsForEvaluation(name)) << name;
  EXPECT_EQ(ProxyWithout("mesh", 8), "mesh-without-8");
  EXPECT_EQ(ProxyWithoutEach("mesh", 3), "mesh-without-each-3-of-5");
}

TEST(SceneFolder, ProxiesAreFoundByNameOrAreTheActiveOne) {
  const TempFolder folder;
  Scene scene = SmallScene(0);
  scene.folder = folder.path();
  EXPECT_REFUSED(ExitCode::kUsage, "lumi-proxy", LoadProxy(scene, "plane"));
  Mesh one, two;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.faces = {{0, 1, 2}};
  two = one;
  Append(two, one);
  WriteMesh(ProxyPath(folder.path(), "plane"), one);
  WriteMesh(ProxyPath(folder.path(), "auto"), two);
  EXPECT_EQ(ListProxies(folder.path()), (std::vector<std::string>{"auto", "plane"}));
  EXPECT_EQ(LoadProxy(scene, "auto").faces.size(), 2u);
  // Those of an evaluation are nobody's choice, and can be looked at by name.
  for (const char* name : {"plane-without-8", "auto-without-each-0-of-5"})
    WriteMesh(ProxyPath(folder.path(), name), one);
  EXPECT_EQ(ListProxies(folder.path()), (std::vector<std::string>{"auto", "plane"}));
  EXPECT_EQ(LoadProxy(scene, "plane-without-8").faces.size(), 1u);
  EXPECT_REFUSED(ExitCode::kUsage, "there are: auto, plane", LoadProxy(scene, "plane-without-4"));
  EXPECT_REFUSED(ExitCode::kUsage, "auto, plane", LoadProxy(scene, "hull"));
  EXPECT_REFUSED(ExitCode::kUsage, "no active proxy", LoadProxy(scene, ""));
  scene.active_proxy = "plane";
  EXPECT_EQ(LoadProxy(scene, "").faces.size(), 1u);
  EXPECT_REFUSED(ExitCode::kUsage, "../auto", LoadProxy(scene, "../auto"));
}

TEST(SceneFolder, AFullDiskLeavesTheOldSceneWhole) {
  const TempFolder folder;
  WriteScene(SceneWithPhotos(folder.path(), 20), folder.path());
  {
    const FileSizeLimit limit(50);
    EXPECT_REFUSED(ExitCode::kMachine, folder.path().string(), WriteScene(SmallScene(500), folder.path()));
  }
  EXPECT_EQ(Open(folder.path()).points.size(), 20u);
}

}  // namespace
}  // namespace lumi::test
