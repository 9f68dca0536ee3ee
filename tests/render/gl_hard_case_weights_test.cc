// What the GL backend draws where weights are ill-posed: ties, duplicates, a thousand cameras in one place.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/render/gl_hard_case.h"

namespace lumi {
namespace {

using test::GlHardCase;
using test::kWeightTolerance;
using test::Over;
using test::Step;
using test::ViewFrom;
using test::Way;
using test::Ways;
using test::World;

// Four cameras at one angle from the middle ray, exactly; the others are farther. k + 1 of the four tie for every k
// below 4. No continuity is claimed there: only that the tied share, and nobody else.
TEST_F(GlHardCase, TiedCamerasShare) {
  LoadPainted(Over({{1, 0, 4}, {0, 1, 4}, {-1, 0, 4}, {0, -1, 4}, {3, 0, 4}, {0, -3, 4}}));
  for (Way way : Ways())
    for (const int k : {1, 3, 4, 0}) {
      SCOPED_TRACE(way.name + ", k " + std::to_string(k));
      way.settings.k = k;
      const auto middle = [&](const RenderView& view) {
        const std::vector<ImageF> pictures = WeightPictures(Request(way.settings, view));
        ExpectConvex(way.settings, pictures);
        return WeightsAt(pictures, 16, 12);
      };
      const std::vector<float> w = middle(ViewFrom({0, 0, 3}));
      const float tied = w[0] + w[1] + w[2] + w[3];
      const bool identity = way.settings.similarity == Similarity::kIdentity;
      if (k > 0 && identity) {
        EXPECT_NEAR(tied, 1, 1e-5F);
      }
      for (std::size_t j = 0; j < 4; ++j) {
        // Interpolated: from samples around, none of which is at the tie.
        if (!identity || (way.settings.Sparse() && way.settings.sampling == Sampling::kInterpolated)) continue;
        EXPECT_TRUE(w[j] == 0 || std::abs(w[j] - tied / static_cast<float>(k > 0 ? std::min(k, 4) : 4)) < 1e-5F)
            << "camera " << j << ": " << w[j];
      }
      for (double step = 1e-2; step >= 1e-15; step /= 100)
        for (const Eigen::Vector2d& direction :
             {Eigen::Vector2d(1, 0.5), Eigen::Vector2d(1, 0), Eigen::Vector2d(1, 1)}) {
          const std::vector<float> near = middle(ViewFrom({step * direction.x(), step * direction.y(), 3}));
          if (k > 0 && identity && step < 1e-3) {
            EXPECT_NEAR(near[0] + near[1] + near[2] + near[3], 1, kWeightTolerance) << step;
          }
        }
    }
}

TEST_F(GlHardCase, DuplicatesShareEqually) {
  LoadPainted(Over({{0.4, 0.1, 4}, {-0.7, 0.2, 4}, {0.4, 0.1, 4}, {0.2, -0.8, 4}, {0.4, 0.1, 4}, {-1.2, -1.3, 4}}));
  for (Way way : Ways())
    for (const int k : {4, 0}) {
      way.settings.k = k;
      for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.4, 0.1, 4), Eigen::Vector3d(0.1, 0.3, 3)}) {
        const RenderView view = ViewFrom(eye);
        SCOPED_TRACE(way.name + ", k " + std::to_string(k));
        const std::vector<ImageF> pictures = WeightPictures(Request(way.settings, view));
        ExpectConvex(way.settings, pictures);
        for (int y = 0; y < 25; ++y)
          for (int x = 0; x < 33; ++x) {
            const std::vector<float> w = WeightsAt(pictures, x, y);
            ASSERT_NEAR(w[0], w[2], 1e-5F) << x << " " << y;
            ASSERT_NEAR(w[0], w[4], 1e-5F) << x << " " << y;
            if (eye.z() == 4 && way.settings.resolution == Resolution::kOff &&
                !(way.settings.similarity == Similarity::kFull)) {
              ASSERT_NEAR(w[0], 1.0F / 3, kWeightTolerance) << x << " " << y;
            }
          }
        EXPECT_LE(Disagreement(way.settings, view), 0);
      }
    }
}

// No two of them are tied but for floats. Colours tell: each lies between those of the photos.
TEST_F(GlHardCase, AThousandCamerasWithinAMillionth) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1e-6, 1e-6);
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < 1000; ++i) {
    const double x = u(random), y = u(random);
    centres.emplace_back(x, y, 4 + u(random));
  }
  World world = Over(centres);
  world.scene.cameras = {Camera::Pinhole(8, 8, 2.5, 2.5, 4, 4)};
  LoadPainted(std::move(world));
  for (const double offset : {0.0, 1e-9, 1e-6, 1e-3, 0.5})
    for (Way way : Ways())
      for (const int k : {1, 4}) {
        SCOPED_TRACE(way.name + ", k " + std::to_string(k) + ", " + Step(offset));
        if (k == 1 && way.settings.similarity == Similarity::kFull) continue;
        way.settings.k = k;
        const ImageF image = Draw(way.settings, ViewFrom({offset, 0, 3}));
        for (int y = 0; y < image.height; ++y)
          for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < 3; ++c) {
              ASSERT_EQ(image.At(x, y, 3), 1);
              if (way.settings.similarity == Similarity::kFull) continue;
              ASSERT_GE(image.At(x, y, c), 64.0F / 255 - 1e-5F) << x << " " << y;
              ASSERT_LE(image.At(x, y, c), 191.0F / 255 + 1e-5F) << x << " " << y;
            }
      }
}

TEST_F(GlHardCase, LeavesDownToNoSizeAndUpToOneSize) {
  LoadPainted(Over({{0.3, 0, 4}, {-0.5, 0.2, 4}, {0.1, -0.4, 4}, {0.2, 0.6, 4}, {-1, -1, 4}, {1.4, 0.3, 4}}));
  const RenderView view = ViewFrom({0.05, 0.1, 3});
  for (Way way : Ways()) {
    way.settings.correlation = Correlation::kFallingLeaves;
    const auto sound = [&](double r_min_deg, const char* what) {
      way.settings.r_min_rad = std::min(r_min_deg * kRadPerDeg, way.settings.r_max_rad);
      ExpectSound(way, view, what + (" " + Step(r_min_deg)), 0);
    };
    for (double r_min_deg = 1; r_min_deg > 1e-18; r_min_deg /= 1000) sound(r_min_deg, "towards 0");
    sound(0, "at");
    for (double d = 1e-1; d > 1e-16; d /= 1000) sound(5 / (1 + d), "towards 5");
    sound(5, "at");
    way.settings.r_max_rad = 1e-6 * kRadPerDeg;  // smaller than any angle here
    sound(0, "all tiny");
    sound(1e-6, "all tiny");
  }
}

// Angles far beyond 2 r_max: correlations are 0 and the sum of weights would be.
TEST_F(GlHardCase, FarFromAllCamerasWeightsAreSound) {
  LoadPainted(Over({{0, 0, 4}, {0.3, 0.1, 4}, {0.1, 0.4, 4}, {-0.5, 0, 4}, {-0.2, -0.4, 4}, {0.6, -0.1, 4}}));
  for (Way way : Ways())
    for (const WeightSum sum : {WeightSum::kLocalMean, WeightSum::kRenormalise, WeightSum::kConstrained})
      for (const int k : {4, 0}) {
        if (sum != WeightSum::kLocalMean && way.settings.similarity == Similarity::kIdentity) continue;
        way.settings.correlation = Correlation::kFallingLeaves;
        way.settings.sum = sum;
        way.settings.k = k;
        for (double a = 0; a < 1.2; a += 0.1)
          ExpectSound(way, ViewFrom({3 * std::sin(a), 0.01, 3 * std::cos(a)}),
                      std::to_string(a) + " rad, " + std::string(Name(sum)), 0.01);
      }
}

// Photos that see parts of the floor: holes where none does, and only there.
TEST_F(GlHardCase, WhereNoCameraSeesThePointAlphaIsZero) {
  World world = Over({{1, 0, 3}, {-1, 0.3, 3}, {0.2, 1.2, 3}, {0.1, -1.1, 3}, {-0.5, -0.5, 3}, {0.4, 0.6, 3}});
  world.scene.cameras = {Camera::Pinhole(32, 32, 120, 120, 16, 16)};
  LoadPainted(std::move(world));
  for (const Way& way : Ways()) {
    const RenderView view = ViewFrom({0.2, 0.1, 4});
    ExpectSound(way, view, "narrow photos", way.settings.Sparse() ? 0.02 : 0);
    const ImageF image = Draw(way.settings, view);
    EXPECT_EQ(image.At(0, 0, 3), 0);
    EXPECT_EQ(image.At(16, 12, 3), 1);
    ExpectSound(way, ViewFrom({3.5, 3.5, 2}, {3.9, 3.9, 0}), "beyond", 0);
  }
}

}  // namespace
}  // namespace lumi
