// lumi-view itself, under a virtual display: what it shows is the lumigraph.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "render/renderer.h"
#include "render/viewer/navigation.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/subprocess.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kAgreementDb = 30.0;  // 8 bits, and the panel's font nowhere

class ViewerWindow : public testing::Test {
 protected:
  void SetUp() override {
    if (!FindProgram("xvfb-run")) GTEST_SKIP() << "xvfb-run is not installed";
    folder_ = fs::temp_directory_path() / ("lumi_viewer_test_" + std::to_string(::getpid()));
    fs::create_directories(folder_ / "images");
    world_ = test::MakeWorld(7, 160);
    test::Photograph(world_);
    for (std::size_t j = 0; j < world_.photos.size(); ++j)
      WriteImage(folder_ / "images" / world_.scene.views[j].name, world_.photos[j].levels[0]);
    world_.scene.folder = folder_;
    world_.scene.image_folder = folder_ / "images";
    world_.scene.active_proxy = "true";
    WriteScene(world_.scene, folder_);
    WriteMesh(ProxyPath(folder_, "true"), world_.proxy);
    Mesh floor;
    test::AddQuad(floor, {-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
    WriteMesh(ProxyPath(folder_, "floor"), floor);
  }
  void TearDown() override {
    if (!folder_.empty()) fs::remove_all(folder_);
  }

  struct Result {
    int exit_code = 0;
    nlohmann::json json;
    std::string messages;
  };
  Result RunViewer(std::vector<std::string> arguments, bool display = true) {
    std::vector<std::string> argv;
    // xvfb-run's own status is not the viewer's when its clean-up meets a race: the shell writes it down.
    const fs::path status = folder_ / "status";
    if (display) argv = {"xvfb-run", "-a", "sh", "-c", R"("$@"; echo $? > "$0")", status};
    argv.insert(argv.end(), {fs::path(LUMI_BIN_DIR) / "lumi-view", folder_, "--json"});
    argv.insert(argv.end(), arguments.begin(), arguments.end());
    SubprocessOptions options;
    options.separate_stdout = true;
    Result r;
    options.on_line = [&](const std::string& line) { r.messages += line + "\n"; };
    if (!display) options.environment = {{"DISPLAY", ""}, {"WAYLAND_DISPLAY", ""}};
    const SubprocessResult run = RunSubprocess(argv, options);
    r.exit_code = run.exit_code;
    if (display) std::ifstream(status) >> r.exit_code;
    r.json = nlohmann::json::parse(run.out, nullptr, false);
    EXPECT_FALSE(r.json.is_discarded()) << run.out << r.messages;
    if (r.exit_code == 4 && display) skip_ = r.messages;
    return r;
  }

  ImageF CpuPicture(const ViewState& state, int width, int height, RadianceSettings settings = {}, Show show = Show::kColor) {
    RenderRequest request;
    request.view = MakeWindowView(state, width, height);
    request.settings = settings;
    request.show = show;
    return MakeCpuRenderer(world_.scene, world_.proxy, world_.photos)->Render(request);
  }

  // Over the pixels that the lumigraph covers; the rest is the viewer's backdrop.
  static double CoveredPsnrDb(const Image8& shot, const ImageF& wanted) {
    EXPECT_EQ(shot.width, wanted.width);
    EXPECT_EQ(shot.height, wanted.height);
    double sum = 0;
    long n = 0;
    for (int y = 0; y < shot.height; ++y)
      for (int x = 0; x < shot.width; ++x) {
        if (wanted.At(x, y, 3) < 1) continue;
        for (int c = 0; c < 3; ++c) {
          const double d = shot.At(x, y, c) - 255.0 * static_cast<double>(wanted.At(x, y, c));
          sum += d * d;
          ++n;
        }
      }
    EXPECT_GT(n, static_cast<long>(shot.width) * shot.height / 2);
    return 10 * std::log10(255.0 * 255.0 / std::max(sum / static_cast<double>(std::max(n, 1L)), 1e-9));
  }

  fs::path folder_;
  test::World world_;
  std::string skip_;
};

TEST_F(ViewerWindow, ShowsThePictureThatTheCpuRenders) {
  const fs::path shot = folder_ / "shot.png";
  const Result r = RunViewer({"--no-ui", "--view", "3", "--width", "320", "--height", "240", "--screenshot", shot});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["photos_loaded"], 7);
  EXPECT_EQ(r.json["photos_failed"], 0);
  EXPECT_EQ(r.json["proxy"], "true");
  EXPECT_GT(r.json["frames"], 0);
  const double psnr = CoveredPsnrDb(ReadImage8(shot), CpuPicture(StateOfView(world_.scene, {3}), 320, 240));
  EXPECT_GE(psnr, kAgreementDb);
  std::printf("  %.1f dB, %s\n", psnr, r.json["device"].get<std::string>().c_str());
}

TEST_F(ViewerWindow, FollowsAScript) {
  const auto file = [&](const char* name) { return (folder_ / name).string(); };
  const std::string script = "jump " + world_.scene.views[5].name + "; wait; screenshot " + file("jump.png") +
                             "; show false-color; k 2; screenshot " + file("false.png") +
                             "; show color; k 4; orbit 20 5; screenshot " + file("orbit.png") + "; home; mesh on; frusta on; screenshot " +
                             file("over.png") + "; mesh off; frusta off; proxy floor; wait; screenshot " + file("floor.png") +
                             "; fly-to 0; screenshot " + file("flown.png");
  const Result r = RunViewer({"--no-ui", "--view", "1", "--width", "240", "--height", "180", "--script", script});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["screenshots"].size(), 6U);
  EXPECT_EQ(r.json["proxy"], "floor");
  const ViewState fifth = StateOfView(world_.scene, {5});
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("jump.png")), CpuPicture(fifth, 240, 180)), kAgreementDb);
  RadianceSettings two;
  two.k = 2;
  EXPECT_GE(CoveredPsnrDb(ReadImage8(file("false.png")), CpuPicture(fifth, 240, 180, two, Show::kFalseColor)), kAgreementDb);
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

TEST_F(ViewerWindow, PhotosAreHalvedToStayWithinMemory) {
  const fs::path shot = folder_ / "small.png";
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
  const Result r = RunViewer({"--memory-mb", "16", "--width", "200", "--height", "150", "--screenshot", shot});
  if (!skip_.empty()) GTEST_SKIP() << "no OpenGL window here: " << skip_;
  ASSERT_EQ(r.exit_code, 0) << r.messages;
  EXPECT_EQ(r.json["photos_loaded"], 320);
  EXPECT_LE(r.json["photo_mb"].get<double>(), 16.0);
  EXPECT_EQ(r.json["max_side_px"], 80);
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
