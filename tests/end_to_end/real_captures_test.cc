// Photographs that nobody here made: minutes each.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/bad_input.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class RealCaptures : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(data_)) GTEST_SKIP() << "the captures in " << data_ << " are absent";
  }
  const fs::path data_ = fs::path(LUMI_SOURCE_DIR) / "../shared/data";
  TemporaryFolder folder_;
};

// COLMAP with its own defaults joins two of these photos. Few are never taken for a success.
TEST_F(RealCaptures, CubeFromScratchJoinsMostPhotosOrSaysThatPosesCanBeGiven) {
  const fs::path photos = data_ / "cube/images", scene = folder_ / "scene";
  const std::string before = Contents(photos);
  const ProgramResult result = RunProgram({"lumi-pipeline", photos.string(), "-o", scene.string(), "--no-video", "--json"});
  EXPECT_EQ(Contents(photos), before);
  const json summary = json::parse(result.out, nullptr, false);
  ASSERT_TRUE(summary.is_object()) << result.out;
  if (result.exit_code == 0) {
    const json reconstruct = summary["stages"][0]["summary"];
    EXPECT_EQ(reconstruct["images_total"], 13);
    EXPECT_GE(reconstruct["images_registered"].get<int>(), 7);
    EXPECT_EQ(reconstruct["missing"].size(), 13U - reconstruct["images_registered"].get<std::size_t>());
  } else {
    EXPECT_EQ(result.exit_code, 1) << result.err;
    const std::string said = summary["error"]["message"].get<std::string>() + summary["error"]["hint"].get<std::string>();
    EXPECT_THAT(said, testing::HasSubstr("13"));
    EXPECT_THAT(said, testing::HasSubstr("--poses"));
    EXPECT_FALSE(fs::exists(scene / "lumigraph.json"));
  }
}

TEST_F(RealCaptures, CubeWithItsPosesIsRefusedUntilCamerasMayBeRescaled) {
  const fs::path photos = data_ / "cube/images", poses = data_ / "cube/sparse", scene = folder_ / "scene";
  ASSERT_TRUE(fs::exists(poses));
  const std::vector<std::string> argv{"lumi-pipeline", photos.string(), "-o", scene.string(), "--poses", poses.string(), "--no-video"};
  Refusal refusal{argv, 1, {"1280x960", "1000x748", "--rescale-cameras"}, {}, {data_ / "cube"}};
  ExpectRefusal(refusal);
  EXPECT_FALSE(fs::exists(scene / "lumigraph.json"));

  std::vector<std::string> rescaled = argv;
  rescaled.insert(rescaled.end(), {"--rescale-cameras", "--json"});
  const ProgramResult result = RunProgram(rescaled);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json summary = json::parse(result.out);
  EXPECT_GE(summary["stages"][0]["summary"]["images_registered"].get<int>(), 12);
}

}  // namespace
}  // namespace lumi
