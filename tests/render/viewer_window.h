// lumi-view itself, under a virtual display.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "render/radiance/setting_options.h"
#include "render/viewer/navigation.h"
#include "render/world/renderer.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/program/subprocess.h"
#include "tests/render/gl_test_scene.h"

namespace lumi::test {

constexpr double kAgreementDb = 30.0;  // 8 bits, and the panel's font nowhere
constexpr double kRefinedDb = 45.0;    // the same picture: 8 bits on one side

class ViewerWindow : public testing::Test {
 protected:
  void SetUp() override {
    if (!FindProgram("xvfb-run")) GTEST_SKIP() << "xvfb-run is not installed";
    folder_ = std::filesystem::temp_directory_path() / ("lumi_viewer_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_ / "images");
    world_ = MakeWorld(7, 160);
    Photograph(world_);
    for (std::size_t j = 0; j < world_.photos.size(); ++j)
      WriteImage(folder_ / "images" / world_.scene.views[j].name, world_.photos[j].levels[0]);
    world_.scene.folder = folder_;
    world_.scene.image_folder = folder_ / "images";
    world_.scene.active_proxy = "true";
    WriteScene(world_.scene, folder_);
    WriteMesh(ProxyPath(folder_, "true"), world_.proxy);
    Mesh floor;
    AddQuad(floor, {-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
    WriteMesh(ProxyPath(folder_, "floor"), floor);
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }

  struct Result {
    int exit_code = 0;
    nlohmann::json json;
    std::string messages;
  };
  Result RunViewer(std::vector<std::string> arguments, bool display = true) {
    std::vector<std::string> argv;
    // xvfb-run's own status is not the viewer's when its clean-up meets a race: the shell writes it down.
    const std::filesystem::path status = folder_ / "status";
    if (display) argv = {"xvfb-run", "-a", "sh", "-c", R"("$@"; echo $? > "$0")", status};
    argv.insert(argv.end(), {std::filesystem::path(LUMI_BIN_DIR) / "lumi-view", folder_, "--json"});
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

  ImageF CpuPicture(const ViewState& state, int width, int height, RadianceSettings settings = {},
                    Show show = Show::kColor) {
    RenderRequest request;
    request.view = MakeWindowView(state, width, height);
    request.settings = settings;
    request.show = show;
    return MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(request);
  }

  static RadianceSettings SettingsOf(const nlohmann::json& j) {
    RadianceSettings s;
    for (const auto& [name, value] : j.items())
      SetOption(s, name, value.is_string() ? value.get<std::string>() : value.dump());
    return s;
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

  std::filesystem::path folder_;
  World world_;
  std::string skip_;
};

}  // namespace lumi::test
