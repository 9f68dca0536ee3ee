// Effects do what their numbers say, and nothing at all when they are not asked for.
#include <gtest/gtest.h>

#include <cmath>

#include "simulate/photo_response.h"
#include "tests/simulate/small_scene.h"

namespace lumi {
namespace {

constexpr int kWidth = 96, kHeight = 72;
constexpr long kPixels = static_cast<long>(kWidth) * kHeight;

// A white wall's edge at x = 0 before black, seen from 2 units away while the camera moves sideways at 1 unit a second.
std::string EdgeScene(const std::string& effects) {
  return R"({"cameras": [{"size": [96, 72], "fov_deg": 60}],
    "path": {"kind": "drive", "views": 61, "fps": 30, "from": [-1, -2, 0], "to": [1, -2, 0], "direction": [0, 1, 0]},
    "materials": [{"name": "white", "color": [1, 1, 1], "lit": false}],
    "objects": [{"kind": "box", "size": [10, 0.1, 10], "position": [5, 0.05, 0], "material": "white"}])" +
         (effects.empty() ? "" : ", \"effects\": " + effects) + "}";
}

std::string ConstantScene(const std::string& effects) {
  return R"({"cameras": [{"size": [96, 72], "fov_deg": 60}],
    "path": {"kind": "wave", "views": 61, "fps": 30, "centre": [0, 0, 0]},
    "background": {"color": "#646464"})" +
         (effects.empty() ? "" : ", \"effects\": " + effects) + "}";
}
constexpr int kGrey = 0x64;

constexpr std::size_t kMiddle = 30;
constexpr double kFocalPx = 0.5 * kWidth * 1.7320508075688772;
constexpr double kPxPerUnit = kFocalPx / 2;

TEST(Effects, OffTheyCostNothingAndChangeNothing) {
  const SmallScene without(EdgeScene(""));
  const SmallScene zeros(EdgeScene(R"({"skew_px": 0, "noise_sigma": 0, "motion_blur_s": 0, "rolling_shutter_s": 0,
                                       "exposure_stops": 0, "white_balance_stops": 0, "vignetting": 0})"));
  EXPECT_TRUE(EffectsOn(without.description).empty());
  EXPECT_TRUE(EffectsOn(zeros.description).empty());
  TraceCounters a, b;
  const RenderedView first = without.Render(kMiddle, &a), second = zeros.Render(kMiddle, &b);
  EXPECT_EQ(first.photo.data, second.photo.data);
  EXPECT_EQ(first.depth.data, second.depth.data);
  for (const TraceCounters& c : {a, b}) {
    EXPECT_EQ(c.rays, kPixels * (4 + 1));  // four samples and the depth's
    EXPECT_EQ(c.poses, 1);
    EXPECT_EQ(c.noise_draws, 0);
  }
}

TEST(Effects, EachCostsOnlyItsOwn) {
  TraceCounters noise, rolling, blur, lens;
  SmallScene(EdgeScene(R"({"noise_sigma": 2})")).Render(kMiddle, &noise);
  SmallScene(EdgeScene(R"({"rolling_shutter_s": 0.02})")).Render(kMiddle, &rolling);
  SmallScene(EdgeScene(R"({"motion_blur_s": 0.02})")).Render(kMiddle, &blur);
  SmallScene(EdgeScene(R"({"vignetting": 0.4, "exposure_stops": 0.5, "skew_px": 2})")).Render(kMiddle, &lens);
  EXPECT_EQ(noise.noise_draws, 3 * kPixels);
  EXPECT_EQ(noise.rays, kPixels * 5);
  EXPECT_EQ(noise.poses, 1);
  EXPECT_EQ(rolling.poses, kHeight);
  EXPECT_EQ(rolling.rays, kPixels * 5);
  EXPECT_EQ(blur.poses, 17);
  EXPECT_EQ(blur.rays, kPixels * 17);
  EXPECT_EQ(lens.poses, 1);
  EXPECT_EQ(lens.rays, kPixels * 5);
  EXPECT_EQ(lens.noise_draws, 0);
}

TEST(Effects, AreNamedWhereTheyAreOn) {
  const SmallScene scene(
      R"({"cameras": [{"size": [8, 6], "fov_deg": 60, "model": "SIMPLE_RADIAL", "distortion": [0.1]}],
    "path": {"kind": "ring", "radius": 1}, "materials": [{"name": "m"}],
    "objects": [{"kind": "sphere", "radius": 0.2, "material": "m", "spin": {"period_s": 2}}],
    "effects": {"noise_sigma": 1, "vignetting": 0.2}})");
  EXPECT_EQ(EffectsOn(scene.description),
            (std::vector<std::string>{"lens_distortion", "noise", "vignetting", "moving_parts"}));
}

TEST(Effects, NoiseHasItsSigma) {
  const Image8 photo = SmallScene(ConstantScene(R"({"noise_sigma": 4})")).Render(kMiddle).photo;
  double sum = 0, sum2 = 0;
  for (const std::uint8_t value : photo.data) sum += value - kGrey, sum2 += (value - kGrey) * (value - kGrey);
  const double n = static_cast<double>(photo.data.size());
  // 20736 draws: the mean is known to 0.03, the deviation to half a percent; rounding adds 1/12 to the variance.
  EXPECT_NEAR(sum / n, 0, 0.12);
  EXPECT_NEAR(std::sqrt(sum2 / n), std::sqrt(16 + 1.0 / 12), 0.08);
}

TEST(Effects, VignettingDarkensTheCornersByItsShare) {
  const Image8 photo = SmallScene(ConstantScene(R"({"vignetting": 0.5})")).Render(kMiddle).photo;
  EXPECT_NEAR(photo.At(kWidth / 2, kHeight / 2, 0), kGrey, 1);
  const double corner = kGrey * CodeFromLight(0.5);
  EXPECT_NEAR(photo.At(0, 0, 0), corner, 1.5);
  EXPECT_NEAR(photo.At(kWidth - 1, kHeight - 1, 2), corner, 1.5);
}

TEST(Effects, ExposureDriftIsTheGainOfTheView) {
  const SmallScene scene(ConstantScene(R"({"exposure_stops": 0.5, "exposure_period_s": 4})"));
  const TrueCamera truth = scene.renderer.CameraOf(scene.views[kMiddle]);  // at 1 s: the peak
  EXPECT_NEAR(truth.gain, std::exp2(0.5 / kGamma), 1e-12);
  EXPECT_EQ(scene.Render(kMiddle).photo.At(5, 5, 1), std::lround(kGrey * truth.gain));
  EXPECT_EQ(scene.renderer.CameraOf(scene.views[0]).gain, 1);
}

TEST(Effects, WhiteBalanceDriftsBetweenRedAndBlue) {
  const SmallScene scene(ConstantScene(R"({"white_balance_stops": 0.2, "white_balance_period_s": 4})"));
  const TrueCamera truth = scene.renderer.CameraOf(scene.views[kMiddle]);  // at 1 s: the peak
  EXPECT_NEAR(truth.white_balance[0], std::exp2(0.2 / kGamma), 1e-12);
  EXPECT_EQ(truth.white_balance[1], 1);
  EXPECT_NEAR(truth.white_balance[0] * truth.white_balance[2], 1, 1e-12);
  const Image8 photo = scene.Render(kMiddle).photo;
  for (int c = 0; c < 3; ++c)
    EXPECT_EQ(photo.At(5, 5, c), std::lround(kGrey * truth.white_balance[static_cast<std::size_t>(c)])) << c;
  EXPECT_EQ(scene.renderer.CameraOf(scene.views[0]).white_balance[0], 1);
}

TEST(Effects, SkewIsThatOfTheCalibrationMatrix) {
  const Camera camera = Camera::Pinhole(640, 480, 500, 510, 321, 243);
  constexpr double kSkewPx = 7;
  Eigen::Matrix3d K = camera.K();
  K(0, 1) = kSkewPx;
  for (const Eigen::Vector2d& x : {Eigen::Vector2d(0.3, -0.4), Eigen::Vector2d(-0.5, 0.2), Eigen::Vector2d(0, 0)}) {
    const Eigen::Vector2d x_px = (K * x.homogeneous()).hnormalized();
    const auto back = NormalizedWithSkew(camera, kSkewPx, x_px);
    ASSERT_TRUE(back);
    EXPECT_LT((*back - x).norm(), 1e-14);
  }
}

// Where the wall begins in a row: x of the edge in pixels, from how much of the row is white.
double EdgePx(const Image8& photo, int y) {
  double light = 0;
  for (int x = 0; x < photo.width; ++x) light += LightFromCode(photo.At(x, y, 0) / 255.0);
  return photo.width - light;
}

TEST(Effects, RollingShutterMovesRowsByTheirTime) {
  constexpr double kReadoutS = 0.2;
  const Image8 photo = SmallScene(EdgeScene(R"({"rolling_shutter_s": 0.2})")).Render(kMiddle).photo;
  const double middle = 0.5 * kWidth;  // at the middle of the exposure the camera is at x = 0
  for (const int y : {0, 10, 35, 60, kHeight - 1}) {
    const double time_s = kReadoutS * ((y + 0.5) / kHeight - 0.5);
    // Edges of two samples a pixel are known to a quarter of a pixel.
    EXPECT_NEAR(EdgePx(photo, y), middle - time_s * kPxPerUnit, 0.26) << y;
  }
}

TEST(Effects, MotionBlurIsAsLongAsTheWayDuringTheExposure) {
  const Image8 photo = SmallScene(EdgeScene(R"({"motion_blur_s": 0.3})")).Render(kMiddle).photo;
  const double length = 0.3 * kPxPerUnit * 15 / 16;  // from the first of sixteen moments to the last
  int between = 0;
  for (int x = 0; x < kWidth; ++x) between += photo.At(x, 36, 0) > 0 && photo.At(x, 36, 0) < 255 ? 1 : 0;
  EXPECT_NEAR(between, length, 2.0);  // a pixel at either end
  EXPECT_NEAR(EdgePx(photo, 36), 0.5 * kWidth, 0.5);
}

TEST(Effects, MotionBlurMayTakeOnePhotoInSeveral) {
  const SmallScene scene(EdgeScene(R"({"motion_blur_s": 0.3, "motion_blur_every": 3})"));
  const SmallScene sharp(EdgeScene(""));
  for (std::size_t v = kMiddle; v < kMiddle + 3; ++v) {
    TraceCounters count;
    const RenderedView view = scene.Render(v, &count);
    const auto [low_px, median_px, high_px] = scene.renderer.BlurPx(scene.views[v], view.depth);
    if (v % 3 == 1) {
      EXPECT_EQ(count.poses, 17) << v;
      // All of the wall is at one distance.
      for (const double px : {low_px, median_px, high_px}) EXPECT_NEAR(px, 0.3 * kPxPerUnit, 0.1) << v;
    } else {
      EXPECT_EQ(view.photo.data, sharp.Render(v).photo.data) << v;
      EXPECT_EQ(count.rays, kPixels * 5) << v;
      EXPECT_EQ(high_px, 0) << v;
    }
  }
}

TEST(Effects, AMovingPartComesBackAfterItsPeriod) {
  const SmallScene scene(R"({"cameras": [{"size": [96, 72], "fov_deg": 60}],
    "path": {"kind": "poses", "fps": 4, "poses": [{"eye": [0, -3, 0], "target": [0, 0, 0]}, {"eye": [0, -3, 0], "target": [0, 0, 0]},
             {"eye": [0, -3, 0], "target": [0, 0, 0]}, {"eye": [0, -3, 0], "target": [0, 0, 0]}, {"eye": [0, -3, 0], "target": [0, 0, 0]}]},
    "materials": [{"name": "m"}],
    "objects": [{"kind": "box", "size": [0.4, 0.4, 0.4], "position": [0.5, 0, 0], "material": "m",
                 "spin": {"axis": [0, 1, 0], "centre": [0, 0, 0], "period_s": 1}}]})");
  const RenderedView start = scene.Render(0), quarter = scene.Render(1), half = scene.Render(2), full = scene.Render(4);
  EXPECT_EQ(start.photo.data, full.photo.data);
  EXPECT_EQ(start.silhouette.At(64, 36, 0), 255);
  EXPECT_EQ(half.silhouette.At(64, 36, 0), 0);
  EXPECT_EQ(half.silhouette.At(31, 36, 0), 255);
  EXPECT_NE(start.photo.data, quarter.photo.data);
  // From x to -z within a quarter of a turn about y: below the middle of the picture.
  EXPECT_EQ(quarter.silhouette.At(48, 36 + 12, 0), 255);
}

}  // namespace
}  // namespace lumi
