#include <gtest/gtest.h>

#include "capture.h"
#include "render/cpu/blend.h"
#include "render/picture/convert.h"
#include "render/world/renderer.h"
#include "scene/image_difference/image_difference.h"

namespace lumi {
namespace {

TEST(CpuRenderer, AConstantColourWorldRendersConstant) {
  const test::Capture c = test::MakeCapture(8, 64, std::array<std::uint8_t, 3>{200, 30, 90});
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const int k : {0, 1, 4, 9}) {
    RenderRequest request;
    request.settings.k = k;
    request.view = MakeRenderView(c.scene.cameras[0], LookAt({1.3, 0.4, -4.2}, {0.1, 0, 0.5}, {0, -1, 0}));
    const ImageF image = renderer->Render(request);
    int seen = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const float a = image.At(x, y, 3);
        if (a == 0) continue;
        ++seen;
        ASSERT_NEAR(image.At(x, y, 0) / a, 200 / 255.0, 1e-5);
        ASSERT_NEAR(image.At(x, y, 1) / a, 30 / 255.0, 1e-5);
        ASSERT_NEAR(image.At(x, y, 2) / a, 90 / 255.0, 1e-5);
      }
    EXPECT_GT(seen, 3000);
  }
}

TEST(CpuRenderer, APhotosOwnViewGivesThePhotoBackToItsBorders) {
  const test::Capture c = test::MakeCapture(8, 96);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (std::size_t i = 0; i < c.scene.views.size(); ++i) {
    RenderRequest request;
    request.view = MakeRenderView(c.scene, c.scene.views[i]);
    const ImageF image = renderer->Render(request);
    ASSERT_NEAR(Coverage(image), 1, 1e-9);
    const ImageDifference d = Compare(ToRgb8(image), c.photos[i].levels[0]);
    EXPECT_LT(d.mean_absolute, 0.02) << c.scene.views[i].name;
  }
}

// Borders painted in another colour: whatever is read from outside a photo has it.
TEST(CpuRenderer, TheOptimumWithAFinitePenaltyReadsNothingFromOutsideAPhoto) {
  test::Capture c = test::MakeCapture(8, 64, std::array<std::uint8_t, 3>{90, 90, 90});
  for (Photo& photo : c.photos)
    for (Image8& level : photo.levels)
      for (int y = 0; y < level.height; ++y)
        for (int x = 0; x < level.width; ++x)
          if (x == 0 || y == 0 || x == level.width - 1 || y == level.height - 1) level.At(x, y, 0) = 255;
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  RenderRequest request;
  request.settings.similarity = Similarity::kFull;
  request.settings.correlation = Correlation::kFallingLeaves;
  request.settings.combine = Combine::kAdditive;
  request.settings.gamma = 0.1;
  request.settings.r_max_rad = 0.5;
  request.settings.prefilter = false;
  request.view = MakeRenderView(c.scene.cameras[0], LookAt({2.2, 0.4, -4.6}, {1.9, 0, 0.5}, {0, -1, 0}));
  const ImageF image = renderer->Render(request);
  int seen = 0, tinted = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float a = image.At(x, y, 3);
      if (!(a > 0.5F)) continue;
      ++seen;
      tinted += image.At(x, y, 0) / a > 1.2F * 90 / 255;
    }
  EXPECT_GT(seen, 1500);
  // The borders themselves: eight of them, each over two pixels or so. What lies beyond them is a third of the picture.
  EXPECT_LT(tinted, seen / 6);
}

TEST(CpuRenderer, AHeldOutViewWithTheTrueProxyIsClose) {
  const test::Capture c = test::MakeCapture(13, 128);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  RenderRequest request;
  request.view = MakeRenderView(c.scene, c.scene.views[6]);
  request.use.assign(13, true);
  request.use[6] = false;
  const ImageDifference d = Compare(ToRgb8(renderer->Render(request)), c.photos[6].levels[0]);
  // Occlusion edges and resampling remain; a pixel's shift of this texture would cost 10 dB.
  EXPECT_GT(d.psnr_db, 28);
}

TEST(CpuRenderer, FalseColourShowsOneCameraAtItsOwnView) {
  const test::Capture c = test::MakeCapture(5, 32);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  RenderRequest request;
  request.view = MakeRenderView(c.scene, c.scene.views[3]);
  request.show = Show::kFalseColor;
  const ImageF image = renderer->Render(request);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(image.At(16, 12, k), SourceColor(3)[k], 1e-6);
}

TEST(CpuRenderer, TheSameBytesWhateverTheThreads) {
  const test::Capture c = test::MakeCapture(7, 160);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  RenderRequest request;
  request.view = MakeRenderView(c.scene.cameras[0], LookAt({1, 0.2, -4}, {0, 0, 0.5}, {0, -1, 0}));
  const ImageF a = renderer->Render(request), b = renderer->Render(request);
  EXPECT_EQ(a.data, b.data);
}

TEST(SourceColor, NeighboursAreDistinct) {
  for (int i = 0; i < 300; ++i)
    for (int j = i + 1; j < std::min(300, i + 8); ++j)
      EXPECT_GT((SourceColor(i) - SourceColor(j)).norm(), 0.15F) << i << " " << j;
}

TEST(SamplePhoto, PixelCentresBordersAndLevels) {
  Image8 image(4, 2, 3);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 2; ++y)
      for (int c = 0; c < 3; ++c) image.At(x, y, c) = static_cast<std::uint8_t>(10 * x + 100 * y);
  Photo photo;
  photo.levels = BuildPyramid(image);
  EXPECT_NEAR(SamplePhoto(photo, 1.5F / 4, 0.5F / 2, 0)[0], 10, 1e-5);
  EXPECT_NEAR(SamplePhoto(photo, 2.0F / 4, 0.5F / 2, 0)[0], 15, 1e-5);
  EXPECT_NEAR(SamplePhoto(photo, -3.0F / 4, 0.5F / 2, 0)[0], 0, 1e-5);  // clamped, never from outside
  EXPECT_NEAR(SamplePhoto(photo, 9.0F / 4, 9.0F / 2, 0)[0], 130, 1e-5);
  EXPECT_NEAR(SamplePhoto(photo, 1.0F / 4, 1.0F / 2, 1)[0], 55, 1);  // mean of the first four pixels
}

}  // namespace
}  // namespace lumi
