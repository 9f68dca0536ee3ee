// The cost of a time window, on photos of a still scene whose brightness runs round a period: what moves is known
// exactly.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "capture.h"
#include "render/tradeoff/tradeoff.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kPeriod_s = 1, kFrame_s = 1.0 / 30;
constexpr int kPhotos = 60;

struct PulsingScene {
  TemporaryFolder folder;
  explicit PulsingScene(bool timed) {
    test::Capture c = test::MakeCapture(kPhotos, 48);
    c.scene.image_folder = Path() / "images";
    for (int i = 0; i < kPhotos; ++i) {
      const auto at = static_cast<std::size_t>(i);
      Image8 photo = c.photos[at].levels[0];
      // The times jump about, so that neighbours in space are strangers in time.
      const double time_s = kFrame_s * ((i * 37) % kPhotos) + 1000;
      const double brightness = 0.6 + 0.4 * std::sin(2 * M_PI * time_s / kPeriod_s);
      for (auto& v : photo.data) v = static_cast<std::uint8_t>(v * brightness);
      WriteImage(Path() / "images" / c.scene.views[at].name, photo);
      if (timed) c.scene.views[at].time_s = time_s;
    }
    c.scene.period_s = kPeriod_s;
    c.scene.active_proxy = "truth";
    WriteScene(c.scene, Path());
    WriteMesh(ProxyPath(Path(), "truth"), c.proxy);
  }
  std::filesystem::path Path() const { return folder / "scene"; }
  MeasureOptions Options() const {
    MeasureOptions o;
    o.scene = Path();
    o.output = folder / "out";
    o.holdout = 10;
    o.views = 4;
    o.repeats = 1;
    o.effects = "fov";
    o.settings.fov_feather = 0.05;  // three pixels of photos this small
    return o;
  }
};

TEST(TimeWindows, ANarrowOneShowsTheMomentAndAWideOneBlendsThem) {
  const PulsingScene scene(true);
  const Answer answer = RunTimeWindows(scene.Options(), SilentProgress());
  const auto j = nlohmann::json::parse(answer.keys.Text());
  const auto& rows = j["rows"];
  ASSERT_GE(rows.size(), 4U);
  EXPECT_NEAR(j["frame_s"].get<double>(), kFrame_s, 1e-6);
  for (std::size_t i = 1; i + 1 < rows.size(); ++i) {
    EXPECT_NEAR(rows[i]["window_s"].get<double>(), 2 * rows[i - 1]["window_s"].get<double>(), 1e-9);
    EXPECT_GE(rows[i]["photos_in_window"].get<double>(), rows[i - 1]["photos_in_window"].get<double>());
    EXPECT_LE(rows[i]["angle_deg"].get<double>(), rows[i - 1]["angle_deg"].get<double>() + 1e-6)
        << "a wider window has nearer cameras";
  }
  // The period itself: all photos but those held out.
  EXPECT_NEAR(rows[rows.size() - 2]["photos_in_window"].get<double>(), kPhotos - kPhotos / 10, 1e-6);
  EXPECT_TRUE(rows.back()["window_s"].is_null());
  EXPECT_LT(rows[1]["temporal_blur_frames"].get<double>(), 0.5 * rows.back()["temporal_blur_frames"].get<double>());
  EXPECT_GT(j["best"]["gain_db"].get<double>(), 5);
  EXPECT_LT(j["best"]["window_frames"].get<double>(), 16);
  for (const char* file : {"time-windows.json", "time-windows.csv", "time-windows.svg"})
    EXPECT_TRUE(std::filesystem::exists(scene.folder / "out" / file)) << file;
  EXPECT_NE(answer.text.find("without time"), std::string::npos);
}

TEST(TimeWindows, AgainstAnotherScenesPhotosAllOfOursAreUsed) {
  const PulsingScene scene(true), truth(true);
  MeasureOptions o = scene.Options();
  o.against = truth.Path();
  const auto j = nlohmann::json::parse(RunTimeWindows(o, SilentProgress()).keys.Text());
  // The same photos: each shows itself where the window is narrow.
  EXPECT_GT(j["rows"][0]["psnr_db"].get<double>(), 30);
  EXPECT_NEAR(j["rows"][j["rows"].size() - 2]["photos_in_window"].get<double>(), kPhotos, 1e-6);
}

TEST(TimeWindows, WithoutTimesItIsRefused) {
  const PulsingScene scene(false);
  EXPECT_THROW(RunTimeWindows(scene.Options(), SilentProgress()), DataError);
}

}  // namespace
}  // namespace lumi
