#include "scene/image_difference/image_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lumi {
namespace {

Image8 Noise(unsigned seed) {
  std::mt19937 engine(seed);
  Image8 image(64, 48, 3);
  for (auto& v : image.data) v = static_cast<std::uint8_t>(engine() % 200 + 20);
  return image;
}

TEST(ImageDifference, EqualImagesAreEqual) {
  const ImageDifference d = Compare(Noise(1), Noise(1));
  EXPECT_EQ(d.mse, 0);
  EXPECT_EQ(d.psnr_db, 99);
  EXPECT_NEAR(d.ssim, 1, 1e-6);  // float moments
}

TEST(ImageDifference, AConstantOffsetHasItsClosedForm) {
  Image8 a = Noise(2), b = a;
  for (auto& v : b.data) v = static_cast<std::uint8_t>(v + 10);
  const ImageDifference d = Compare(b, a);
  EXPECT_DOUBLE_EQ(d.mse, 100);
  EXPECT_DOUBLE_EQ(d.mean_absolute, 10);
  EXPECT_NEAR(d.psnr_db, 10 * std::log10(255.0 * 255.0 / 100), 1e-12);
  EXPECT_LT(d.ssim, 1);
  EXPECT_GT(d.ssim, 0.9);  // structure is untouched
}

TEST(ImageDifference, SsimOfFlatImagesHasItsClosedForm) {
  const Image8 a(40, 40, 3, 100), b(40, 40, 3, 120);
  const double c1 = 0.01 * 255 * 0.01 * 255;
  EXPECT_NEAR(Compare(a, b).ssim, (2 * 100.0 * 120 + c1) / (100.0 * 100 + 120.0 * 120 + c1), 1e-4);
}

TEST(ImageDifference, WithinAMaskOnlyItsPixelsCount) {
  const Image8 a = Noise(2);
  Image8 b = a, mask(a.width, a.height, 1);
  EXPECT_FALSE(PsnrWithin(a, b, mask)) << "no pixel";
  for (int x = 0; x < 5; ++x) {
    mask.At(x, 3, 0) = 255;
    for (int c = 0; c < 3; ++c)
      b.At(x, 3, c) = static_cast<std::uint8_t>(a.At(x, 3, c) > 127 ? a.At(x, 3, c) - 20 : a.At(x, 3, c) + 20);
  }
  EXPECT_NEAR(*PsnrWithin(a, b, mask), 10 * std::log10(255.0 * 255.0 / 400), 1e-12);
  b.At(20, 20, 1) = static_cast<std::uint8_t>(255 - b.At(20, 20, 1));
  EXPECT_NEAR(*PsnrWithin(a, b, mask), 10 * std::log10(255.0 * 255.0 / 400), 1e-12) << "outside";
  EXPECT_THROW(PsnrWithin(a, b, Image8(a.width, a.height, 3)), std::invalid_argument);
}

TEST(ImageDifference, UnrelatedNoiseIsDissimilarAndSizesMustAgree) {
  EXPECT_LT(Compare(Noise(3), Noise(4)).ssim, 0.1);
  EXPECT_THROW(Compare(Noise(3), Image8(10, 10, 3)), std::invalid_argument);
}

}  // namespace
}  // namespace lumi
