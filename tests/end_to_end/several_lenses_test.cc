// Photos of one size, without EXIF, that more than one lens took: found out, and each lens its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "tests/support/found_cameras.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kWideDeg = 52;

// A desk whose photos these cameras take in turns.
class SeveralLenses : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const SimulatedCapture one("desk", 2, 16);
    description_ = json::parse(ReadText(one.path() / "truth/scene.json"));
  }
  static void TearDownTestSuite() { description_.clear(); }

  // The cameras found, against the truth; all photos must be placed.
  PoseErrors Reconstruct(const std::vector<double>& degrees_in_turn, int views) {
    json description = description_;
    const json camera = description["cameras"][0];
    description["cameras"] = json::array();
    description["path"]["camera"] = json::array();
    for (std::size_t i = 0; i < degrees_in_turn.size(); ++i) {
      json lens = camera;
      lens["name"] = "lens " + std::to_string(i);
      lens["fov_deg"] = degrees_in_turn[i];
      description["cameras"].push_back(lens);
      description["path"]["camera"].push_back(lens["name"]);
    }
    WriteTextAtomically(folder_ / "scene.json", description.dump());
    const ProgramResult made = RunProgram({"lumi-simulate", (folder_ / "scene.json").string(), "--views",
                                           std::to_string(views), "--width", "400", "-o", capture().string()});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    run_ = ChildProgram({"lumi-reconstruct", (capture() / "images").string(), "-o", (folder_ / "scene").string()})
               .Wait(600);
    EXPECT_EQ(run_.exit_code, 0) << run_.err;
    const FoundCameras found = CompareWithCapture(folder_ / "scene", capture());
    cameras_ = found.cameras;
    EXPECT_EQ(found.photos, static_cast<std::size_t>(views));
    return found.errors;
  }
  fs::path capture() const { return folder_ / "capture"; }

  static json description_;
  TemporaryFolder folder_;
  ProgramResult run_;
  std::size_t cameras_ = 0;
};
json SeveralLenses::description_;

// With one camera for all: 14 % and 11 degrees, 1.07 px, and nothing said.
TEST_F(SeveralLenses, TwoCamerasInTurn) {
  const PoseErrors errors = Reconstruct({kWideDeg, 0.66 * kWideDeg}, 24);
  EXPECT_EQ(cameras_, 2U);
  EXPECT_THAT(run_.err, testing::HasSubstr("2 cameras for 24 photos"));
  EXPECT_LT(errors.centre_rms_percent, 0.15);
  EXPECT_LT(errors.rotation_rms_deg, 0.15);
}

TEST_F(SeveralLenses, AFewZoomedPhotosAmongOthers) {
  const PoseErrors errors =
      Reconstruct({kWideDeg, kWideDeg, kWideDeg, kWideDeg, kWideDeg, kWideDeg, 0.5 * kWideDeg}, 24);
  EXPECT_GE(cameras_, 2U);
  EXPECT_LT(errors.centre_rms_percent, 0.3);
  EXPECT_LT(errors.rotation_rms_deg, 0.15);
}

TEST_F(SeveralLenses, OneLensStaysOne) {
  Reconstruct({kWideDeg}, 24);
  EXPECT_EQ(cameras_, 1U);
  EXPECT_THAT(run_.err, testing::Not(testing::HasSubstr("camera for each")));
}

}  // namespace
}  // namespace lumi
