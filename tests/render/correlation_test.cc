// The falling-leaves correlation against closed forms, quadrature, 50 digits, and falling-leaves images themselves.
#include "render/radiance/correlation.h"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_dec_float.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "optimum_oracle.h"
#include "render/radiance/leaves_table.h"
#include "render/radiance/optimum/leaves_fit_lanes.h"

namespace lumi {
namespace {

using Decimal = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<50>, boost::multiprecision::et_off>;
constexpr double kDeg = kRadPerDeg;

TEST(Correlation, OverlapOfDiscsHasItsClosedForm) {
  // x = 1: a third of a turn, less a triangle; x = 2: they touch.
  EXPECT_NEAR(DiscOverlap(1), 2 / std::numbers::pi * (std::numbers::pi / 3 - std::sqrt(3.0) / 4), 1e-15);
  EXPECT_NEAR(DiscOverlap(1), 0.391, 5e-4);
  EXPECT_EQ(DiscOverlap(0), 1);
  EXPECT_EQ(DiscOverlap(2), 0);
  EXPECT_EQ(DiscOverlap(5), 0);
}

TEST(Correlation, OverlapIntegralIsTheIntegral) {
  EXPECT_EQ(DiscOverlapIntegral(2), 0);
  for (const double x : {1e-6, 1e-3, 0.1, 0.5, 1.0, 1.5, 1.9, 1.999}) {
    // Simpson's rule in v with s = 2 - (2 - x) v^2, which takes the root out of g's end.
    constexpr int kSteps = 20000;
    double sum = 0;
    const double from = std::max(x, 0.05);
    for (int i = 0; i <= kSteps; ++i) {
      const double v = static_cast<double>(i) / kSteps, s = 2 - (2 - from) * v * v;
      sum += (i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2) * DiscOverlap(s) / s * 2 * (2 - from) * v;
    }
    sum /= 3.0 * kSteps;
    for (int i = 0; i < kSteps && x < from; ++i) {  // the rest in log s, by the middle rule
      const double l = std::log(from / x) / kSteps, s = x * std::exp((i + 0.5) * l);
      sum += DiscOverlap(s) * l;
    }
    EXPECT_NEAR(DiscOverlapIntegral(x), sum, 1e-8) << x;
  }
}

TEST(Correlation, IsOneAtZeroFallsAndEndsAtTwiceTheLargestRadius) {
  for (const auto& [lo, hi] :
       std::vector<std::pair<double, double>>{{0.001, 5}, {1, 5}, {4.9, 5}, {5, 5}, {1e-9, 90}}) {
    const FallingLeaves leaves(lo * kDeg, hi * kDeg);
    EXPECT_EQ(leaves.PSame(0), 1);
    EXPECT_EQ(leaves.PSame(2 * hi * kDeg), 0);
    EXPECT_EQ(leaves.PSame(2 * hi * kDeg + 0.1), 0);
    double before = 1;
    for (double theta = 1e-12; theta < 2 * hi * kDeg; theta *= 1.01) {
      const double p = leaves.PSame(theta);
      ASSERT_LE(p, before + 1e-14) << lo << " " << theta;
      ASSERT_GE(p, 0);
      before = p;
    }
  }
}

TEST(Correlation, HoldsFourteenDigitsAgainstFifty) {
  for (const auto& [lo, hi] : std::vector<std::pair<double, double>>{{0.001, 5}, {1, 5}, {3.5, 5}, {4.9, 5}}) {
    const FallingLeaves leaves(lo * kDeg, hi * kDeg);
    const test::OracleLeaves<Decimal> exact(Decimal(leaves.r_min_rad()), Decimal(leaves.r_max_rad()));
    for (double theta = 1e-9; theta < 2 * hi * kDeg; theta *= 1.37)
      EXPECT_NEAR(leaves.PSame(theta), static_cast<double>(exact(Decimal(theta))), 1e-14) << lo << " " << theta;
  }
}

TEST(Correlation, LeavesOfOneSizeAreTheLimit) {
  const double r = 5 * kDeg;
  const FallingLeaves one(r, r);
  for (const double x : {0.01, 0.3, 1.0, 1.7, 1.99}) {
    const double g = DiscOverlap(x), limit = g / (2 - g);
    EXPECT_NEAR(one.PSame(x * r), limit, 1e-15);
    for (double d = 1e-1; d >= 1e-15; d /= 10) {
      const FallingLeaves near(r / (1 + d), r);
      // P moves with the mean radius: less than d (x <= 2, |dP/dlnx| <= 1).
      EXPECT_NEAR(near.PSame(x * r), limit, d + 1e-14) << x << " " << d;
    }
  }
}

TEST(Correlation, LeavesWithoutASmallestRadiusTellAllApart) {
  const FallingLeaves dust(0, 5 * kDeg);
  EXPECT_EQ(dust.PSame(0), 1);
  EXPECT_EQ(dust.PSame(1e-300), 0);
  double before = 1;
  for (double r_min = 1e-1; r_min > 1e-300; r_min /= 1e10) {
    const double p = FallingLeaves(r_min * kDeg, 5 * kDeg).PSame(1 * kDeg);
    EXPECT_LT(p, before);
    before = p;
  }
  EXPECT_LT(before, 2e-3);
  EXPECT_THROW(FallingLeaves(-1, 1), std::invalid_argument);
  EXPECT_THROW(FallingLeaves(2, 1), std::invalid_argument);
  EXPECT_THROW(FallingLeaves(0, 0), std::invalid_argument);
}

TEST(Correlation, TheThesisCubicWithItsSignCorrectedIsClose) {
  const FallingLeaves leaves(0.001 * kDeg, 5 * kDeg);
  double worst = 0;
  for (double theta = 1e-7; theta < 0.2; theta *= 1.05)
    worst = std::max(worst, std::abs(leaves.PSameCubic(theta) - leaves.PSame(theta)));
  EXPECT_LT(worst, 0.01);
  EXPECT_GT(worst, 1e-5);
}

template <class V>
double WorstFit(double r_min_deg, double r_max_deg) {
  using T = LaneValue<V>;
  const FallingLeaves leaves(r_min_deg * kDeg, r_max_deg * kDeg);
  const LeavesFit<T> fit(leaves, 1);
  EXPECT_TRUE(fit.usable);
  double worst = 0;
  for (double theta = 2.1 * leaves.r_max_rad(); theta > 1e-9; theta *= 0.999) {
    const T y = static_cast<T>(theta) * fit.y_from_theta;
    const V p = FitPSame(fit, Broadcast<V>(y), true);
    worst =
        std::max(worst, std::abs(static_cast<double>(p[1]) - leaves.PSame(static_cast<double>(static_cast<T>(theta)))));
  }
  EXPECT_EQ(static_cast<double>(FitPSame(fit, Broadcast<V>(0), true)[0]), 1);
  EXPECT_EQ(static_cast<double>(FitPSame(fit, Broadcast<V>(1), true)[0]), 0);
  return worst;
}

TEST(Correlation, KernelsFitItWithinTheirTolerance) {
  for (const double r_max : {1.0, 5.0, 30.0})
    for (const double r_min : {0.001, 0.05}) {
      EXPECT_LT((WorstFit<Lanes<float, 64>>(r_min, r_max)), LeavesFit<float>::kTolerance);
      EXPECT_LT((WorstFit<Lanes<float, 32>>(r_min, r_max)), LeavesFit<float>::kTolerance);
      EXPECT_LT((WorstFit<Lanes<float, 16>>(r_min, r_max)), LeavesFit<float>::kTolerance);
      EXPECT_LT((WorstFit<Lanes<double, 64>>(r_min, r_max)), LeavesFit<double>::kTolerance);
      EXPECT_LT((WorstFit<Lanes<double, 32>>(r_min, r_max)), LeavesFit<double>::kTolerance);
      EXPECT_LT((WorstFit<Lanes<double, 16>>(r_min, r_max)), LeavesFit<double>::kTolerance);
    }
  // Where it cannot: leaves of one size, angles over half the sphere.
  EXPECT_FALSE(LeavesFit<float>(FallingLeaves(0.05, 0.05), 1).usable);
  EXPECT_FALSE(LeavesFit<double>(FallingLeaves(0.001, 1.5), 1).usable);
}

// Leaves fall on a torus from the top one down until all of it is covered (Fig. 4-1); a pixel's value is its leaf.
std::vector<int> FallingLeavesImage(int size, double r_min, double r_max, std::mt19937& engine) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto side = static_cast<std::size_t>(size);
  std::vector<int> image(side * side, -1);
  std::size_t open = image.size();
  for (int leaf = 0; open > 0; ++leaf) {
    const double x = size * uniform(engine), y = size * uniform(engine);
    // The density of r is proportional to r^-3.
    const double r = r_min / std::sqrt(1 - uniform(engine) * (1 - r_min * r_min / (r_max * r_max)));
    for (int v = static_cast<int>(std::ceil(y - r)); v <= y + r; ++v) {
      const double half = std::sqrt(std::max(0.0, r * r - (v - y) * (v - y)));
      for (int u = static_cast<int>(std::ceil(x - half)); u <= x + half; ++u) {
        int& pixel =
            image[static_cast<std::size_t>((v + size) % size) * side + static_cast<std::size_t>((u + size) % size)];
        if (pixel >= 0) continue;
        pixel = leaf;
        --open;
      }
    }
  }
  return image;
}

TEST(Correlation, FallingLeavesImagesHaveIt) {
  constexpr int kSize = 192, kImages = 60;
  constexpr double kRMin = 2, kRMax = 30;
  const FallingLeaves leaves(kRMin, kRMax);  // the image's plane: pixels for angles
  const std::array<int, 9> distance = {1, 2, 3, 5, 9, 17, 33, 50, 61};
  std::mt19937 engine(17);
  std::array<double, 9> sum{}, squares{};
  for (int i = 0; i < kImages; ++i) {
    const std::vector<int> image = FallingLeavesImage(kSize, kRMin, kRMax, engine);
    for (std::size_t k = 0; k < distance.size(); ++k) {
      long same = 0;
      for (int v = 0; v < kSize; ++v)
        for (int u = 0; u < kSize; ++u) {
          const int here = image[static_cast<std::size_t>(v * kSize + u)];
          same += here == image[static_cast<std::size_t>(v * kSize + (u + distance[k]) % kSize)];
          same += here == image[static_cast<std::size_t>((v + distance[k]) % kSize * kSize + u)];
        }
      const double p = static_cast<double>(same) / (2.0 * kSize * kSize);
      sum[k] += p;
      squares[k] += p * p;
    }
  }
  for (std::size_t k = 0; k < distance.size(); ++k) {
    const double mean = sum[k] / kImages, variance = std::max(0.0, squares[k] / kImages - mean * mean);
    // Images are independent: four standard errors of their mean.
    const double tolerance = 4 * std::sqrt(variance / kImages) + 1e-12;
    EXPECT_NEAR(mean, leaves.PSame(distance[k]), tolerance) << distance[k] << " px";
    EXPECT_LT(tolerance, 0.02);
  }
}

TEST(LeavesTable, IsTheCorrelationToWhatItPromises) {
  for (const auto& [r_min, r_max] : {std::pair(0.001, 5.0), {0.5, 5.0}, {4.9, 5.0}, {5.0, 5.0}, {1e-6, 60.0}}) {
    const FallingLeaves leaves(r_min * kDeg, r_max * kDeg);
    const LeavesTable table(r_min * kDeg, r_max * kDeg);
    double worst = 0;
    for (double h = 1e-14; h < 4; h *= 1.013) worst = std::max(worst, std::abs(table(h) - leaves.PSame(h)));
    // Where it vanishes: what is left of it is normalised.
    for (double y = 0.5; y < 1 - 1e-6; y = 1 - 0.9 * (1 - y))
      if (const double p = leaves.PSame(2 * r_max * kDeg * y); p > 1e-5) {
        EXPECT_NEAR(table(2 * r_max * kDeg * y) / p, 1, 1e-3) << r_min << " " << r_max << " " << y;
      }
    EXPECT_LT(worst, r_min > 4 ? 1e-4 : 1e-5) << r_min << " " << r_max;  // leaves of one size fall within few octaves
    EXPECT_EQ(table(0), 1);
    EXPECT_EQ(table(std::numeric_limits<double>::infinity()), 0);
  }
}

}  // namespace
}  // namespace lumi
