// A page holds to the megabytes that it was given, whatever its photos are like.
#include <gtest/gtest.h>

#include <random>

#include "export/web_export.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

// How large a page becomes is estimated from every fourth of 24 photos: here the others are noise, which takes many
// times as much as a picture.
TEST(WebSize, IsKeptWherePhotosAreUnlikeOneAnother) {
  constexpr double kMostMb = 1.2;
  const SimulatedCapture desk("desk", 24, 320);
  const ProgramResult simpler =
      RunProgram({"lumi-proxy", "simplify", desk.path(), "--faces", "2000", "--activate", "--quiet"});
  ASSERT_EQ(simpler.exit_code, 0) << simpler.err;
  const Scene scene = OpenScene(desk.path(), {}, SilentProgress());
  std::mt19937 random(1);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (i % 4 == 2) continue;
    const std::filesystem::path file = scene.ImagePath(scene.views[i]);
    Image8 noise = ReadImage8(file);
    for (std::size_t at = 0; at < noise.data.size(); ++at) noise.data.data()[at] = static_cast<std::uint8_t>(random());
    WriteImage(file, noise);
  }
  WebOptions options;
  options.scene = desk.path();
  options.output = desk / "page.html";
  options.max_mb = kMostMb;
  const WebSummary summary = ExportWeb(options, SilentProgress());
  EXPECT_LE(summary.mb, kMostMb);
  EXPECT_LE(static_cast<double>(std::filesystem::file_size(options.output)) / 1e6, kMostMb);
  EXPECT_GT(summary.mb, kMostMb / 3);
  for (const PhotoReduction& r : summary.tried) EXPECT_LE(r.mb, kMostMb);
}

}  // namespace
}  // namespace lumi
