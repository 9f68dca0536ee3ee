// The byte matcher beside one that does it number by number, and SIFT's places beside the truth.
#include "scene/tracks/match_bytes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/tracks/sift.h"

namespace lumi {
namespace {

using Pairs = std::vector<std::pair<int, int>>;

// COLMAP's one way, number by number; -1: none.
std::vector<int> OneWay(const ByteDescriptors& a, const ByteDescriptors& b, const ByteMatchOptions& o) {
  std::vector<int> nearest;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    int best = 0, second = 0, at = -1;
    for (Eigen::Index j = 0; j < b.rows(); ++j) {
      const int product = a.row(i).cast<int>().dot(b.row(j).cast<int>());
      if (product > best) {
        second = best;
        best = product;
        at = static_cast<int>(j);
      } else {
        second = std::max(second, product);
      }
    }
    const auto angle = [](int product) {
      return std::acos(std::min(static_cast<float>(product) * (1.0F / (512.0F * 512.0F)), 1.0F));
    };
    const bool good = at >= 0 && angle(best) <= static_cast<float>(o.max_distance_rad) &&
                      angle(best) < static_cast<float>(o.max_ratio) * angle(second);
    nearest.push_back(good ? at : -1);
  }
  return nearest;
}

Pairs Reference(const ByteDescriptors& a, const ByteDescriptors& b, const ByteMatchOptions& o) {
  const std::vector<int> forth = OneWay(a, b, o), back = OneWay(b, a, o);
  Pairs pairs;
  for (std::size_t i = 0; i < forth.size(); ++i)
    if (forth[i] >= 0 && back[static_cast<std::size_t>(forth[i])] == static_cast<int>(i))
      pairs.emplace_back(static_cast<int>(i), forth[i]);
  return pairs;
}

// 512 times unit vectors; `sparse` ones have few numbers that are large, as a photo's edges give.
ByteDescriptors Random(int rows, unsigned seed, double sparse_share = 0) {
  std::mt19937 random(seed);
  std::gamma_distribution<float> usual(2.0F), rare(0.05F);
  std::bernoulli_distribution is_sparse(sparse_share);
  Descriptors d(rows, kByteDescriptorLength);
  for (int i = 0; i < rows; ++i) {
    const bool sparse = is_sparse(random);
    for (int k = 0; k < kByteDescriptorLength; ++k) d(i, k) = sparse ? rare(random) : usual(random);
    d.row(i).normalize();
  }
  return ToBytes(d);
}

// The rows of `a`, some of them in another order and a little changed, among others.
ByteDescriptors SeenAgain(const ByteDescriptors& a, int rows, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> change(-6, 6);
  ByteDescriptors b = Random(rows, seed + 1, 0.05);
  std::vector<int> order(static_cast<std::size_t>(a.rows()));
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  std::shuffle(order.begin(), order.end(), random);
  for (int i = 0; i < rows && i < a.rows(); i += 2)
    for (int k = 0; k < kByteDescriptorLength; ++k)
      b(i, k) =
          static_cast<std::uint8_t>(std::clamp(a(order[static_cast<std::size_t>(i)], k) + change(random), 0, 255));
  return b;
}

TEST(MatchBytes, EveryKernelGivesWhatNumberByNumberGives) {
  for (const auto& [rows_a, rows_b] : {std::pair(1, 1), {3, 17}, {16, 128}, {129, 257}, {300, 301}}) {
    const ByteDescriptors a = Random(rows_a, 1, 0.05), b = SeenAgain(a, rows_b, 7);
    for (const ByteMatchOptions& options : {ByteMatchOptions{}, {.max_ratio = 0.95, .max_distance_rad = 1.2}}) {
      const Pairs expected = Reference(a, b, options);
      if (rows_a > 100) {
        EXPECT_GT(expected.size(), 30U);
      }
      for (const ByteKernel kernel : AvailableByteKernels())
        EXPECT_EQ(MatchBytes(a, b, options, kernel), expected) << Name(kernel) << " " << rows_a << " x " << rows_b;
    }
  }
}

// The largest numbers there are: two of their products overflow 16 bits, and a sum of 128 of them does not 32.
TEST(MatchBytes, LargeNumbersDoNotOverflow) {
  ByteDescriptors a = Random(40, 3, 0.5), b = SeenAgain(a, 50, 4);
  for (int k = 0; k < kByteDescriptorLength; ++k) {
    a(8, k) = b(33, k) = k < 4 ? 255 : 0;
    a(9, k) = b(34, k) = k % 2 ? 127 : 0;
  }
  const ByteMatchOptions options{.max_ratio = 0.99, .max_distance_rad = 1.5};
  Pairs expected = Reference(a, b, options);
  EXPECT_EQ(std::count(expected.begin(), expected.end(), std::pair(8, 33)), 1);
  for (const ByteKernel kernel : AvailableByteKernels())
    EXPECT_EQ(MatchBytes(a, b, options, kernel), expected) << Name(kernel);
  a.row(7).setConstant(255);
  b.row(9).setConstant(255);
  expected = Reference(a, b, options);
  for (const ByteKernel kernel : AvailableByteKernels())
    EXPECT_EQ(MatchBytes(a, b, options, kernel), expected) << Name(kernel);
}

// Two features that are alike say nothing: neither is taken, wherever they stand, and nothing depends on the order.
TEST(MatchBytes, TiesAreRefusedOnEitherSide) {
  const ByteDescriptors a = Random(40, 11);
  for (const int at : {1, 15, 16, 127, 128, 150}) {
    ByteDescriptors b = Random(160, 12);
    b.row(at) = a.row(5);
    const Pairs once = MatchBytes(a, b, {});
    EXPECT_EQ(once, (Pairs{{5, at}}));
    b.row(at == 150 ? 0 : 150) = a.row(5);
    EXPECT_EQ(MatchBytes(a, b, {}), Pairs{}) << at;  // a second one in b: the ratio test forth
    ByteDescriptors twice = a;
    twice.row(30) = a.row(5);
    b.row(at == 150 ? 0 : 150) = Random(1, 99).row(0);
    EXPECT_EQ(MatchBytes(twice, b, {}), Pairs{}) << at;  // a second one in a: the ratio test back
  }
}

TEST(MatchBytes, RatioAndDistanceAreBounds) {
  // Three in a plane: a at 0, b's at 0.3 and at 0.4 radian.
  Descriptors unit = Descriptors::Zero(3, kByteDescriptorLength);
  const std::array<float, 3> angles{0.0F, 0.3F, 0.4F};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < kByteDescriptorLength; ++k)
      unit(i, k) = (std::cos(angles[static_cast<std::size_t>(i)]) +
                    (k % 2 ? 1.0F : -1.0F) * std::sin(angles[static_cast<std::size_t>(i)])) /
                   std::sqrt(128.0F);
  const ByteDescriptors all = ToBytes(unit), a = all.topRows(1), b = all.bottomRows(2);
  EXPECT_EQ(MatchBytes(a, b, {.max_ratio = 0.8}), (Pairs{{0, 0}}));
  EXPECT_EQ(MatchBytes(a, b, {.max_ratio = 0.7}), Pairs{});
  EXPECT_EQ(MatchBytes(a, b, {.max_ratio = 0.8, .max_distance_rad = 0.25}), Pairs{});
}

TEST(MatchBytes, NothingAndTheFirstFew) {
  const ByteDescriptors none(0, kByteDescriptorLength), a = Random(50, 21),
                                                        zeros = ByteDescriptors::Zero(20, kByteDescriptorLength);
  EXPECT_EQ(MatchBytes(none, a, {}), Pairs{});
  EXPECT_EQ(MatchBytes(a, none, {}), Pairs{});
  EXPECT_EQ(MatchBytes(a, zeros, {}), Pairs{});
  EXPECT_EQ(MatchBytes(a, a, {}).size(), 50U);
  EXPECT_EQ(MatchBytes(a, a, {.most = 20}).size(), 20U);
  EXPECT_THROW(MatchBytes(a, ByteDescriptors::Zero(3, 64), {}), UsageError);
}

// Spots of which the middle is known to any digit, in a picture of any size: those found at its own size, and those
// that are found at half of it.
Image8 Spots(int width, int height, double spread_px, std::vector<Eigen::Vector2d>* middles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> part(0, 1);
  Image8 image(width, height, 1, 40);
  const int pitch = static_cast<int>(12 * spread_px);
  for (int y0 = pitch; y0 + pitch < height; y0 += pitch)
    for (int x0 = pitch; x0 + pitch < width; x0 += pitch) {
      const Eigen::Vector2d middle(x0 + part(random), y0 + part(random));
      const double height_of_spot = 120 + 60 * part(random);
      middles->push_back(middle);
      for (int y = y0 - pitch / 2; y < y0 + pitch / 2; ++y)
        for (int x = x0 - pitch / 2; x < x0 + pitch / 2; ++x) {
          const double r2 = (Eigen::Vector2d(x + 0.5, y + 0.5) - middle).squaredNorm();
          image.At(x, y, 0) =
              static_cast<std::uint8_t>(std::lround(40 + height_of_spot * std::exp(-r2 / (2 * spread_px * spread_px))));
        }
    }
  return image;
}

// Medians over spots of SIFT's place less the truth, pixels. OpenCV's own are 0.25 px to the right and below.
Eigen::Vector2d MedianOffset(const Image8& image, const std::vector<Eigen::Vector2d>& middles,
                             const SiftOptions& options, double expected_scale_px) {
  std::vector<double> dx, dy;
  for (const SiftFeature& f : FindSift(image, {}, options).features) {
    if (f.scale_px < 0.6 * expected_scale_px || f.scale_px > 1.7 * expected_scale_px) continue;
    const auto nearest = std::min_element(middles.begin(), middles.end(), [&](const auto& a, const auto& b) {
      return (a - f.x_px).squaredNorm() < (b - f.x_px).squaredNorm();
    });
    if ((*nearest - f.x_px).norm() > expected_scale_px) continue;
    dx.push_back(f.x_px.x() - nearest->x());
    dy.push_back(f.x_px.y() - nearest->y());
  }
  EXPECT_GT(dx.size(), middles.size() / 2);
  if (dx.empty()) return Eigen::Vector2d::Constant(1e9);
  std::nth_element(dx.begin(), dx.begin() + static_cast<std::ptrdiff_t>(dx.size() / 2), dx.end());
  std::nth_element(dy.begin(), dy.begin() + static_cast<std::ptrdiff_t>(dy.size() / 2), dy.end());
  return {dx[dx.size() / 2], dy[dy.size() / 2]};
}

// A tenth of the error that is put right: what rounding to 8 bits and the interpolation of the extremum leave.
constexpr double kOffsetTolerancePx = 0.025;

TEST(Sift, PlacesAreThoseOfTheTruth) {
  for (const double spread_px : {1.5, 3.0, 6.0}) {
    std::vector<Eigen::Vector2d> middles;
    const Image8 image = Spots(480, 360, spread_px, &middles);
    for (const SiftOrder order : {SiftOrder::kStrongest, SiftOrder::kLargest}) {
      const Eigen::Vector2d offset =
          MedianOffset(image, middles, {.max_features = 5000, .order = order, .contrast = 0.02}, spread_px);
      EXPECT_NEAR(offset.x(), 0, kOffsetTolerancePx) << spread_px;
      EXPECT_NEAR(offset.y(), 0, kOffsetTolerancePx) << spread_px;
    }
  }
}

TEST(Sift, PlacesInScaledPicturesAreThoseOfTheTruth) {
  std::vector<Eigen::Vector2d> middles;
  const Image8 image = Spots(1400, 900, 6.0, &middles);
  // Asked for as many as half the size shows: found there. Asked for a smaller picture: found in that one. As large as
  // it is: as large.
  const int at_half_size = static_cast<int>(
      FindSift(image, {}, {.max_features = 5000, .max_size_px = 700, .order = SiftOrder::kLargest, .contrast = 0.02})
          .features.size());
  for (const SiftOptions& options :
       {SiftOptions{.max_features = at_half_size}, SiftOptions{.max_features = 5000, .max_size_px = 700},
        SiftOptions{.max_features = 5000, .max_size_px = 933}, SiftOptions{.max_features = 5000}}) {
    SiftOptions o = options;
    o.order = SiftOrder::kLargest;
    o.contrast = 0.02;
    const SiftFeatures found = FindSift(image, {}, o);
    std::vector<double> dx, dy;
    for (const SiftFeature& f : found.features)
      for (const Eigen::Vector2d& m : middles)
        if ((f.x_px - m).norm() < 3 && f.scale_px > 3.5 && f.scale_px < 10) {
          dx.push_back(f.x_px.x() - m.x());
          dy.push_back(f.x_px.y() - m.y());
        }
    ASSERT_GT(dx.size(), middles.size() / 5);
    std::sort(dx.begin(), dx.end());
    std::sort(dy.begin(), dy.end());
    EXPECT_NEAR(dx[dx.size() / 2], 0, 2 * kOffsetTolerancePx) << o.max_size_px;  // of a picture of half the size
    EXPECT_NEAR(dy[dy.size() / 2], 0, 2 * kOffsetTolerancePx) << o.max_size_px;
  }
}

TEST(Sift, MaskedPlacesHaveNoFeature) {
  std::vector<Eigen::Vector2d> middles;
  const Image8 image = Spots(480, 360, 3, &middles);
  Image8 mask(480, 360, 1, 255);
  for (int y = 0; y < 360; ++y)
    for (int x = 0; x < 240; ++x) mask.At(x, y, 0) = 0;
  const SiftFeatures all = FindSift(image, {}, {}), right = FindSift(image, mask, {});
  EXPECT_GT(right.features.size(), all.features.size() / 4);
  EXPECT_LT(right.features.size(), all.features.size());
  for (const SiftFeature& f : right.features) EXPECT_GE(f.x_px.x(), 240);
  EXPECT_EQ(right.descriptors.rows(), static_cast<Eigen::Index>(right.features.size()));
}

TEST(Sift, LargestFirstAndTheSameForAnyNumberOfThreads) {
  std::vector<Eigen::Vector2d> middles;
  const Image8 image = Spots(640, 480, 2, &middles);
  const SiftOptions options{.max_features = 200, .order = SiftOrder::kLargest, .contrast = 0.02};
  SetThreadCount(1);
  const SiftFeatures one = FindSift(image, {}, options);
  SetThreadCount(3);
  const SiftFeatures three = FindSift(image, {}, options);
  SetThreadCount(0);
  ASSERT_EQ(one.features.size(), 200U);
  ASSERT_EQ(three.features.size(), 200U);
  for (std::size_t i = 0; i < one.features.size(); ++i) {
    EXPECT_EQ(one.features[i].x_px, three.features[i].x_px);
    if (i > 0) {
      EXPECT_LE(one.features[i].scale_px, one.features[i - 1].scale_px);
    }
  }
  EXPECT_EQ(ToBytes(one.descriptors), ToBytes(three.descriptors));
  for (Eigen::Index i = 0; i < one.descriptors.rows(); ++i) EXPECT_NEAR(one.descriptors.row(i).norm(), 1, 1e-5);
}

TEST(Sift, BlankAndTinyPicturesHaveNone) {
  EXPECT_TRUE(FindSift(Image8(100, 80, 3, 128), {}, {}).features.empty());
  EXPECT_TRUE(FindSift(Image8(15, 80, 1, 128), {}, {.order = SiftOrder::kLargest}).features.empty());
}

}  // namespace
}  // namespace lumi
