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
  const ProgramResult result =
      RunProgram({"lumi-pipeline", photos.string(), "-o", scene.string(), "--no-video", "--json"});
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
    const std::string said =
        summary["error"]["message"].get<std::string>() + summary["error"]["hint"].get<std::string>();
    EXPECT_THAT(said, testing::HasSubstr("13"));
    EXPECT_THAT(said, testing::HasSubstr("--poses"));
    EXPECT_FALSE(fs::exists(scene / "lumigraph.json"));
  }
}

TEST_F(RealCaptures, CubeWithItsPosesIsRefusedUntilCamerasMayBeRescaled) {
  const fs::path photos = data_ / "cube/images", poses = data_ / "cube/sparse", scene = folder_ / "scene";
  ASSERT_TRUE(fs::exists(poses));
  const std::vector<std::string> argv{"lumi-pipeline", photos.string(), "-o",        scene.string(),
                                      "--poses",       poses.string(),  "--no-video"};
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

// Something on a turntable, filmed by a camera that rises from turn to turn: its cameras are known in its own frame,
// the moments from a list.
TEST_F(RealCaptures, ATurningObjectIsRenderedAtMomentsThatWereHeldOut) {
  const fs::path dino = data_ / "dino-rings", scene = folder_ / "room";
  if (!fs::exists(dino / "periodic")) GTEST_SKIP() << "no " << dino;
  const ProgramResult cameras =
      RunProgram({"lumi-reconstruct", dino / "images", "-o", scene, "--poses", dino / "dino_par.txt", "--times",
                  dino / "periodic/schedule.csv", "--turntable", "--matching", "sequential", "--max-image-size", "320",
                  "--max-features", "300", "--json"});
  ASSERT_EQ(cameras.exit_code, 0) << cameras.err;
  EXPECT_EQ(json::parse(cameras.out)["images_registered"], 139);  // of 145: the others are in no turn
  ASSERT_EQ(RunProgram({"lumi-proxy", "silhouettes", scene, "--rule", "R + G + B > 60"}).exit_code, 0);
  ASSERT_EQ(RunProgram({"lumi-proxy", "plane", scene}).exit_code, 0);
  constexpr const char* kOneOfEachTurn = "47";
  const ProgramResult with = RunProgram({"lumi-render", scene, "--holdout", kOneOfEachTurn, "--json"}),
                      without =
                          RunProgram({"lumi-render", scene, "--holdout", kOneOfEachTurn, "--time", "off", "--json"});
  ASSERT_EQ(with.exit_code, 0) << with.err;
  ASSERT_EQ(without.exit_code, 0) << without.err;
  const json w = json::parse(with.out), o = json::parse(without.out);
  EXPECT_EQ(w["views"].size(), 3U);
  // Measured: 25.0, 21.9 and 15 dB; over the object 22.5, 19.3 and 13.
  EXPECT_GT(w["psnr_mean_db"].get<double>(), 24);
  EXPECT_GT(w["psnr_mean_db"].get<double>(), o["psnr_mean_db"].get<double>() + 8);
  EXPECT_GT(w["psnr_mean_db"].get<double>(), w["nearest_photo_psnr_mean_db"].get<double>() + 2);
  EXPECT_GT(w["psnr_object_mean_db"].get<double>(), o["psnr_object_mean_db"].get<double>() + 7);
  EXPECT_GT(w["psnr_object_mean_db"].get<double>(), w["nearest_photo_psnr_object_mean_db"].get<double>() + 2);
}

}  // namespace
}  // namespace lumi
