// lumi-render --border fill over a mesh: what no photo sees gets colours, and nothing else changes.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "capture_files.h"
#include "render/commands/render_command.h"
#include "render/path/camera_path.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/files/video.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using FillJson = nlohmann::ordered_json;

class FillCommand : public testing::Test {
 protected:
  void SetUp() override {
    capture_ = test::MakeCapture(7, 64);
    test::WriteAsScene(capture_, scene());
  }
  fs::path scene() const { return folder_ / "scene"; }
  RenderOptions Options(const std::string& out, bool fill) const {
    RenderOptions o;
    o.scene = scene();
    o.output = folder_ / out;
    o.border.fill = fill;
    return o;
  }
  // Two frames that see far more than the photos do.
  RenderOptions WidePath(const std::string& out, bool fill) const {
    CameraPath path;
    path.fps = 4;
    path.width_px = 80;
    path.height_px = 60;
    for (const std::size_t view : {3U, 4U}) {
      PathKey key;
      key.cam_from_world = capture_.scene.views[view].cam_from_world;
      key.vertical_fov_rad = 1.6;
      key.time_s = 0.5 * static_cast<double>(view - 3);
      path.keys.push_back(key);
    }
    RenderOptions o = Options(out, fill);
    o.path = folder_ / "path.json";
    WriteCameraPath(o.path, path);
    return o;
  }
  static FillJson Run(const RenderOptions& o) {
    const RenderSummary summary = RunRender(o, SilentProgress());
    return FillJson::parse(JsonKeys(summary).Text());
  }
  static bool Black(const Image8& image, int x, int y) {
    return image.At(x, y, 0) == 0 && image.At(x, y, 1) == 0 && image.At(x, y, 2) == 0;
  }
  // A pixel of a video is never quite black: it is compressed.
  static long DarkPixels(const Image8& image) {
    long n = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) n += image.At(x, y, 0) + image.At(x, y, 1) + image.At(x, y, 2) < 60;
    return n;
  }

  TemporaryFolder folder_;
  test::Capture capture_;
};

TEST_F(FillCommand, AFlyThroughHasNoHolesAndIsTheSameElsewhere) {
  for (const std::string backend : {"cpu", "gl"}) {
    RenderOptions with = WidePath(backend + "-fill", true), without = WidePath(backend, false);
    with.backend = without.backend = backend;
    FillJson summary;
    try {
      summary = Run(without);
    } catch (const MachineError&) {
      ASSERT_EQ(backend, "gl");
      GTEST_SKIP() << "no OpenGL 4.3 here: on the CPU it passed";
    }
    EXPECT_EQ(Run(with)["coverage"], summary["coverage"]) << "what is filled is not covered";
    long holes = 0, seen = 0;
    for (const char* frame : {"frames/frame_000000.png", "frames/frame_000001.png"}) {
      const Image8 filled = ReadImage8(with.output / frame, 4), as_it_is = ReadImage8(without.output / frame, 4);
      for (int y = 0; y < filled.height; ++y)
        for (int x = 0; x < filled.width; ++x) {
          const int alpha = as_it_is.At(x, y, 3);
          ASSERT_EQ(filled.At(x, y, 3), alpha) << "alpha says what the photos saw";
          ASSERT_FALSE(Black(filled, x, y)) << backend << ' ' << x << ' ' << y;
          if (alpha == 0) ++holes;
          if (alpha < 255) continue;
          ++seen;
          // Alpha within half a code value of 1 is 255, too.
          for (int c = 0; c < 3; ++c) ASSERT_NEAR(filled.At(x, y, c), as_it_is.At(x, y, c), 1) << x << ' ' << y;
        }
    }
    EXPECT_GT(holes, 1000);
    EXPECT_GT(seen, 1000);
  }
}

TEST_F(FillCommand, AVideoShowsTheFillAlsoWhereItsFramesWereThere) {
  RenderOptions o = WidePath("frames", true);
  for (const char* format : {"png", "exr", "jpg"}) {
    o.format = format;
    o.output = folder_ / format;
    o.video = true;
    Run(o);
    const Image8 rendered = VideoReader(o.output / "path.mp4").Next()->rgb;
    EXPECT_EQ(DarkPixels(rendered), 0) << format;
    ASSERT_EQ(Run(o)["frames_reused"], 2);
    // JPEG keeps colour at half the resolution.
    EXPECT_GT(Compare(rendered, VideoReader(o.output / "path.mp4").Next()->rgb).psnr_db, o.format == "jpg" ? 28 : 40)
        << format;
    o.border.fill = false;
    EXPECT_EQ(Run(o)["frames_reused"], 0) << "they were filled";
    EXPECT_GT(DarkPixels(VideoReader(o.output / "path.mp4").Next()->rgb), 500) << format;
    o.border.fill = true;
  }
}

TEST_F(FillCommand, AnErrorIsOfWhatPhotosSawAndAnEvaluationIsRefused) {
  RenderOptions own = Options("own", false), filled = Options("filled", true);
  own.view = filled.view = capture_.scene.views.front().name;
  own.leave_out = filled.leave_out = true;
  own.settings.k = filled.settings.k = 1;
  const FillJson a = Run(own), b = Run(filled);
  EXPECT_LT(a["coverage"], 1);
  EXPECT_EQ(a["views"], b["views"]);
  RenderOptions wrong = Options("wrong", true);
  wrong.holdout = 3;
  EXPECT_THROW(Run(wrong), UsageError);
  for (const char* show : {"false-color", "weights", "difference", "proxy"}) {
    wrong = filled;
    wrong.show = show;
    EXPECT_THROW(Run(wrong), UsageError) << show;
  }
  wrong = filled;
  wrong.decided = {"fill-frames"};
  EXPECT_THROW(Run(wrong), UsageError) << "a mesh is seen by all photos at once";
}

}  // namespace
}  // namespace lumi
