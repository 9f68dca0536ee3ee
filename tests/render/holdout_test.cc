#include "render/holdout/holdout.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "capture.h"
#include "render/time/clock.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

struct OnDisk {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("lumi-holdout-test-" + std::to_string(::getpid()));
  test::Capture capture;
  explicit OnDisk(int views) : capture(test::MakeCapture(views, 64)) {
    capture.scene.image_folder = folder;
    for (std::size_t i = 0; i < capture.photos.size(); ++i)
      WriteImage(folder / capture.scene.views[i].name, capture.photos[i].levels[0]);
  }
  ~OnDisk() { std::filesystem::remove_all(folder); }
};

TEST(Holdout, BeatsTheNearestPhotoAndUsesNoHeldOutOne) {
  OnDisk d(17);
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  HoldoutOptions options;
  options.folder = d.folder / "out";
  const HoldoutSummary s = EvaluateHoldout(d.capture.scene, *renderer, options, SilentProgress());
  ASSERT_EQ(s.views.size(), 3u);
  EXPECT_EQ(s.views[1].name, "view108.png");
  EXPECT_GT(s.mean.psnr_db, s.nearest_mean.psnr_db);
  for (const HoldoutView& v : s.views) {
    EXPECT_NE(v.nearest_name, v.name);
    EXPECT_LT(v.psnr_db, 60) << "the held-out photo itself was used";
    EXPECT_TRUE(
        std::filesystem::exists(options.folder / (std::filesystem::path(v.name).stem().string() + "_render.jpg")));
  }
}

TEST(Holdout, TheChoosingFoldDoesNotSeeTheReportingOne) {
  OnDisk d(17);
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  HoldoutOptions options;
  options.fold = Fold::kChoose;
  const HoldoutSummary s = EvaluateHoldout(d.capture.scene, *renderer, options, SilentProgress());
  ASSERT_EQ(s.views.size(), 2u);
  EXPECT_EQ(s.views[0].name, "view104.png");
  for (const HoldoutView& v : s.views) {
    EXPECT_NE(v.nearest_name, "view100.png");
    EXPECT_NE(v.nearest_name, "view108.png");
  }
}

// A copy under another name, which is in no fold: it must not help.
TEST(Holdout, ACopyOfAHeldOutPhotoIsHeldOutWithIt) {
  OnDisk d(17);
  test::Capture& c = d.capture;
  const auto views_of = [&] {
    const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
    return EvaluateHoldout(c.scene, *renderer, {}, SilentProgress()).views;
  };
  const std::vector<HoldoutView> alone = views_of();
  View copy = c.scene.views[8];
  copy.name = "view999.png";
  c.scene.views.push_back(copy);
  c.photos.push_back(c.photos[8]);
  const std::vector<HoldoutView> with_copy = views_of();
  ASSERT_EQ(with_copy.size(), alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(with_copy[i].psnr_db, alone[i].psnr_db);
    EXPECT_EQ(with_copy[i].nearest_name, alone[i].nearest_name);
  }
  EXPECT_FALSE(PhotosWithout(c.scene, 8, Fold::kReport)[17]);
  EXPECT_TRUE(PhotosWithout(c.scene, 7, Fold::kReport)[17]) << "there, neither is held out";
}

TEST(Holdout, SmallerPicturesAreComparedWithSmallerPhotosAndPrefilteringPays) {
  OnDisk d(9);
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  HoldoutOptions options;
  options.width_px = 16;
  options.fold = Fold::kChoose;  // the middle of the arc: the ends would be dominated by what nobody saw
  const double prefiltered = EvaluateHoldout(d.capture.scene, *renderer, options, SilentProgress()).mean.psnr_db;
  options.settings.prefilter = false;
  const double aliased = EvaluateHoldout(d.capture.scene, *renderer, options, SilentProgress()).mean.psnr_db;
  EXPECT_GT(prefiltered, aliased + 1);
}

TEST(Holdout, APhotoTakenDarkerIsComparedAtItsOwnExposure) {
  constexpr int kHeldOut = 8;
  HoldoutOptions options;
  options.settings.exposure = true;
  OnDisk d(17);
  const auto as_taken = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  const double psnr_db = EvaluateHoldout(d.capture.scene, *as_taken, options, SilentProgress()).views[1].psnr_db;
  Image8 dark = d.capture.photos[kHeldOut].levels[0];
  for (auto& value : dark.data) value = static_cast<std::uint8_t>(value / 2);
  WriteImage(d.folder / d.capture.scene.views[kHeldOut].name, dark);
  d.capture.scene.views[kHeldOut].gain = 0.5;
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  // Half the code values, half the error: 6 dB more, less what rounding takes.
  EXPECT_GT(EvaluateHoldout(d.capture.scene, *renderer, options, SilentProgress()).views[1].psnr_db, psnr_db + 3);
}

TEST(Holdout, TheObjectIsMeasuredApartWhereItHasASilhouette) {
  OnDisk d(17);
  d.capture.scene.folder = d.folder;
  const Image8& photo = d.capture.photos[8].levels[0];
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  Image8 mask(photo.width, photo.height, 1);
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) mask.At(x, y, 0) = 255;
  const std::string name = d.capture.scene.views[8].name;
  WriteImage(d.folder / "silhouettes" / (name + ".png"), mask);
  HoldoutSummary s = EvaluateHoldout(d.capture.scene, *renderer, {}, SilentProgress());
  ASSERT_TRUE(s.views[1].psnr_object_db && s.mean.psnr_object_db);
  EXPECT_FALSE(s.views[0].psnr_object_db);
  EXPECT_NEAR(*s.views[1].psnr_object_db, s.views[1].psnr_db, 1e-9) << "a mask of everything";
  EXPECT_NEAR(*s.mean.psnr_object_db, s.views[1].psnr_db, 1e-9);
  EXPECT_NEAR(*s.views[1].nearest.psnr_object_db, s.views[1].nearest.psnr_db, 1e-9);
  for (int x = 0; x < mask.width / 2; ++x)
    for (int y = 0; y < mask.height; ++y) mask.At(x, y, 0) = 0;
  WriteImage(d.folder / "silhouettes" / (name + ".png"), mask);
  s = EvaluateHoldout(d.capture.scene, *renderer, {}, SilentProgress());
  EXPECT_GT(std::abs(*s.views[1].psnr_object_db - s.views[1].psnr_db), 1e-3) << "half the picture";
}

TEST(Holdout, SeenPixelsAreMeasuredApartForRenderAndBaseline) {
  OnDisk d(17);
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  HoldoutOptions options;
  const auto evaluate = [&](const std::function<Image8(const RenderView&, const std::vector<bool>&)>& seen) {
    return EvaluateHoldout(
        d.capture.scene,
        [&](ViewId) {
          return HoldoutRenderer{renderer.get(), seen};
        },
        options, SilentProgress());
  };
  const auto columns = [&](int first) {
    return [&, first](const RenderView& view, const std::vector<bool>& use) {
      EXPECT_EQ(std::ranges::count(use, false), 3) << "the photos that the render was made of";
      Image8 mask(view.size_px.x(), view.size_px.y(), 1);
      for (int y = 0; y < mask.height; ++y)
        for (int x = first; x < mask.width; ++x) mask.At(x, y, 0) = 255;
      return mask;
    };
  };
  const HoldoutSummary all = evaluate(columns(0));
  ASSERT_TRUE(all.mean.psnr_seen_db && all.seen);
  EXPECT_EQ(*all.seen, 1);
  for (const HoldoutView& v : all.views) {
    EXPECT_NEAR(*v.psnr_seen_db, v.psnr_db, 1e-9) << "a mask of everything";
    EXPECT_NEAR(*v.nearest.psnr_seen_db, v.nearest.psnr_db, 1e-9);
  }
  const HoldoutSummary half = evaluate(columns(32));
  EXPECT_EQ(*half.seen, 0.5);
  EXPECT_EQ(half.mean.psnr_db, all.mean.psnr_db);
  EXPECT_EQ(half.mean.ssim, all.mean.ssim);
  EXPECT_NE(*half.mean.psnr_seen_db, *all.mean.psnr_seen_db);
  const HoldoutSummary none = evaluate(columns(64));
  EXPECT_EQ(*none.seen, 0);
  EXPECT_FALSE(none.mean.psnr_seen_db || none.views[0].psnr_seen_db || none.nearest_mean.psnr_seen_db);
  EXPECT_FALSE(evaluate({}).seen) << "nobody asked";
}

TEST(Holdout, WhereTimeCountsTheNearestPhotoIsNearInTimeToo) {
  test::Capture capture = test::MakeCapture(17, 64);
  Scene& scene = capture.scene;
  for (std::size_t i = 0; i < scene.views.size(); ++i) scene.views[i].time_s = 1e6 + 0.5 * static_cast<double>(i);
  scene.views[9].time_s = *scene.views[8].time_s + 0.5;  // half a period away, and one to the left whole periods away
  scene.views[6].time_s = *scene.views[8].time_s + 7;
  std::vector<bool> use(scene.views.size(), true);
  use[8] = use[7] = false;
  RadianceSettings s;
  EXPECT_EQ(NearestPhoto(scene, {8}, use, s).value, 9);
  s.time = true;
  s.time_window_s = 0.05;
  s.period_s = 1;
  EXPECT_EQ(NearestPhoto(scene, {8}, use, s).value, 6);
}

TEST(TakeClock, APeriodAsksForAWindowOfTwoFramesUnlessTheUserSpoke) {
  Scene scene;
  scene.views.resize(40);
  for (std::size_t i = 0; i < 40; ++i) scene.views[i].time_s = 1e6 + static_cast<double>(i) / 25;
  RadianceSettings s;
  TakeClock(scene, false, s);
  EXPECT_EQ(s.time_window_s, RadianceSettings().time_window_s) << "no period";
  scene.period_s = 0.6;
  TakeClock(scene, true, s);
  EXPECT_EQ(s.time_window_s, RadianceSettings().time_window_s);
  EXPECT_EQ(s.period_s, 0.6);
  TakeClock(scene, false, s);
  EXPECT_NEAR(s.time_window_s, 2.0 / 25, 1e-9);
  scene.period_s = 0.1;
  TakeClock(scene, false, s);
  EXPECT_NEAR(s.time_window_s, 0.025, 1e-9) << "a quarter of the period at most";
}

TEST(TakeClock, SeveralCamerasAtOnceAskForAWindowOfTwoFrames) {
  Scene scene;
  for (int camera = 0; camera < 6; ++camera)
    for (int frame = 0; frame < 30; ++frame) {
      View v;
      v.time_s = frame / 30.0 + (camera % 2 == 0 ? 0 : 1e-12);  // rounding
      scene.views.push_back(v);
    }
  RadianceSettings s;
  TakeClock(scene, false, s);
  EXPECT_NEAR(s.time_window_s, 2.0 / 30, 1e-9);
  EXPECT_TRUE(ClockOf(scene).several_at_once);
  // One camera, though it stopped twice in between, is one camera.
  scene.views.resize(30);
  for (int i = 0; i < 30; ++i)
    scene.views[static_cast<std::size_t>(i)].time_s = i / 30.0 + (i > 9 ? 5 : 0) + (i > 19 ? 5 : 0);
  EXPECT_FALSE(ClockOf(scene).several_at_once);
  EXPECT_NEAR(ClockOf(scene).frame_s, 1 / 30.0, 1e-9);
  for (View& v : scene.views) v.time_s = 7;
  EXPECT_EQ(ClockOf(scene).frame_s, 0) << "all at one moment";
  EXPECT_EQ(ClockOf({}).frame_s, 0);
}

TEST(Holdout, OnePhotoCannotBeHeldOut) {
  OnDisk d(1);
  const auto renderer = MakeCpuRenderer(WorldOf(d.capture.scene, d.capture.proxy), d.capture.photos);
  EXPECT_THROW(EvaluateHoldout(d.capture.scene, *renderer, {}, SilentProgress()), DataError);
}

}  // namespace
}  // namespace lumi
