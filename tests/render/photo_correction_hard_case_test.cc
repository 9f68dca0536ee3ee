// White balance and vignetting where photos hardly say anything of them, or nothing.
#include <gtest/gtest.h>

#include <random>

#include "capture_with_tracks.h"
#include "render/effects/exposure.h"

namespace lumi {
namespace {

void ExpectNothingSaid(const Exposures& e, const std::string& what) {
  EXPECT_FALSE(e.white_balances.Differ()) << what << e.white_balances.spread;
  EXPECT_FALSE(e.vignetting.Seen()) << what << e.vignetting.corner;
  for (const auto& rgb : e.white_balances.of_view)
    for (const double value : rgb) EXPECT_TRUE(std::isfinite(value) && value > 0) << what;
  for (const RadialFalloff& falloff : e.vignetting.of_view) EXPECT_EQ(falloff, RadialFalloff()) << what;
  for (const Corrections c : {Corrections{}, {true, false}, {false, true}, {true, true}})
    for (const double gain : e.Gain(c)) EXPECT_TRUE(std::isfinite(gain) && gain > 0) << what;
}

// Points that every photo sees at one distance from its middle, but for `spread` of it: a corner's darkness is the
// photos' own, and less and less can be said of it.
TEST(PhotoCorrectionHardCase, PointsAtOneRadius) {
  constexpr int kPoints = 300, kPhotos = 6;
  constexpr double kFalloff = -0.4;
  for (double spread = 1; spread > 1e-16; spread /= 10) {
    std::mt19937 engine(4);
    std::uniform_real_distribution<double> u(-1, 1);
    std::normal_distribution<double> noise(0, 0.02);
    std::vector<ColorSample> samples;
    for (std::size_t p = 0; p < kPoints; ++p) {
      const double grey = 110 + 50 * u(engine);
      for (std::size_t v = 0; v < kPhotos; ++v) {
        const double r2 = 0.5 + 0.5 * spread * u(engine);
        const auto value = static_cast<float>(grey * std::exp(kFalloff * r2 + noise(engine)));
        samples.push_back({p, v, {value, value, value}, r2});
      }
    }
    const Vignetting found = EstimateVignetting(samples, std::vector<int>(kPhotos, 0));
    ASSERT_TRUE(std::isfinite(found.corner) && std::isfinite(found.noise)) << spread;
    if (spread == 1) {
      EXPECT_TRUE(found.Seen());
      // 1800 samples of 2 % over half of the range: a standard deviation of the corner's logarithm below 0.005.
      EXPECT_NEAR(std::log(found.corner), kFalloff, 0.015);
    }
    // What is said is the truth, or nothing: never a corner that is not there.
    if (found.Seen()) {
      EXPECT_NEAR(std::log(found.corner), kFalloff, -std::log(found.noise)) << spread;
    }
    if (spread < 1e-3) {
      EXPECT_FALSE(found.Seen()) << spread;
    }
  }
}

TEST(PhotoCorrectionHardCase, OnePhotoNoPointsNoPhotos) {
  test::Capture c = test::CaptureWithTracks();
  test::Capture one = c;
  one.scene.views.resize(1);
  one.photos.resize(1);
  for (Point& p : one.scene.points) std::erase_if(p.track, [](const Observation& o) { return o.view.value != 0; });
  ExpectNothingSaid(EstimateExposures(one.scene, one.photos), "one photo ");
  test::Capture unread = c;
  for (Photo& photo : unread.photos) photo.levels.clear();
  ExpectNothingSaid(EstimateExposures(unread.scene, unread.photos), "photos that are not there ");
  c.scene.points.clear();
  ExpectNothingSaid(EstimateExposures(c.scene, c.photos), "no points ");
  c.scene.views.clear();
  ExpectNothingSaid(EstimateExposures(c.scene, {}), "no views ");
}

TEST(PhotoCorrectionHardCase, GreyBlackAndClippedPhotos) {
  for (const std::uint8_t grey : {0, 1, 15, 16, 128, 240, 241, 255}) {
    test::Capture c = test::CaptureWithTracks();
    for (Photo& photo : c.photos)
      for (Image8& level : photo.levels) std::fill(level.data.begin(), level.data.end(), grey);
    ExpectNothingSaid(EstimateExposures(c.scene, c.photos), "grey " + std::to_string(grey) + " ");
  }
  // Photos without colour of a textured scene.
  test::Capture c = test::CaptureWithTracks();
  for (Photo& photo : c.photos) {
    Image8 image = photo.levels.front();
    for (std::size_t i = 0; i < image.data.size(); i += 3) image.data[i] = image.data[i + 2] = image.data[i + 1];
    photo.levels = BuildPyramid(image);
  }
  ExpectNothingSaid(EstimateExposures(c.scene, c.photos), "without colour ");
}

// Photos that get brighter towards their corners are no lens's: nothing is taken out of them.
TEST(PhotoCorrectionHardCase, BrighterCornersAreNoVignetting) {
  std::mt19937 engine(4);
  std::uniform_real_distribution<double> u(0, 1);
  std::vector<ColorSample> samples;
  for (std::size_t p = 0; p < 300; ++p)
    for (std::size_t v = 0; v < 6; ++v) {
      const double r2 = u(engine);
      const auto value = static_cast<float>((60 + 40 * std::sin(static_cast<double>(p))) * std::exp(0.3 * r2));
      samples.push_back({p, v, {value, value, value}, r2});
    }
  const Vignetting found = EstimateVignetting(samples, std::vector<int>(6, 0));
  EXPECT_FALSE(found.Seen());
  EXPECT_EQ(found.of_view.front(), RadialFalloff());
}

}  // namespace
}  // namespace lumi
