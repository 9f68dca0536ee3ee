// White balance and vignetting: estimated from photos of one scene's points, taken out of photos, given back.
#include "render/photos/photo_correction.h"

#include <gtest/gtest.h>

#include "capture_with_tracks.h"
#include "render/effects/exposure.h"

namespace lumi {
namespace {

constexpr double kShareLost = 0.4;
// Of a factor: code values are whole numbers, and a bilinear sample of a drawn texture errs by a few of them; some
// hundred samples a photo leave less than a hundredth.
constexpr double kNearFactor = 0.01;
// The corner's own brightness is seen by few points: most lie within 0.8 of the way.
constexpr double kNearCorner = 0.03;

// The photos' ratio of a channel to green, mean 1 over the photos.
std::vector<double> TrueRatios(std::size_t photos, std::size_t channel) {
  std::vector<double> ratio;
  double mean = 0;
  for (std::size_t v = 0; v < photos; ++v) {
    ratio.push_back(test::Drifted(v)[channel] / test::Drifted(v)[1]);
    mean += std::log(ratio.back()) / static_cast<double>(photos);
  }
  for (double& r : ratio) r /= std::exp(mean);
  return ratio;
}

TEST(PhotoCorrection, PhotosOfOneCameraAsItIsCallForNone) {
  const test::Capture c = test::CaptureWithTracks();
  const Exposures e = EstimateExposures(c.scene, c.photos);
  EXPECT_FALSE(e.white_balances.Differ()) << e.white_balances.spread;
  EXPECT_FALSE(e.vignetting.Seen()) << e.vignetting.corner;
}

TEST(PhotoCorrection, WhiteBalancesComeBackFromThePhotos) {
  test::Capture c = test::CaptureWithTracks();
  for (std::size_t v = 0; v < c.photos.size(); ++v) test::ShowAs(test::Drifted(v), 0, c.photos[v]);
  const Exposures e = EstimateExposures(c.scene, c.photos);
  EXPECT_TRUE(e.white_balances.Differ());
  EXPECT_FALSE(e.vignetting.Seen()) << e.vignetting.corner;
  for (const std::size_t channel : {0U, 2U}) {
    const std::vector<double> truth = TrueRatios(c.photos.size(), channel);
    for (std::size_t v = 0; v < truth.size(); ++v) {
      const auto& rgb = e.white_balances.of_view[v];
      EXPECT_NEAR(rgb[channel] / rgb[1], truth[v], kNearFactor) << v << " channel " << channel;
      EXPECT_NEAR(rgb[0] * rgb[1] * rgb[2], 1, 1e-9);
    }
  }
}

TEST(PhotoCorrection, VignettingComesBackFromThePhotos) {
  test::Capture c = test::CaptureWithTracks();
  for (Photo& photo : c.photos) test::ShowAs({1, 1, 1}, kShareLost, photo);
  const Exposures e = EstimateExposures(c.scene, c.photos);
  EXPECT_FALSE(e.white_balances.Differ()) << e.white_balances.spread;
  ASSERT_TRUE(e.vignetting.Seen()) << e.vignetting.corner << " noise " << e.vignetting.noise;
  for (const RadialFalloff& falloff : e.vignetting.of_view) {
    for (const double r2 : {0.1, 0.3, 0.5})
      EXPECT_NEAR(falloff.At(r2), test::LensFalloff(kShareLost, r2), kNearFactor) << r2;
    EXPECT_NEAR(falloff.Corner(), test::LensFalloff(kShareLost, 1), kNearCorner);
  }
}

TEST(PhotoCorrection, ExposureWhiteBalanceAndVignettingAreToldApart) {
  test::Capture c = test::CaptureWithTracks();
  const auto gain = [](std::size_t v) { return std::exp(0.1 * std::cos(3.0 * static_cast<double>(v))); };
  double mean = 0;
  for (std::size_t v = 0; v < c.photos.size(); ++v) {
    std::array<double, 3> factor = test::Drifted(v);
    for (double& f : factor) f *= gain(v) / 0.9 * 0.8;
    test::ShowAs(factor, kShareLost, c.photos[v]);
    mean += std::log(gain(v)) / static_cast<double>(c.photos.size());
  }
  const Exposures e = EstimateExposures(c.scene, c.photos);
  EXPECT_TRUE(e.Differ() && e.white_balances.Differ() && e.vignetting.Seen());
  const std::vector<double>& found = e.Gain({true, true});
  // Green's share of a photo's drift is in its gain: a geometric mean of 1 over the channels has it at 1.
  for (std::size_t v = 0; v < found.size(); ++v) EXPECT_NEAR(found[v], gain(v) / std::exp(mean), 0.02) << v;
}

// Twelve kinds of light, of which some are seen: corrected photos agree with one another, and no value was too bright.
TEST(PhotoCorrection, CorrectedPhotosAgreeAndLoseNoHighlight) {
  test::Capture c = test::CaptureWithTracks();
  for (std::size_t v = 0; v < c.photos.size(); ++v) test::ShowAs(test::Drifted(v), kShareLost, c.photos[v]);
  const Exposures e = EstimateExposures(c.scene, c.photos);
  Apply(e, {true, true}, c.scene);
  for (std::size_t v = 0; v < c.photos.size(); ++v) {
    const PhotoCorrection& k = *c.scene.views[v].correction;
    for (const double channel : k.channel) {
      EXPECT_LE(channel, 1);
      EXPECT_LE(channel / k.falloff.Corner(), 1 + 1e-12);
    }
    EXPECT_NEAR(c.scene.views[v].gain, e.Gain({true, true})[v] * k.scale, 1e-12);
    Image8 image = c.photos[v].levels.front();
    Correct(k, image);
    c.photos[v].levels = BuildPyramid(image);
    c.scene.views[v].correction.reset();
  }
  const Exposures after = EstimateExposures(c.scene, c.photos);
  EXPECT_FALSE(after.white_balances.Differ()) << after.white_balances.spread;
  EXPECT_FALSE(after.vignetting.Seen()) << after.vignetting.corner;
}

TEST(PhotoCorrection, WhatIsGivenBackIsThePhoto) {
  const test::Capture c = test::MakeCapture(1, 64);
  const Image8& photo = c.photos[0].levels.front();
  const PhotoCorrection correction{{0.7, 0.6, 0.65}, {-0.3, -0.1}, 0.6};
  Image8 corrected = photo;
  Correct(correction, corrected);
  ImageF picture(photo.width, photo.height, 4, 1.0F);
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x)
      for (int k = 0; k < 3; ++k) picture.At(x, y, k) = static_cast<float>(corrected.At(x, y, k)) / 255.0F;
  GiveBack(correction, picture);
  // Half a code value, over the smallest factor.
  constexpr double kRounding = 0.5 / 0.6 + 0.01;
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x)
      for (int k = 0; k < 3; ++k)
        ASSERT_NEAR(255.0 * static_cast<double>(picture.At(x, y, k)), photo.At(x, y, k), kRounding) << x << "," << y;
}

TEST(PhotoCorrection, OfNoneLeavesTheSceneAsItWas) {
  test::Capture c = test::CaptureWithTracks();
  const Exposures e = EstimateExposures(c.scene, c.photos);
  Apply(e, {true, true}, c.scene);
  Apply(e, {}, c.scene);
  for (std::size_t v = 0; v < c.scene.views.size(); ++v) {
    EXPECT_EQ(c.scene.views[v].correction, nullptr);
    EXPECT_EQ(c.scene.views[v].gain, e.gain[v]);
  }
}

TEST(PhotoCorrection, CamerasOfOneSizeAndFocalLengthAreOneLens) {
  constexpr std::size_t kViews = 40, kFirst = 18, kSecond = 16;
  Scene scene = test::MakeCapture(kViews, 16).scene;
  scene.cameras.assign(kViews, scene.cameras.front());
  std::vector<int> lenses(kViews, -1);  // six photos say too little
  for (std::size_t v = 0; v < kViews; ++v) {
    scene.views[v].camera = {static_cast<int>(v)};
    const double zoom = v < kFirst ? 1 + 0.002 * static_cast<double>(v) : v < kFirst + kSecond ? 2 : 3;
    if (v < kFirst + kSecond) lenses[v] = v < kFirst ? 0 : 1;
    scene.cameras[v] = Camera::Pinhole(16, 12, 14 * zoom, 14 * zoom, 8, 6);
  }
  EXPECT_EQ(LensesOfViews(scene), lenses);
}

}  // namespace
}  // namespace lumi
