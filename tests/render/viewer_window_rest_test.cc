// lumi-view under a virtual display: budgets while the camera moves, the optimum when it rests, photos within memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "render/path/camera_path.h"
#include "scene/image_difference/image_difference.h"
#include "tests/render/viewer_window.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using test::kAgreementDb;
using test::kRefinedDb;
using test::ViewerWindow;
using testing::HasSubstr;

TEST_F(ViewerWindow, ABudgetIsHeldWithSettingsOfItsOwnAndAtRestTheUsersAreDrawn) {
  const fs::path shot = folder_ / "rest.png", refined = folder_ / "refined.png";
  const std::string script = "wait; jump 1; key-add; jump 5; key-add; path-seconds 1; path-save " +
                             (folder_ / "path.json").string() + "; budget 20; wait; play; wait; screenshot " +
                             refined.string() + "; refine off; wait; screenshot " + shot.string();
  const Result r =
      RunViewer({"--no-ui", "--effects", "fov", "--k", "3", "--width", "320", "--height", "240", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_NE(r.json["moving"], "");
  EXPECT_EQ(r.json["settings"]["grid"], "pixel");  // the user's
  RenderRequest request;
  request.view = SamplePath(ReadCameraPath(folder_ / "path.json"), 320, 240).back();
  request.settings = SettingsOf(r.json["settings"]);
  const auto renderer = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(shot), renderer->Render(request)), kAgreementDb);
  // Where a budget is held, rest is refined unless that is switched off.
  request.settings = SettingsOf(r.json["refined"]["settings"]);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(refined), renderer->Render(request)), kRefinedDb);
  EXPECT_GE(r.json["refined"]["pictures"].get<int>(), 1);
}

// A view between photos, and its camera in a path's file.
constexpr const char* kBetween = "jump 3; move 0.08 0.05 0.1; ";

TEST_F(ViewerWindow, AtRestThePictureIsTheOptimumOfEveryPixel) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script =
      "refine off; wait; refine on; " + std::string(kBetween) + "key-add; path-save " + file("path.json") +
      "; wait; screenshot " + file("refined.png") + "; show false-color; wait; screenshot " + file("false.png") +
      "; refine off; wait; screenshot " + file("plain.png") + "; show color; refine on; mesh on; screenshot " +
      file("mesh.png") + "; mesh off; screenshot " + file("again.png");
  const Result r = RunViewer(
      {"--no-ui", "--effects", "fov,visibility", "--k", "2", "--width", "320", "--height", "240", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  const auto& summary = r.json["refined"];
  EXPECT_EQ(summary["on"], true);
  EXPECT_EQ(summary["shown"], true);
  EXPECT_EQ(summary["problem"], "");
  EXPECT_GE(summary["pictures"].get<int>(), 3);
  EXPECT_GT(summary["seconds"].get<double>(), 0);
  EXPECT_EQ(summary["settings"]["similarity"], "full");
  EXPECT_EQ(summary["settings"]["grid"], "pixel");
  EXPECT_EQ(r.json["settings"]["similarity"], "identity");  // the user's

  RenderRequest request;
  request.view = MakeRenderView(ReadCameraPath(file("path.json")).keys.at(0), 320, 240);
  request.settings = SettingsOf(summary["settings"]);
  const auto renderer = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos);
  const ImageF optimum = renderer->Render(request);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("refined.png")), optimum), kRefinedDb);
  EXPECT_EQ(Compare(ReadImage8(file("again.png")), ReadImage8(file("refined.png"))).mse, 0);
  EXPECT_LT(Compare(ReadImage8(file("mesh.png")), ReadImage8(file("refined.png"))).psnr_db, 45);  // overlays stay
  // False colours tell the weights apart.
  request.show = Show::kFalseColor;
  const ImageF weights = renderer->Render(request);
  const double refined = CoveredPsnrDb(ReadImage8(file("false.png")), weights),
               plain = CoveredPsnrDb(ReadImage8(file("plain.png")), weights);
  std::printf("  false colours: refined %.1f dB, unrefined %.1f dB from the optimum\n", refined, plain);
  EXPECT_GE(refined, kRefinedDb);
  EXPECT_LT(plain, kRefinedDb - 10);
}

TEST_F(ViewerWindow, TheOptimumOfEveryPixelIsDrawnFromSamplesUntilItIsRefined) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "set similarity full; " + std::string(kBetween) + "key-add; path-save " +
                             file("path.json") + "; wait; screenshot " + file("refined.png") + "; home; wait 0";
  const Result r = RunViewer(
      {"--no-ui", "--effects", "fov", "--view", "1", "--width", "240", "--height", "180", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["refused"], "");
  EXPECT_EQ(r.json["settings"]["grid"], "pixel");
  // A move takes it away with the very next picture.
  EXPECT_EQ(r.json["refined"]["pictures"], 1);
  EXPECT_EQ(r.json["refined"]["shown"], false);
  RenderRequest request;
  request.view = MakeRenderView(ReadCameraPath(file("path.json")).keys.at(0), 240, 180);
  request.settings = SettingsOf(r.json["refined"]["settings"]);
  const ImageF optimum = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(request);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("refined.png")), optimum), kRefinedDb);
}

TEST_F(ViewerWindow, APublishedMethodIsDrawnAtRestAndByThisRenderersWeightsUntilThen) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = std::string(kBetween) + "key-add; path-save " + file("path.json") + "; screenshot " +
                             file("own.png") + "; set method debevec-1998; wait; screenshot " + file("method.png");
  const Result r =
      RunViewer({"--no-ui", "--effects", "fov,visibility", "--width", "240", "--height", "180", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["refused"], "");
  EXPECT_EQ(r.json["settings"]["method"], "debevec-1998");
  EXPECT_GE(r.json["refined"]["pictures"].get<int>(), 1);
  RenderRequest request;
  request.view = MakeRenderView(ReadCameraPath(file("path.json")).keys.at(0), 240, 180);
  request.settings = SettingsOf(r.json["settings"]);
  const ImageF method = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(request);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("method.png")), method), kRefinedDb);
  EXPECT_LT(CoveredPsnrDb(ReadImage8(file("own.png")), method), kRefinedDb - 5);
}

TEST_F(ViewerWindow, AMoveGivesUpThePictureThatIsBeingRefined) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  std::string script = "wait; ";
  for (const char* pause : {"0.4", "0.7", "1"}) script += std::string("orbit 3 0; wait ") + pause + "; ";
  script += kBetween + std::string("key-add; path-save ") + file("path.json") + "; wait; screenshot " +
            file("last.png") + "; orbit 3 0; wait 0.5";
  // Slow enough to be met in the middle; the window is closed in the middle of one, too.
  const Result r = RunViewer({"--no-ui", "--effects", "fov", "--refine", "on", "--accuracy", "1e-6", "--width", "1000",
                              "--height", "750", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  std::printf("  %d given up, %d whole, the last in %.2f s\n", r.json["refined"]["cancelled"].get<int>(),
              r.json["refined"]["pictures"].get<int>(), r.json["refined"]["seconds"].get<double>());
  // By the time of the moves some are whole, some given up, some not begun.
  EXPECT_GE(r.json["refined"]["pictures"].get<int>(), 1);
  RenderRequest request;
  request.view = MakeRenderView(ReadCameraPath(file("path.json")).keys.at(0), 1000, 750);
  request.settings = SettingsOf(r.json["refined"]["settings"]);
  const ImageF optimum = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(request);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("last.png")), optimum), kRefinedDb);
}

// The photos of a view come when it is looked at, sharp; so do those of a film's frames and of the picture at rest.
TEST_F(ViewerWindow, PhotosThatDoNotFitComeAndGo) {
  // Many copies of the views: 320 photos of 160x120 do not fit into 16 MB.
  std::vector<View> views;
  for (int i = 0; i < 320; ++i) {
    View v = world_.scene.views[static_cast<std::size_t>(i % 7)];
    const std::string name = std::to_string(1000 + i) + ".png";
    fs::create_hard_link(folder_ / "images" / v.name, folder_ / "images" / name);
    v.name = name;
    views.push_back(v);
  }
  world_.scene.views = views;
  WriteScene(world_.scene, folder_);
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "wait; " + std::string(kBetween) + "key-add; path-save " + file("path.json") +
                             "; wait; screenshot " + file("plain.png") + "; refine on; wait; screenshot " +
                             file("refined.png") + "; refine off; jump 1; key-add; jump 5; key-add; measure; record " +
                             file("film.mp4");
  const Result r = RunViewer({"--no-ui", "--memory-mb", "16", "--effects", "fov,visibility", "--k", "2", "--width",
                              "320", "--height", "240", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["on_demand"], true);
  EXPECT_GT(r.json["photos_loaded"], 10);
  EXPECT_LE(r.json["photo_mb"].get<double>(), 16.0 * 1.05);
  const RenderView view = MakeRenderView(ReadCameraPath(file("path.json")).keys.at(0), 320, 240);
  const std::vector<Photo> photos = LoadPhotos(world_.scene, {}, SilentProgress());
  const auto cpu = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), photos);
  RenderRequest request;
  request.view = view;
  request.settings = SettingsOf(r.json["settings"]);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("plain.png")), cpu->Render(request)), kAgreementDb);
  request.settings = SettingsOf(r.json["refined"]["settings"]);
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("refined.png")), cpu->Render(request)), kRefinedDb);
  ASSERT_EQ(r.json["errors"].size(), 1U);
  EXPECT_GT(r.json["errors"][0]["psnr_db"].get<double>(), 15);
  ASSERT_EQ(r.json["videos"].size(), 1U);
  EXPECT_GT(r.json["videos"][0]["frames"].get<int>(), 10);
}

TEST_F(ViewerWindow, TwoMarksAndTheirDistanceGiveTheSceneAScale) {
  // At the centres of pixels, on the floor: where its plane is met is known.
  const Eigen::Vector2d a(96.5, 180.5), b(210.5, 200.5);
  const auto mark = [](const Eigen::Vector2d& x_px) {
    return "mark " + std::to_string(x_px.x() / 320) + " " + std::to_string(x_px.y() / 240) + "; ";
  };
  const std::string script = "proxy floor; jump 3; wait; " + mark(a) + mark(b) + "distance 1.5; wait";
  const Result r = RunViewer({"--no-ui", "--width", "320", "--height", "240", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  const RenderView view = MakeWindowView(StateOfView(world_.scene, {3}), 320, 240);
  const auto on_floor = [&](const Eigen::Vector2d& x_px) -> Eigen::Vector3d {
    const Eigen::Vector3d ray = *RayDirection(view.P, x_px);
    return view.centre - view.centre.z() / ray.z() * ray;
  };
  const double units = (on_floor(a) - on_floor(b)).norm();
  ASSERT_GT(units, 0.1);
  constexpr double kDepthOfAFloat = 1e-4;
  EXPECT_NEAR(r.json["metres_per_unit"].get<double>(), 1.5 / units, kDepthOfAFloat * 1.5 / units);
  OpenOptions as_it_is;
  as_it_is.check_photos = false;
  EXPECT_EQ(OpenScene(folder_, as_it_is, SilentProgress()).metres_per_unit, r.json["metres_per_unit"].get<double>());
  // One mark is no distance.
  const Result refused =
      RunViewer({"--no-ui", "--width", "320", "--height", "240", "--script", "jump 3; wait; distance 2"});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.messages.find("two marks are needed"), std::string::npos) << refused.messages;
}

TEST_F(ViewerWindow, ASceneThatIsDroppedOnTheWindowIsOpened) {
  const fs::path other = folder_ / "other", shot = folder_ / "other.png";
  fs::create_directories(other);
  fs::copy(folder_ / "images", other / "images");
  Scene scene = world_.scene;
  scene.folder = other;
  scene.image_folder = other / "images";
  scene.active_proxy = "floor";
  WriteScene(scene, other);
  WriteMesh(ProxyPath(other, "floor"), LoadProxy(world_.scene, "floor"));
  const Result r = RunViewer({"--no-ui", "--proxy", "true", "--width", "200", "--height", "150", "--script",
                              "wait; drop " + other.string() + "; wait; screenshot " + shot.string()});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["proxy"], "floor");
  EXPECT_TRUE(fs::exists(shot));
  EXPECT_EQ(RunViewer({"--script", "drop " + (folder_ / "images").string()}).exit_code, 2);
}

}  // namespace
}  // namespace lumi
