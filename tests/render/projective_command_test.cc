// lumi-render of scenes without a metric: matrices and points that only a projective transformation relates to the
// world.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "projective_capture.h"
#include "render/path/camera_path.h"
#include "render/path/matrix_path.h"
#include "render/tradeoff/budget.h"
#include "render/tradeoff/sweep.h"
#include "render/tradeoff/tradeoff.h"
#include "render_command_fixture.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/files/video.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using test::HasGl;
using test::Json;
using test::RenderCommand;
namespace fs = std::filesystem;

// The capture of the other tests as matrices and points of a world that only a projective transformation relates to it,
// its photos a video's frames.
class RenderProjective : public RenderCommand {
 protected:
  void WriteProjective(int views, bool video = true) {
    capture_ = test::MakeCapture(views, 64);
    capture_.scene.points = test::SeenPoints(capture_);
    metric_ = capture_.scene;
    for (int i = 0; i < views; ++i)
      if (video) capture_.scene.views[static_cast<std::size_t>(i)].frame_index = i;
    capture_.scene = test::Projective(capture_.scene, test::RandomTransformation(3, 30));
    WriteProjective();
  }
  void WriteProjective() {
    capture_.scene.image_folder = scene() / "images";
    for (std::size_t i = 0; i < capture_.photos.size(); ++i)
      WriteImage(scene() / "images" / capture_.scene.views[i].name, capture_.photos[i].levels[0]);
    WriteScene(capture_.scene, scene());
  }
  // The photos' own matrices, moved by so many pixels.
  RenderOptions AlongMatrices(const std::string& out, const Eigen::Vector2d& shift_px) const {
    MatrixPath path = MatrixPathOfPhotos(capture_.scene, 30);
    for (MatrixKey& key : path.keys)
      for (int i = 0; i < 2; ++i) key.P.row(i) += shift_px[i] * key.P.row(2);
    RenderOptions o = Options(out);
    o.path = folder_ / "matrices.json";
    WriteMatrixPath(o.path, path);
    return o;
  }
  Scene metric_;
};

TEST_F(RenderProjective, LeftOutPhotosAreAsGoodAsWithTheMetricWhereNominalAndPlaneAreTrue) {
  WriteProjective(12, false);
  RenderOptions o = Options("");
  o.output.clear();
  o.holdout = 4;
  o.nominal_focal_px = 0.9 * 64;
  const Json projective = Run(o);
  EXPECT_EQ(projective["proxy"], "per-view");
  EXPECT_EQ(projective["frame"], "projective");
  o.backend = "gl";
  const std::optional<Json> gl = HasGl(capture_) ? std::optional(Run(o)) : std::nullopt;
  o.backend = "cpu";
  o.nominal_focal_px = 0;
  const double nominal_db = Run(o)["psnr_mean_db"];

  capture_.scene = metric_;
  WriteCapture();
  o.proxy = "per-view";
  const Json metric = Run(o);
  EXPECT_NEAR(projective["psnr_mean_db"].get<double>(), metric["psnr_mean_db"].get<double>(), 0.02);
  EXPECT_NEAR(projective["nearest_photo_psnr_mean_db"].get<double>(),
              metric["nearest_photo_psnr_mean_db"].get<double>(), 1);
  EXPECT_NEAR(nominal_db, metric["psnr_mean_db"].get<double>(), 0.5)
      << "a nominal focal length off by a third is near enough";
  if (!gl) GTEST_SKIP() << "no OpenGL 4.3 here";
  EXPECT_NEAR((*gl)["psnr_mean_db"].get<double>(), metric["psnr_mean_db"].get<double>(), 0.1);
}

TEST_F(RenderProjective, APhotosOwnViewGivesThePhotoBack) {
  WriteProjective(9);
  RenderOptions o = Options("own");
  o.view = capture_.scene.views[4].name;
  const Json j = Run(o);
  EXPECT_GT(j["views"][0]["psnr_db"], 55.0);
  EXPECT_EQ(j["window_frames"], 5);
  for (const char* show : {"false-color", "weights", "angle", "time", "resolution", "proxy", "difference"}) {
    o.output = folder_ / show;
    o.show = show;
    EXPECT_EQ(Run(o)["frames"], 1) << show;
  }
}

TEST_F(RenderProjective, BothBackendsWeighAlike) {
  WriteProjective(9);
  if (!HasGl(capture_)) GTEST_SKIP() << "no OpenGL 4.3 here";
  RenderOptions o = AlongMatrices("cpu", {3.3, -2.2});
  o.show = "false-color";
  Run(o);
  o.output = folder_ / "gl";
  o.backend = "gl";
  Run(o);
  for (const char* frame : {"frames/frame_000000.png", "frames/frame_000004.png", "frames/frame_000008.png"})
    EXPECT_GT(Psnr(folder_ / "cpu" / frame, folder_ / "gl" / frame), 45)
        << frame << ": 8 bits, and floats on both sides";
}

TEST_F(RenderProjective, APathOfMatricesIsRenderedAFrameAKeyAndResumes) {
  WriteProjective(16);
  RenderOptions o = AlongMatrices("out", {0.5, -0.25});
  o.window_frames = 1;
  o.video = true;
  const Json j = Run(o);
  EXPECT_EQ(j["frames"], 16);
  EXPECT_EQ(j["width"], 64);
  EXPECT_EQ(j["settings"]["time"], "on");
  EXPECT_EQ(j["settings"]["time-core"], 0.0);
  for (const Json& e : j["effects"])
    EXPECT_THAT(e["evidence"].get<std::string>(), testing::Not(testing::HasSubstr("option"))) << "nobody gave one";
  EXPECT_GT(j["coverage"], 0.98);
  EXPECT_TRUE(fs::exists(o.output / "path.mp4"));
  fs::rename(o.output / "frames/frame_000009.png", folder_ / "kept.png");
  const Json again = Run(o);
  EXPECT_EQ(again["frames_reused"], 15);
  EXPECT_GT(Psnr(o.output / "frames/frame_000009.png", folder_ / "kept.png"), 90)
      << "what a frame is made of does not depend on those before it";
  o.window_frames = 2;
  EXPECT_EQ(Run(o)["frames_reused"], 0);
  o.width_px = 32;
  EXPECT_EQ(Run(o)["height"], 24);
}

TEST_F(RenderProjective, APathOfMatricesIsThereForMetricScenesToo) {
  WriteProjective(12);
  capture_.scene = metric_;
  WriteCapture();
  RenderOptions o = AlongMatrices("out", {0, 0});
  for (const char* proxy : {"truth", "per-view"}) {
    o.output = folder_ / proxy;
    o.proxy = proxy;
    EXPECT_EQ(Run(o)["frames"], 12);
    EXPECT_GT(Compare(ReadImage8(o.output / "frames/frame_000005.png"), capture_.photos[5].levels[0]).psnr_db, 40)
        << proxy;
  }
}

TEST_F(RenderProjective, WhatNoPhotoOfTheWindowSeesIsFilledFromFartherAwayAndThenSmoothly) {
  WriteProjective(16);
  RenderOptions o = AlongMatrices("out", {14, 0});
  o.window_frames = 0;
  const double black = Run(o)["coverage"];
  EXPECT_LT(black, 0.9);
  o.border.fill = true;
  for (const char* backend : {"cpu", "gl"}) {
    if (std::string(backend) == "gl" && !HasGl(capture_)) continue;
    o.backend = backend;
    const Json j = Run(o);
    EXPECT_NEAR(j["coverage_window"].get<double>(), black, 0.01) << backend;
    EXPECT_GT(j["coverage_wider"], black + 0.02) << backend;
    EXPECT_NEAR(j["coverage"].get<double>(), j["coverage_wider"].get<double>(), 1e-6) << backend;
    const Image8 frame = ReadImage8(o.output / "frames/frame_000000.png");
    EXPECT_EQ(std::count(frame.data.begin(), frame.data.end(), 0), 0) << backend << ": nothing is black";
  }
  o.decided = {"fill-frames"};
  o.border.fill = false;
  EXPECT_THROW(Run(o), UsageError);
}

TEST_F(RenderProjective, WhatTheFrameDoesNotHaveIsRefusedWithAWayOut) {
  WriteProjective(6);
  RenderOptions o = Options("out");
  o.view = capture_.scene.views[0].name;
  const auto with = [&](auto&& change) {
    RenderOptions changed = o;
    change(changed);
    return changed;
  };
  EXPECT_THROW(Run(with([](RenderOptions& r) { r.proxy = "truth"; })), UsageError);
  EXPECT_THROW(Run(with([](RenderOptions& r) { r.show = "cameras"; })), UsageError);
  EXPECT_THROW(Run(with([](RenderOptions& r) {
                 r.settings.resolution = Resolution::kDistance;
                 r.decided = {"resolution"};
               })),
               UsageError);
  EXPECT_EQ(Run(with([](RenderOptions& r) { r.effects = "resolution"; }))["settings"]["resolution"], "jacobian");
  RenderOptions poses = StandingStill("out");
  try {
    Run(poses);
    FAIL() << "a path of poses";
  } catch (const DataError& e) {
    EXPECT_THAT(e.hint(), testing::HasSubstr("lumi-stabilize"));
  }
  RenderOptions strange = AlongMatrices("out", {0, 0});
  MatrixPath path = ReadMatrixPath(strange.path);
  path.keys[1].view = "nobody.png";
  WriteMatrixPath(strange.path, path);
  EXPECT_THROW(Run(strange), DataError);
  path.keys[1].P.row(2).setZero();
  WriteMatrixPath(strange.path, path);
  EXPECT_THROW(Run(strange), InputError);
  capture_.scene.plane_at_infinity.reset();
  WriteProjective();
  try {
    Run(o);
    FAIL() << "no plane at infinity";
  } catch (const DataError& e) {
    EXPECT_THAT(e.hint(), testing::HasSubstr("lumi-reconstruct"));
  }
}

}  // namespace
}  // namespace lumi
