// What the tests of lumi-render's commands share: a scene of small photos on disk, and runs of it.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "capture_files.h"
#include "render/commands/render_command.h"
#include "render/path/camera_path.h"
#include "scene/files/temporary_folder.h"
#include "scene/image_difference/image_difference.h"

namespace lumi::test {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// A scene of small photos on disk, with its true proxy.
class RenderCommand : public testing::Test {
 protected:
  void WriteCapture(int views) {
    capture_ = MakeCapture(views, 64);
    WriteCapture();
  }
  void WriteCapture() { WriteAsScene(capture_, scene()); }
  // Every other photo shows the same place half a period later, in other colours.
  void WriteMovingCapture(int views) {
    capture_ = MakeCapture(views, 64);
    capture_.scene.period_s = 1;
    for (std::size_t i = 0; i < capture_.photos.size(); ++i) {
      capture_.scene.views[i].time_s = kFirst_s + 0.5 * static_cast<double>(i % 2);
      if (i % 2 == 0) continue;
      for (auto& value : capture_.photos[i].levels[0].data) value = static_cast<std::uint8_t>(255 - value);
    }
    WriteCapture();
  }
  fs::path scene() const { return folder_ / "scene"; }
  RenderOptions Options(const std::string& out) const {
    RenderOptions o;
    o.scene = scene();
    o.output = folder_ / out;
    return o;
  }
  // A camera that stands still for half a second, in two frames.
  RenderOptions StandingStill(const std::string& out) const {
    CameraPath path;
    path.fps = 4;
    path.width_px = 32;
    path.height_px = 24;
    for (const double t : {0.0, 0.5}) {
      PathKey key;
      key.cam_from_world = capture_.scene.views[4].cam_from_world;
      key.vertical_fov_rad = 0.8;
      key.time_s = t;
      path.keys.push_back(key);
    }
    RenderOptions o = Options(out);
    o.path = folder_ / "path.json";
    WriteCameraPath(o.path, path);
    return o;
  }
  static RenderOptions Optimum(RenderOptions o) {
    o.settings.similarity = Similarity::kFull;
    o.settings.correlation = Correlation::kFallingLeaves;
    o.settings.sampling = Sampling::kInterpolated;
    o.decided = {"similarity"};
    return o;
  }
  static Json Printed(const RenderSummary& summary) { return Json::parse(JsonKeys(summary).Text()); }
  static Json Run(const RenderOptions& o) { return Printed(RunRender(o, SilentProgress())); }
  static double Psnr(const fs::path& a, const fs::path& b) { return Compare(ReadImage8(a), ReadImage8(b)).psnr_db; }

  static constexpr double kFirst_s = 10.25;
  TemporaryFolder folder_;
  Capture capture_;
};

inline bool HasGl(const test::Capture& c) {
  try {
    MakeGlRenderer(WorldOf(c.scene, c.proxy), c.photos);
    return true;
  } catch (const MachineError&) {
    return false;
  }
}

}  // namespace lumi::test
