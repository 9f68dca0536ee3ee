// lumi-reconstruct --tradeoff, and a desk photographed in no order, by factorisation: simulated photos, whose cameras
// are known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class MeasuredDesk : public testing::Test {
 protected:
  static constexpr int kPhotos = 10, kSidePx = 400;
  static void SetUpTestSuite() {
    desk_ = std::make_unique<SimulatedCapture>("desk", kPhotos, kSidePx);
    focal_px_ = OpenScene(desk_->path(), {}, SilentProgress()).cameras.front().FocalPx().x();
    fs::create_directories(Path("tmp"));
  }
  static void TearDownTestSuite() { desk_.reset(); }
  static std::string Path(const std::string& name) { return (*desk_ / name).string(); }
  static std::vector<std::string> Command(const std::string& scene, const std::vector<std::string>& more) {
    std::vector<std::string> argv{"lumi-reconstruct", desk_->photos().string(), "-o", Path(scene), "--tradeoff"};
    argv.insert(argv.end(), more.begin(), more.end());
    return argv;
  }
  static std::vector<std::string> Factorised() {
    return {"--backend", "factorization", "--focal-px", std::to_string(focal_px_), "--features", "800"};
  }
  // Where the runs' folders are made.
  static std::map<std::string, std::string> Environment() { return {{"TMPDIR", Path("tmp")}}; }
  static std::unique_ptr<SimulatedCapture> desk_;
  static double focal_px_;
};
std::unique_ptr<SimulatedCapture> MeasuredDesk::desk_;
double MeasuredDesk::focal_px_ = 0;

TEST_F(MeasuredDesk, EachSettingHasItsErrorAgainstTheTruthAndItsSeconds) {
  const std::string users = Contents(desk_->path());
  std::vector<std::string> argv = Command("scene", Factorised());
  argv.insert(argv.end(), {"--min-registered", "1", "--json"});  // a hundred pixels a side do not place all photos
  const ProgramResult run = RunProgram(argv, Environment());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["upgrade"], "metric");
  const json& t = summary["tradeoff"];
  EXPECT_THAT(t["reference"].get<std::string>(), HasSubstr("truth"));
  EXPECT_THAT(t["points"][0]["name"].get<std::string>(), HasSubstr("as given"));
  int measured = 0, failed = 0, posed = 0, front = 0;
  for (const json& row : t["points"]) {
    EXPECT_GT(row["seconds"].get<double>(), 0);
    if (row.contains("failed")) {
      EXPECT_FALSE(row["failed"].get<std::string>().empty());
      ++failed;
      continue;
    }
    ++measured;
    EXPECT_GT(row["mean_reprojection_error_px"].get<double>(), 0);
    posed += row.contains("centre_rms_percent") && row.contains("rotation_rms_deg");
    front += row["front"].get<bool>();
  }
  EXPECT_GE(measured, 5) << t.dump(1);
  EXPECT_GE(posed, 5) << t.dump(1);
  EXPECT_GE(failed, 1) << t.dump(1);
  EXPECT_GE(front, 1);

  // The scene is there as always, the tables in it, and nothing else was written.
  EXPECT_EQ(OpenScene(Path("scene"), {}, SilentProgress()).views.size(), static_cast<std::size_t>(kPhotos));
  EXPECT_EQ(json::parse(ReadText(Path("scene/tradeoff/factorization.json")))["points"], t["points"]);
  EXPECT_THAT(ReadText(Path("scene/tradeoff/factorization.svg")), HasSubstr("</svg>"));
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(ReadText(Path("scene/tradeoff/factorization.csv")), '\n')),
            t["points"].size() + 1);
  EXPECT_TRUE(fs::is_empty(Path("tmp")));
  EXPECT_FALSE(fs::exists(Path("scene/LOCK")));
  EXPECT_EQ(Contents(desk_->path()), users);
}

TEST_F(MeasuredDesk, InterruptedLeavesTheSceneAndNoTable) {
  ChildProgram child(Command("stopped", Factorised()), Environment());
  ASSERT_TRUE(child.WaitForErrorText("measuring, features")) << child.Wait().err;
  child.Signal(SIGINT);
  const ProgramResult run = child.Wait();
  EXPECT_EQ(run.exit_code, 130) << run.err;
  EXPECT_TRUE(fs::is_empty(Path("tmp")));
  EXPECT_FALSE(fs::exists(Path("stopped/tradeoff")));
  EXPECT_FALSE(fs::exists(Path("stopped/LOCK")));
  EXPECT_EQ(OpenScene(Path("stopped"), {}, SilentProgress()).views.size(), static_cast<std::size_t>(kPhotos));
}

TEST_F(MeasuredDesk, ContradictionsAndStrangeReferencesAreRefused) {
  const auto refuse = [&](const std::vector<std::string>& more, int code, std::vector<std::string> names) {
    ExpectRefusal({Command("refused", more), code, std::move(names), Path("refused"), {desk_->photos()}});
  };
  refuse({"--rig", "ring"}, 2, {"--tradeoff", "--rig"});
  refuse({"--database", desk_->photos().string()}, 2, {"--tradeoff", "--database"});
  refuse({"--backend", "factorization", "--projective", "--reference", desk_->path().string()}, 2,
         {"--reference", "--projective"});
  refuse({"--reference", Path("absent")}, 3, {"absent"});
  refuse({"--reference", desk_->photos().string()}, 2, {"is no scene"});
  std::vector<std::string> argv = Command("refused", {"--reference", desk_->path().string()});
  std::erase(argv, "--tradeoff");
  ExpectRefusal({argv, 2, {"--reference", "--tradeoff"}, Path("refused"), {desk_->photos()}});
}

}  // namespace
}  // namespace lumi
