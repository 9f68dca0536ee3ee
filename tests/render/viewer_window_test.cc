// lumi-view itself, under a virtual display: what it shows is the lumigraph.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "render/path/camera_path.h"
#include "render/path/matrix_path.h"
#include "render/picture/border_fill.h"
#include "render/picture/convert.h"
#include "render/show/measure_map.h"
#include "scene/files/atomic_file.h"
#include "scene/files/video.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/stopwatch.h"
#include "tests/render/projective_capture.h"
#include "tests/render/viewer_window.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using test::kAgreementDb;
using test::ViewerWindow;
using testing::HasSubstr;

constexpr double kVideoDb = 26.0;     // H.264 at quality 18, colour at half the resolution
constexpr double kSameErrorDb = 0.1;  // of one photo's error by the two backends: filtering in float and in 8 bits

TEST_F(ViewerWindow, ShowsThePictureThatTheCpuRenders) {
  const fs::path shot = folder_ / "shot.png";
  const Result r = RunViewer({"--no-ui", "--view", "3", "--width", "320", "--height", "240", "--screenshot", shot});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["photos_loaded"], 7);
  EXPECT_EQ(r.json["photos_failed"], 0);
  EXPECT_EQ(r.json["proxy"], "true");
  EXPECT_GT(r.json["frames"], 0);
  // The effects that it found are in its summary.
  const double psnr = CoveredPsnrDb(
      ReadImage8(shot), CpuPicture(StateOfView(world_.scene, {3}), 320, 240, SettingsOf(r.json["settings"])));
  EXPECT_GE(psnr, kAgreementDb);
  std::printf("  %.1f dB, %s\n", psnr, r.json["device"].get<std::string>().c_str());
}

TEST_F(ViewerWindow, FalseColoursHaveALegend) {
  const std::string shot = (folder_ / "false.png").string();
  const Result r = RunViewer({"--effects", "fov,visibility", "--k", "2", "--width", "640", "--height", "480",
                              "--script", "jump 3; show false-color; wait; screenshot " + shot});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  // At a photo's own camera the photo is all of the picture, as far as it sees.
  ASSERT_GE(r.json["legend"].size(), 1U);
  EXPECT_EQ(r.json["legend"][0]["photo"], world_.scene.views[3].name);
  double covered = 0;
  for (const auto& entry : r.json["legend"]) covered += entry["share"].get<double>();
  EXPECT_GT(r.json["legend"][0]["share"].get<double>(), 0.9 * covered);
  const Result colors = RunViewer(
      {"--no-ui", "--width", "320", "--height", "240", "--script", "jump 3; show false-color; wait; show color; wait"});
  EXPECT_TRUE(colors.json["legend"].empty());
}

TEST_F(ViewerWindow, FillsWhatNoPhotoSeesUnlessSomethingElseIsShown) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  // Far more than the photos see.
  const std::string script = "jump 3; zoom 2.2; wait; screenshot " + file("filled.png") +
                             "; fill off; wait; screenshot " + file("holes.png") +
                             "; show false-color; wait; screenshot " + file("false.png") +
                             "; fill on; wait; screenshot " + file("false-on.png");
  const Result r = RunViewer({"--no-ui", "--effects", "fov", "--width", "320", "--height", "240", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  ViewState state = StateOfView(world_.scene, {3});
  Navigator navigator(state, world_.scene.up, 1);
  navigator.Zoom(2.2);
  const ImageF picture = CpuPicture(navigator.state(), 320, 240, SettingsOf(r.json["settings"]));
  ImageF wanted = picture;
  FillSmoothly(wanted);
  for (std::size_t i = 3; i < wanted.data.size(); i += 4) wanted.data[i] = 1;  // but for rounding it is
  EXPECT_LT(Coverage(picture), 0.9);
  const Image8 filled = ReadImage8(file("filled.png")), holes = ReadImage8(file("holes.png"));
  EXPECT_GE(CoveredPsnrDb(filled, wanted), kAgreementDb);
  EXPECT_LT(CoveredPsnrDb(holes, wanted), kAgreementDb) << "the backdrop";
  for (int y = 0; y < filled.height; ++y)
    for (int x = 0; x < filled.width; ++x) {
      if (picture.At(x, y, 3) < 1) continue;
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(filled.At(x, y, c), holes.At(x, y, c), 1) << x << ' ' << y;
    }
  EXPECT_EQ(ReadImage8(file("false.png")).data, ReadImage8(file("false-on.png")).data);
}

TEST_F(ViewerWindow, PlaysAPathOfMatricesAndStaysOnIt) {
  // The same photos as frames of a scene without a metric.
  test::Capture capture = test::MakeCapture(8, 64);
  capture.scene.points = test::SeenPoints(capture);
  fs::remove_all(folder_);
  Scene scene = test::Projective(capture.scene, test::RandomTransformation(5, 20));
  scene.image_folder = folder_ / "images";
  for (std::size_t j = 0; j < capture.photos.size(); ++j)
    WriteImage(folder_ / "images" / scene.views[j].name, capture.photos[j].levels[0]);
  WriteScene(scene, folder_);
  WriteMatrixPath(folder_ / "path.json", MatrixPathOfPhotos(scene, 20));
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string size = "320";
  const Result r = RunViewer({"--no-ui", "--width", size, "--height", "200", "--path", file("path.json"), "--script",
                              "key-jump 3; screenshot " + file("third.png") + "; show false-color; screenshot " +
                                  file("false.png") + "; show proxy; screenshot " + file("proxy.png") +
                                  "; show angle; screenshot " + file("angle.png") + "; show color; play; screenshot " +
                                  file("last.png") + "; jump view103.png; wait; screenshot " + file("again.png")});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["keys"], 8);
  EXPECT_GE(r.json["played"], 1);
  EXPECT_GT(r.json["seconds_to_open"], 0);
  EXPECT_EQ(r.json["frame"], "projective");
  // In the middle of the window, as large as fits: 267 x 200 of 320 x 200.
  const auto middle = [&](const char* name) {
    const Image8 shot = ReadImage8(file(name));
    EXPECT_EQ(shot.width, 320);
    Image8 cut(267, 200, 3);
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 267; ++x)
        for (int c = 0; c < 3; ++c) cut.At(x, y, c) = shot.At(x + 26, y, c);
    return Resize(cut, 64, 48);
  };
  // Enlarged and made small again.
  EXPECT_GT(Compare(middle("third.png"), capture.photos[3].levels[0]).psnr_db, 22);
  EXPECT_GT(Compare(middle("last.png"), capture.photos[7].levels[0]).psnr_db, 22);
  EXPECT_LT(Compare(middle("last.png"), capture.photos[3].levels[0]).psnr_db, 20);
  EXPECT_GT(Compare(middle("again.png"), middle("third.png")).psnr_db, 45);
  EXPECT_LT(Compare(middle("false.png"), middle("third.png")).psnr_db, 20);
  for (const char* statement : {"orbit 10 0", "key-add"}) {
    const Result refused = RunViewer({"--no-ui", "--width", size, "--height", "200", "--script", statement});
    EXPECT_EQ(refused.exit_code, 2) << statement;
    EXPECT_THAT(refused.messages + refused.json.dump(), HasSubstr("path")) << statement;
  }
}

TEST_F(ViewerWindow, FollowsAScript) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "jump " + world_.scene.views[5].name + "; wait; screenshot " + file("jump.png") +
                             "; show false-color; k 2; screenshot " + file("false.png") +
                             "; show color; k 4; orbit 20 5; screenshot " + file("orbit.png") +
                             "; home; mesh on; frusta on; screenshot " + file("over.png") +
                             "; mesh off; frusta off; proxy floor; wait; screenshot " + file("floor.png") +
                             "; fly-to 0; screenshot " + file("flown.png");
  const Result r = RunViewer({"--no-ui", "--effects", "fov,visibility,prefilter", "--view", "1", "--width", "240",
                              "--height", "180", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  // Opening lasts to the first picture of photos; the frames after it were timed.
  EXPECT_GT(r.json["seconds_to_open"], 0);
  EXPECT_GT(r.json["median_frame_ms"], 0);
  EXPECT_GE(r.json["slowest_frame_ms"], r.json["median_frame_ms"]);
  EXPECT_EQ(r.json["screenshots"].size(), 6U);
  EXPECT_EQ(r.json["proxy"], "floor");
  const ViewState fifth = StateOfView(world_.scene, {5});
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("jump.png")), CpuPicture(fifth, 240, 180)), kAgreementDb);
  RadianceSettings two;
  two.k = 2;
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("false.png")), CpuPicture(fifth, 240, 180, two, Show::kFalseColor)),
            kAgreementDb);
  // The orbit's pivot is what stood in the middle: it still does, and the camera stands elsewhere.
  EXPECT_LT(Compare(ReadImage8(file("orbit.png")), ReadImage8(file("jump.png"))).psnr_db, 25);
  // Overlays and another proxy change the picture of the start.
  const ImageF home = CpuPicture(StateOfView(world_.scene, {1}), 240, 180);
  const double with_overlays = CoveredPsnrDb(ReadImage8(file("over.png")), home);
  EXPECT_LT(with_overlays, 45);
  EXPECT_GT(with_overlays, 15);
  EXPECT_LT(Compare(ReadImage8(file("floor.png")), ReadImage8(file("over.png"))).psnr_db, 40);
  EXPECT_LT(Compare(ReadImage8(file("flown.png")), ReadImage8(file("floor.png"))).psnr_db, 40);
}

TEST_F(ViewerWindow, APathIsMadeSavedAndRecorded) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  std::ofstream(file("clip.mp4")) << "a user's own";
  const std::string script =
      "set visibility off; wait; jump 1; key-add; jump 3; key-add; jump 5; key-add 9; key-time 2 1; key-delete 1; jump "
      "6; key-update 1;"
      "path-size 160 120; path-fps 10; path-seconds 1; path-save " +
      file("path.json") + "; path-save-nerfstudio " + file("studio.json") + "; record " + file("clip.mp4") +
      "; play; screenshot " + file("end.png") + "; keys-clear; path-load " + file("studio.json") +
      "; key-jump 0; screenshot " + file("first.png");
  const Result r = RunViewer({"--no-ui", "--effects", "fov", "--width", "160", "--height", "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  const CameraPath path = ReadCameraPath(file("path.json")),
                   studio = ReadCameraPath(file("studio.json"), PathDetail::kKeyframes);
  ASSERT_EQ(path.keys.size(), 2u);
  ASSERT_EQ(studio.keys.size(), 2u);
  EXPECT_EQ(r.json["keys"], 2);
  // Its keys are the photos that were jumped to: 1, and 6 in the place of 5.
  EXPECT_LT((path.keys[0].cam_from_world.OriginInSource() - world_.scene.views[1].CentreInWorld()).norm(), 1e-9);
  EXPECT_LT((path.keys[1].cam_from_world.OriginInSource() - world_.scene.views[6].CentreInWorld()).norm(), 1e-9);
  EXPECT_LT((studio.keys[1].cam_from_world.OriginInSource() - world_.scene.views[6].CentreInWorld()).norm(), 1e-9);
  EXPECT_NEAR(Duration(path), 1, 1e-9);

  EXPECT_EQ(fs::file_size(file("clip.mp4")), 12U);  // stays
  ASSERT_EQ(r.json["videos"].size(), 1U);
  EXPECT_EQ(r.json["videos"][0]["file"], file("clip_001.mp4"));
  VideoReader video(file("clip_001.mp4"));
  const auto wanted = SamplePath(path, 160, 120);
  RenderRequest request;
  request.settings = SettingsOf(r.json["settings"]);
  const auto renderer = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos);
  std::size_t frames = 0;
  for (auto frame = video.Next(); frame; frame = video.Next()) {
    ASSERT_LT(frames, wanted.size());
    request.view = wanted[frames++];
    EXPECT_GE(CoveredPsnrDb(frame->rgb, renderer->Render(request)), kVideoDb) << "frame " << frames - 1;
  }
  EXPECT_EQ(frames, wanted.size());
  // Playback ends at the last key; a key that is jumped to is the path's first frame again.
  request.view = wanted.back();
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("end.png")), renderer->Render(request)), kAgreementDb);
  request.view = wanted.front();
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("first.png")), renderer->Render(request)), kAgreementDb);
}

TEST_F(ViewerWindow, ARecordingThatIsCancelledLeavesNothingAndOneOfWhatIsSeenLastsAsLong) {
  const fs::path out = folder_ / "out";
  fs::create_directories(out);
  const std::string script = "wait; jump 1; key-add; jump 5; key-add 60; record-start " + (out / "long.mp4").string() +
                             "; wait 0.3; record-cancel; record-live " + (out / "seen.mp4").string() +
                             "; wait 0.5; orbit 10 0; wait 0.5; record-stop; screenshot " +
                             (folder_ / "a.png").string();
  const auto begun = std::chrono::steady_clock::now();
  const Result r = RunViewer({"--width", "160", "--height", "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  const double most_s = SecondsSince(begun);
  std::set<std::string> names;
  for (const auto& e : fs::directory_iterator(out)) names.insert(e.path().filename());
  EXPECT_EQ(names, std::set<std::string>{"seen.mp4"});
  VideoReader video(out / "seen.mp4");
  int frames = 0;
  while (video.Next()) ++frames;
  EXPECT_GE(frames, 30);               // a second, however many pictures the machine drew in it
  EXPECT_LE(frames, 30 * most_s + 1);  // and no more than the viewer ran
}

TEST_F(ViewerWindow, ExportsAWebPageAndSaysWhyNot) {
  const fs::path page = folder_ / "page.html";
  const Result made = RunViewer({"--script", "effects fov,sharpness; export-page " + page.string()});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(made.exit_code, 0) << made.messages;
  const std::string text = ReadText(page);
  EXPECT_NE(text.find("<meta name=\"generator\" content=\"Lumigraph\">"), std::string::npos);
  EXPECT_NE(text.find("part-manifest"), std::string::npos);
  // With the effects that the viewer shows.
  for (const char* effect : {R"("name":"fov","on":true)", R"("name":"sharpness","on":true)",
                             R"("name":"visibility","on":false)", R"("name":"prefilter","on":false)"})
    EXPECT_THAT(text, testing::HasSubstr(effect));
  // Somebody else's stays, and is named.
  WriteTextAtomically(page, "dear");
  const Result refused = RunViewer({"--script", "export-page " + page.string()});
  EXPECT_EQ(refused.exit_code, 2) << refused.messages;
  EXPECT_THAT(refused.messages, testing::HasSubstr("no page of ours"));
  EXPECT_EQ(ReadText(page), "dear");
}

TEST_F(ViewerWindow, TheMeasuredErrorIsThatOfThePhotoRenderedWithoutItself) {
  const std::string script =
      "jump 3; set k 2; wait; measure; set k 6; measure; screenshot " + (folder_ / "a.png").string();
  const Result r = RunViewer({"--effects", "fov,visibility", "--width", "320", "--height", "240", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  ASSERT_EQ(r.json["errors"].size(), 2U);
  for (const auto& e : r.json["errors"]) {
    EXPECT_EQ(e["photo"], world_.scene.views[3].name);
    RenderRequest request;
    request.view = MakeRenderView(world_.scene, world_.scene.views[3]);
    request.settings = SettingsOf(e["settings"]);
    request.use.assign(world_.scene.views.size(), true);
    request.use[3] = false;
    const ImageF image = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(request);
    EXPECT_NEAR(e["psnr_db"].get<double>(), Compare(ToRgb8(image), world_.photos[3].levels[0]).psnr_db, kSameErrorDb);
    EXPECT_NEAR(e["coverage"].get<double>(), Coverage(image), 1e-3);
  }
  EXPECT_EQ(r.json["errors"][0]["settings"]["k"], 2);
  EXPECT_EQ(r.json["errors"][1]["settings"]["k"], 6);
}

TEST_F(ViewerWindow, TheProxyIsShownFlatShadedAndSwitched) {
  const fs::path flat = folder_ / "flat.png", below = folder_ / "below.png";
  Mesh turned;  // the floor with its back to the cameras
  test::AddQuad(turned, {-4, 4, 0}, {4, 4, 0}, {4, -4, 0}, {-4, -4, 0});
  WriteMesh(ProxyPath(folder_, "turned"), turned);
  const Result r = RunViewer(
      {"--width", "320", "--height", "240", "--no-ui", "--script",
       "show proxy; wait; screenshot " + flat.string() + "; proxy turned; wait; screenshot " + below.string()});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  const ImageF covered = CpuPicture(StateOfView(world_.scene, ViewId{3}), 320, 240);
  const auto mean = [](const Image8& image, int channel) {
    double sum = 0;
    for (int y = 60; y < 180; ++y)
      for (int x = 80; x < 240; ++x) sum += image.At(x, y, channel);
    return sum / (120 * 160);
  };
  const Image8 grey = ReadImage8(flat), red = ReadImage8(below);
  ASSERT_EQ(grey.width, 320);
  ASSERT_GT(covered.At(160, 120, 3), 0.99F);
  EXPECT_GT(mean(grey, 0), 60);                             // lit by the lamp
  EXPECT_NEAR(mean(grey, 0) / mean(grey, 2), 0.955, 0.02);  // 0.86 : 0.90
  EXPECT_GT(mean(red, 0), 1.8 * mean(red, 2)) << "backs are red";
}

TEST_F(ViewerWindow, HeatMapsAreThoseOfTheRenderer) {
  const fs::path shot = folder_ / "angle.png";
  const Result r = RunViewer({"--effects", "fov", "--width", "320", "--height", "240", "--no-ui", "--script",
                              "jump 3; show angle; wait; screenshot " + shot.string()});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  RenderRequest request;
  request.view = MakeWindowView(StateOfView(world_.scene, ViewId{3}), 160, 120);
  request.settings = SettingsOf(r.json["settings"]);
  const ImageF wanted = RenderMeasureMap(world_.scene, world_.proxy, request, *MeasureFromName("angle"), -1).image;
  const Image8 image = ReadImage8(shot);
  double worst = 0;
  for (int y = 2; y < 118; ++y)
    for (int x = 2; x < 158; ++x) {
      // A pixel of the map is four of the window, with its neighbours blended in: only where it is flat the two are the
      // same.
      bool flat = wanted.At(x, y, 3) == 1;
      for (int c = 0; c < 3; ++c)
        for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {-1, -1}, {1, -1}, {-1, 1}})
          flat = flat && std::abs(wanted.At(x + dx, y + dy, c) - wanted.At(x, y, c)) < 0.02F;
      for (int c = 0; flat && c < 3; ++c)
        worst = std::max(worst, std::abs(image.At(2 * x, 2 * y, c) - 255.0 * static_cast<double>(wanted.At(x, y, c))));
    }
  EXPECT_LT(worst, 255 * 0.02 + 1);
}

TEST_F(ViewerWindow, WhatCannotBeDrawnIsSaidAndTheLastPictureStays) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "jump 3; wait; screenshot " + file("before.png") +
                             "; set resolution-range 0,0.5; screenshot " + file("after.png");
  const Result r = RunViewer({"--no-ui", "--effects", "fov", "--width", "160", "--height", "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_THAT(r.json["refused"].get<std::string>(), HasSubstr("resolution-range"));
  EXPECT_EQ(Compare(ReadImage8(file("before.png")), ReadImage8(file("after.png"))).mse, 0);
}

TEST_F(ViewerWindow, WhatTheBackendDoesNotDoIsSaidAndTheCameraStillMoves) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "jump 3; set k 3; wait; screenshot " + file("before.png") +
                             "; set similarity full; screenshot " + file("refused.png") + "; jump 5; screenshot " +
                             file("moved.png");
  const Result r = RunViewer({"--no-ui", "--effects", "fov,visibility", "--refine", "off", "--width", "160", "--height",
                              "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_THAT(r.json["refused"].get<std::string>(), HasSubstr("optimum"));
  EXPECT_EQ(Compare(ReadImage8(file("before.png")), ReadImage8(file("refused.png"))).mse, 0);
  RadianceSettings last;
  last.k = 3;
  last.prefilter = false;
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("moved.png")), CpuPicture(StateOfView(world_.scene, {5}), 160, 120, last)),
            kAgreementDb);
}

TEST_F(ViewerWindow, SparseSamplesAreDrawnAndTheOptimumFromThem) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "jump 3; orbit 4 1; set grid 16x12; set sampling interpolated; wait; screenshot " +
                             file("samples.png") + "; show tessellation; screenshot " + file("triangles.png") +
                             "; show color; set similarity full; wait; screenshot " + file("optimum.png");
  const Result r = RunViewer(
      {"--no-ui", "--effects", "fov", "--refine", "off", "--width", "160", "--height", "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["refused"], "");
  EXPECT_EQ(r.json["settings"]["similarity"], "full");
  EXPECT_EQ(r.json["settings"]["correlation"], "falling-leaves");  // followed
  const Image8 samples = ReadImage8(file("samples.png"));
  EXPECT_LT(Compare(samples, ReadImage8(file("triangles.png"))).psnr_db, 30);  // lines are over it
  const double optimum = Compare(samples, ReadImage8(file("optimum.png"))).psnr_db;
  EXPECT_GT(optimum, 20);  // the same scene ...
  EXPECT_LT(optimum, 70);  // ... by other weights
}

TEST_F(ViewerWindow, TimeMovesThePhotosOfItsWindowToTheFront) {
  for (std::size_t i = 0; i < world_.scene.views.size(); ++i)
    world_.scene.views[i].time_s = 0.5 * static_cast<double>(i);
  WriteScene(world_.scene, folder_);
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "jump 3; show false-color; set time on; set time-window-s 0.8; time 0; wait; screenshot " +
                             file("early.png") + "; time 3; wait; screenshot " + file("late.png") +
                             "; play-time on; wait 0.4; play-time off";
  const Result r = RunViewer({"--no-ui", "--effects", "fov", "--width", "160", "--height", "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  RadianceSettings settings = SettingsOf(r.json["settings"]);
  const ViewState third = StateOfView(world_.scene, {3});
  settings.time_s = 0;
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("early.png")), CpuPicture(third, 160, 120, settings, Show::kFalseColor)),
            kAgreementDb);
  settings.time_s = 3;
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("late.png")), CpuPicture(third, 160, 120, settings, Show::kFalseColor)),
            kAgreementDb);
  EXPECT_LT(Compare(ReadImage8(file("early.png")), ReadImage8(file("late.png"))).psnr_db, 25);
  // It goes round: from the last photo's time on to the first's.
  EXPECT_NE(r.json["settings"]["time-s"].get<double>(), 3.0);
  EXPECT_LE(r.json["settings"]["time-s"].get<double>(), 3.0);
  EXPECT_GE(r.json["settings"]["time-s"].get<double>(), 0.0);
}

TEST_F(ViewerWindow, APeriodicScenePlaysWhileTheViewpointMoves) {
  for (std::size_t i = 0; i < world_.scene.views.size(); ++i)
    world_.scene.views[i].time_s = 100 + 0.3 * static_cast<double>(i);
  world_.scene.period_s = 0.7;
  WriteScene(world_.scene, folder_);
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script =
      "jump 3; show false-color; wait; screenshot " + file("before.png") +
      "; play-time on; orbit 3 0; wait 0.3; orbit 3 0; wait 0.3; play-time off; wait; screenshot " + file("after.png");
  const Result r = RunViewer(
      {"--no-ui", "--effects", "fov,time", "--phase", "0.5", "--width", "160", "--height", "120", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_NE(r.json["settings"]["time-s"].get<double>(), 0.35) << "it went on from the phase that was asked for";
  EXPECT_LT(Compare(ReadImage8(file("before.png")), ReadImage8(file("after.png"))).psnr_db, 35);
  EXPECT_EQ(r.json["refused"], "");
}

TEST_F(ViewerWindow, WithoutADisplayItSaysSo) {
  const Result r = RunViewer({}, false);
  EXPECT_EQ(r.exit_code, 4);
  EXPECT_THAT(r.messages, HasSubstr("xvfb-run"));
  EXPECT_EQ(r.json["error"]["code"], 4);
}

TEST_F(ViewerWindow, RefusesWhatItCannotShow) {
  EXPECT_EQ(RunViewer({"--script", "dance"}).exit_code, 2);
  EXPECT_EQ(RunViewer({"--screenshot", "shot.txt"}).exit_code, 2);
  for (const std::vector<std::string>& settings : {std::vector<std::string>{"--alpha", "-1"},
                                                   {"--r-min-deg", "10"},
                                                   {"--similarity", "full", "--correlation", "inverse"}}) {
    const Result refused = RunViewer(settings);
    EXPECT_EQ(refused.exit_code, 2) << refused.messages;
    EXPECT_THAT(refused.messages, HasSubstr("--"));
  }
  Result r = RunViewer({"--view", "nobody.jpg", "--screenshot", folder_ / "a.png"});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  EXPECT_EQ(r.exit_code, 2) << r.messages;
  EXPECT_THAT(r.messages, HasSubstr("nobody.jpg"));
  r = RunViewer({"--proxy", "none", "--screenshot", folder_ / "a.png"});
  EXPECT_EQ(r.exit_code, 2) << r.messages;
  EXPECT_THAT(r.messages, HasSubstr("floor"));  // names those that exist
  std::ofstream(ProxyPath(folder_, "broken")) << "ply\nformat ascii 1.0\nelement vertex 99999999\nend_header\n";
  EXPECT_EQ(RunViewer({"--proxy", "broken", "--screenshot", folder_ / "a.png"}).exit_code, 3);
  EXPECT_FALSE(fs::exists(folder_ / "a.png"));
}

}  // namespace
}  // namespace lumi
