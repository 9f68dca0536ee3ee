#include <gtest/gtest.h>

#include "capture.h"
#include "render/show/camera_configuration.h"
#include "render/show/measure_map.h"
#include "render/show/proxy_picture.h"

namespace lumi {
namespace {

const test::Capture& Seen() {
  static const test::Capture capture = test::MakeCapture(9, 48);
  return capture;
}

RenderRequest OwnView(std::size_t view) {
  RenderRequest r;
  r.view = MakeRenderView(Seen().scene, Seen().scene.views[view]);
  return r;
}

TEST(MeasureMap, APhotosOwnViewIsAtNoAngleFromItAndWeighsAll) {
  const MeasureMap angle = RenderMeasureMap(Seen().scene, Seen().proxy, OwnView(4), *MeasureFromName("angle"), 4);
  EXPECT_EQ(angle.unit, "deg");
  EXPECT_LT(angle.high, 1e-6) << "every ray is the photo's own";
  const MeasureMap weight = RenderMeasureMap(Seen().scene, Seen().proxy, OwnView(4), *MeasureFromName("weights"), -1);
  EXPECT_EQ(weight.high, 1);
  // The scale's upper end, everywhere.
  for (int y = 0; y < weight.image.height; ++y)
    for (int x = 0; x < weight.image.width; ++x) {
      ASSERT_EQ(weight.image.At(x, y, 3), 1);
      ASSERT_GT(weight.image.At(x, y, 0), 0.9F) << "yellow";
      ASSERT_LT(weight.image.At(x, y, 2), 0.3F);
    }
}

TEST(ProxyPicture, FacesAreShadedByTheirSlopeAndBacksAreRed) {
  Mesh quad;
  quad.vertices = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}};
  quad.faces = {{0, 1, 2}, {0, 2, 3}};
  const auto look = [&](const Eigen::Vector3d& eye) {
    return DrawProxy(MakeSources(Seen().scene), quad,
                     MakeRenderView(Camera::Pinhole(33, 33, 400, 400, 16.5, 16.5), LookAt(eye, {0, 0, 0}, {0, 1, 0})));
  };
  const ImageF above = look({0, 0, 5}), slanted = look({5 * std::sin(1.0), 0, 5 * std::cos(1.0)}),
               below = look({0, 0, -5});
  EXPECT_NEAR(above.At(16, 16, 2), 0.90, 1e-3) << "the lamp shines straight on it";
  EXPECT_NEAR(slanted.At(16, 16, 2), 0.90 * (0.18 + 0.82 * std::cos(1.0)), 2e-3);
  EXPECT_NEAR(below.At(16, 16, 0), 0.85, 1e-3);
  EXPECT_NEAR(below.At(16, 16, 2), 0.33, 1e-3);
  EXPECT_EQ(above.At(16, 16, 3), 1);
  EXPECT_EQ(look({0, 0, 5000}).At(0, 0, 3), 0) << "beside it";
}

TEST(MeasureMap, AFarPhotoLosesItsPixelsSize) {
  test::Capture c = Seen();
  c.scene.views[2].cam_from_world = LookAt(2.2 * c.scene.views[2].CentreInWorld(), {0, 0, 0.5}, {0, -1, 0});
  const auto mean_green = [&](int source) {
    const MeasureMap m = RenderMeasureMap(c.scene, c.proxy, OwnView(3), *MeasureFromName("resolution"), source);
    double sum = 0, n = 0;
    for (int y = 0; y < m.image.height; ++y)
      for (int x = 0; x < m.image.width; ++x)
        if (m.image.At(x, y, 3) > 0) {
          sum += m.image.At(x, y, 1);
          ++n;
        }
    return n > 0 ? sum / n : 0;
  };
  EXPECT_LT(mean_green(2), 0.8 * mean_green(4)) << "viridis: green rises with the value";
}

TEST(MeasureMap, NamesAreThoseOfTheCommandLine) {
  EXPECT_EQ(HeatMaps()[MeasureFromName("visibility")->row].name, "visibility");
  EXPECT_EQ(MeasureFromName("color"), std::nullopt);
}

TEST(CameraConfiguration, EveryPanelHasTheVirtualViewThePhotosAndTheProxy) {
  constexpr int kSide = 200;
  const Image8 image = DrawCameraConfiguration(Seen().scene, Seen().proxy, OwnView(4).view, kSide);
  ASSERT_EQ(image.width, 3 * kSide);
  ASSERT_EQ(image.height, kSide);
  for (int panel = 0; panel < 3; ++panel) {
    int red = 0, blue = 0, white = 0;
    for (int y = 0; y < kSide; ++y)
      for (int x = panel * kSide; x < (panel + 1) * kSide; ++x) {
        const int r = image.At(x, y, 0), g = image.At(x, y, 1), b = image.At(x, y, 2);
        red += r > 180 && g < 90 && b < 90;
        blue += b > 170 && r < 110;
        white += r + g + b == 3 * 255;
      }
    EXPECT_GT(red, 20) << panel;
    EXPECT_GT(blue, 40) << panel;
    EXPECT_GT(white, kSide * kSide / 3) << panel;
  }
}

}  // namespace
}  // namespace lumi
