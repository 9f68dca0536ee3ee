// More photos than are matched each with each, in an order that says nothing: by our features and by COLMAP's.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "tests/support/found_cameras.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr int kPhotos = 104;
// Seen: centres 0.081 % and 0.114 % at worst (own), 0.223 degree (COLMAP's); some four times that, three for rotations.
constexpr double kCentreMaxPercent = 0.4;
constexpr double kRotationMaxDeg = 0.6;

// Who finds the features; COLMAP's mapper.
class ManyPhotos : public testing::TestWithParam<std::pair<std::string, std::string>> {};

TEST_P(ManyPhotos, ThatAreShuffledAreAllPlaced) {
  const SimulatedCapture capture("plaza", kPhotos, 240);
  std::vector<fs::path> photos;
  for (const auto& entry : fs::directory_iterator(capture.photos())) photos.push_back(entry.path());
  ASSERT_EQ(photos.size(), std::size_t{kPhotos});
  std::ranges::sort(photos);
  std::mt19937 random(3);
  std::ranges::shuffle(photos, random);
  std::map<std::string, std::string> true_name;
  fs::create_directories(capture / "shuffled");
  for (int i = 0; i < kPhotos; ++i) {
    const std::string name = fmt::format("photo {}.jpg", 1000 + i);
    true_name[name] = photos[static_cast<std::size_t>(i)].filename().string();
    fs::create_hard_link(photos[static_cast<std::size_t>(i)], capture / "shuffled" / name);
  }

  const fs::path scene = capture / "scene";
  const auto& [features, mapper] = GetParam();
  ChildProgram program({"lumi-reconstruct", (capture / "shuffled").string(), "-o", scene.string(), "--features",
                        features, "--mapper", mapper});
  const ProgramResult result = program.Wait(1000);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, testing::ContainsRegex("[0-9]+ of 5356 pairs of photos were tried"));

  const FoundCameras found =
      CompareWithCapture(scene, capture.path(), [&](const std::string& name) { return true_name.at(name); });
  ASSERT_EQ(found.photos, std::size_t{kPhotos});
  EXPECT_LT(found.errors.centre_max_percent, kCentreMaxPercent);
  EXPECT_LT(found.errors.rotation_max_deg, kRotationMaxDeg);
}

INSTANTIATE_TEST_SUITE_P(By, ManyPhotos,
                         testing::Values(std::pair("own", "quick"), std::pair("own", "hierarchical"),
                                         std::pair("colmap", "careful")),
                         [](const auto& way) { return way.param.first + "_" + way.param.second; });

}  // namespace
}  // namespace lumi
