// A video becomes a lumigraph without COLMAP: lumi-pipeline --backend factorization; and what happens where the lens is
// unknown.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/projective_json.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr int kFrames = 72, kWidthPx = 320;
// 0.1 degree and 0.3 % of the scene are what the method is held to; the video's compression is in it.
constexpr double kFactorizedCentrePercent = 0.3, kFactorizedRotationDeg = 0.1;

// The capture's photos, in the order of their names.
void MakeVideo(const Scene& truth, const std::string& video) {
  VideoWriter writer(video, 30);
  for (const View& view : truth.views) writer.Add(ReadImage8(truth.ImagePath(view)));
  writer.Finish();
}

// Frame i of the video is the truth's view i.
PoseErrors ErrorsOf(const Scene& scene, const Scene& truth) {
  std::vector<Rigid3> found, true_poses;
  for (const View& view : scene.views) {
    found.push_back(view.cam_from_world);
    true_poses.push_back(truth.views.at(static_cast<std::size_t>(view.frame_index.value())).cam_from_world);
  }
  const PoseErrors errors = ComparePoses(found, true_poses);
  std::printf("%zu cameras: centres %.4f %%, rotations %.4f degrees\n", found.size(), errors.centre_rms_percent,
              errors.rotation_rms_deg);
  return errors;
}

class FactorizedVideo : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    capture_ = std::make_unique<SimulatedCapture>("plaza", kFrames, kWidthPx);
    const Scene truth = Truth();
    focal_px_ = truth.cameras.front().FocalPx().x();
    MakeVideo(truth, Path("plaza.mp4"));
  }
  static void TearDownTestSuite() { capture_.reset(); }

  static std::string Path(const std::string& name) { return (*capture_ / name).string(); }
  static Scene Truth() { return OpenScene(capture_->path(), {}, SilentProgress()); }
  static std::string Focal() { return std::to_string(focal_px_); }
  static ProgramResult Reconstruct(const std::string& scene, const std::vector<std::string>& more) {
    std::vector<std::string> argv{"lumi-reconstruct", Path("plaza.mp4"), "-o", Path(scene), "--json"};
    argv.insert(argv.end(), more.begin(), more.end());
    return RunProgram(argv);
  }
  static std::unique_ptr<SimulatedCapture> capture_;
  static double focal_px_;
};
std::unique_ptr<SimulatedCapture> FactorizedVideo::capture_;
double FactorizedVideo::focal_px_ = 0;

TEST_F(FactorizedVideo, BecomesALumigraphThatCanBeLookedAt) {
  const std::vector<std::string> argv{"lumi-pipeline", Path("plaza.mp4"), "-o",    Path("scene"), "--backend",
                                      "factorization", "--focal-px",      Focal(), "--keyframes", "24",
                                      "--no-video",    "--proxy-minutes", "0",     "--json"};
  const ProgramResult run = RunProgram(argv);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  const json& cameras = summary["stages"][0]["summary"];
  EXPECT_EQ(cameras["backend"], "factorization");
  EXPECT_EQ(cameras["upgrade"], "metric");
  EXPECT_EQ(cameras["images_registered"], cameras["images_total"]);
  const Scene scene = OpenScene(Path("scene"), {}, SilentProgress());
  ASSERT_GE(scene.views.size(), 20U);
  const PoseErrors errors = ErrorsOf(scene, Truth());
  EXPECT_LT(errors.centre_rms_percent, kFactorizedCentrePercent);
  EXPECT_LT(errors.rotation_rms_deg, kFactorizedRotationDeg);

  json holdout;
  for (const json& stage : summary["stages"])
    if (stage["name"] == "holdout") holdout = stage["summary"];
  ASSERT_TRUE(holdout.contains("psnr_mean_db")) << run.out;
  EXPECT_GT(holdout["psnr_mean_db"].get<double>(), holdout["nearest_photo_psnr_mean_db"].get<double>());
  EXPECT_TRUE(fs::exists(Path("scene/report.html")));
  for (const json& stage : json::parse(RunProgram(argv).out)["stages"]) EXPECT_TRUE(stage["reused"]) << stage["name"];

  // The other backend in the same folder: both are compared.
  const ProgramResult colmap = Reconstruct("scene", {"--keyframes", "24", "--quality", "low"});
  ASSERT_EQ(colmap.exit_code, 0) << colmap.err;
  const json both = json::parse(colmap.out);
  EXPECT_EQ(both["backend"], "colmap");
  ASSERT_TRUE(both.contains("compared_with")) << colmap.out;
  EXPECT_EQ(both["compared_with"]["backend"], "factorization");
  EXPECT_GE(both["compared_with"]["views"].get<int>(), 20);
  EXPECT_LT(both["compared_with"]["centre_rms_percent"].get<double>(), 2);
}

TEST_F(FactorizedVideo, OfAnUnknownLensIsQuasiAffineAndSaysSo) {
  const ProgramResult run = Reconstruct("unknown", {"--backend", "factorization", "--keyframes", "16"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["upgrade"], "quasi-affine");
  EXPECT_THAT(run.err, HasSubstr("no intrinsics are known"));
  EXPECT_LT(summary["mean_reprojection_error_px"].get<double>(), 0.5);
  const Scene scene = OpenScene(Path("unknown"), {}, SilentProgress());
  EXPECT_EQ(scene.frame, Frame::kQuasiAffine);
  EXPECT_TRUE(fs::exists(Path("unknown") + "/" + std::string(kProjectiveName)));
  for (const Point& point : scene.points)
    for (const Observation& o : point.track)
      ASSERT_GT((scene.views[static_cast<std::size_t>(o.view.value)].P * point.X_in_world).z(), 0);

  // What needs a metric scene says so.
  const ProgramResult proxy = RunProgram({"lumi-proxy", "plane", Path("unknown")});
  EXPECT_EQ(proxy.exit_code, 1);
  EXPECT_THAT(proxy.err, HasSubstr("metric"));
}

TEST_F(FactorizedVideo, IsRefusedWhereTheOptionsContradict) {
  const auto refuse = [&](const std::vector<std::string>& more, int code, std::vector<std::string> names) {
    std::vector<std::string> argv{"lumi-reconstruct", Path("plaza.mp4"), "-o", Path("refused")};
    argv.insert(argv.end(), more.begin(), more.end());
    ExpectRefusal({argv, code, std::move(names), Path("refused"), {Path("plaza.mp4")}});
  };
  refuse({"--projective"}, 2, {"--projective", "--backend factorization"});
  refuse({"--backend", "factorization", "--projective", "--require", "metric"}, 2,
         {"--projective", "--require metric"});
  refuse({"--backend", "factorization", "--rig", "ring"}, 2, {"--rig"});
  refuse({"--backend", "factorization", "--features", "3"}, 2, {"--features"});
  refuse({"--backend", "factorization", "--window", "2"}, 2, {"--window"});
  refuse({"--backend", "bundler"}, 2, {"--backend"});
  refuse({"--window", "10"}, 2, {"--window"});
}

TEST_F(FactorizedVideo, MustBeMetricWhereThatIsRequired) {
  const ProgramResult run =
      Reconstruct("required", {"--backend", "factorization", "--keyframes", "16", "--require", "metric"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("known intrinsics"));
  EXPECT_FALSE(fs::exists(Path("required/lumigraph.json")));
}

// Straight ahead down a corridor, the epipole in view, walls that the camera passes close by: what drifts first.
TEST(FactorizedDrive, IsHeldToTheSameFromEndToEnd) {
  constexpr int kDriveFrames = 110;
  const SimulatedCapture capture("hallway", kDriveFrames, kWidthPx);
  const Scene truth = OpenScene(capture.path(), {}, SilentProgress());
  const std::string video = (capture / "hallway.mp4").string(), out = (capture / "scene").string();
  MakeVideo(truth, video);
  const ProgramResult run =
      RunProgram({"lumi-reconstruct", video, "-o", out, "--backend", "factorization", "--focal-px",
                  std::to_string(truth.cameras.front().FocalPx().x()), "--require", "metric", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const json summary = json::parse(run.out);
  EXPECT_EQ(summary["images_registered"], summary["images_total"]);
  const Scene scene = OpenScene(out, {}, SilentProgress());
  // The keyframes, though frames between them were factorised too.
  EXPECT_EQ(scene.views.size(), summary["keyframes"].get<std::size_t>());
  EXPECT_LT(scene.views.size(), static_cast<std::size_t>(kDriveFrames) / 2);
  for (const Point& point : scene.points) ASSERT_GE(point.track.size(), 2U);
  const PoseErrors errors = ErrorsOf(scene, truth);
  EXPECT_LT(errors.centre_rms_percent, kFactorizedCentrePercent);
  EXPECT_LT(errors.rotation_rms_deg, kFactorizedRotationDeg);
}

}  // namespace
}  // namespace lumi
