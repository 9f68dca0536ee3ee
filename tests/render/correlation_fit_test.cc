// The correlation that is read off photos, and the leaves that fit it.
#include "render/effects/correlation_fit.h"

#include <gtest/gtest.h>

#include <random>

#include "capture.h"
#include "render/radiance/correlation.h"
#include "scene/geometry/constants.h"

namespace lumi {
namespace {

std::vector<CorrelationBin> BinsOf(double r_min_deg, double r_max_deg, double noise, double scatter) {
  const FallingLeaves leaves(r_min_deg * kRadPerDeg, r_max_deg * kRadPerDeg);
  std::mt19937 engine(3);
  std::normal_distribution<double> error(0, scatter);
  std::vector<CorrelationBin> bins;
  for (double deg = 0.1; deg < 50; deg *= 1.35)
    bins.push_back({deg * kRadPerDeg, leaves.PSame(deg * kRadPerDeg) / (1 + noise) + error(engine), 10000});
  return bins;
}

TEST(CorrelationFit, FindsTheLeavesAndTheNoiseThatMadeACorrelogram) {
  for (const double r_max : {3.0, 12.0})
    for (const double noise : {0.0, 0.5}) {
      const auto fit = FitLeaves(BinsOf(0.3, r_max, noise, 0));
      ASSERT_TRUE(fit);
      // To a step of the grid of radii, a quarter of an octave.
      EXPECT_NEAR(fit->r_max_rad / kRadPerDeg / r_max, 1, 0.19) << r_max << " " << noise;
      EXPECT_NEAR(fit->r_min_rad / kRadPerDeg, 0.3, 0.1);
      EXPECT_NEAR(fit->noise, noise, 0.06);
      EXPECT_LT(fit->rms, 0.02);
    }
  const auto rough = FitLeaves(BinsOf(0.3, 6, 0.2, 0.03));
  ASSERT_TRUE(rough);
  EXPECT_NEAR(rough->r_max_rad / kRadPerDeg, 6, 2);
  EXPECT_NEAR(rough->rms, 0.03, 0.02);
  EXPECT_FALSE(FitLeaves({}));
}

TEST(CorrelationFit, PhotosOverARougherProxyHaveLessInCommon) {
  const test::Capture c = test::MakeCapture(25, 96);
  // A wall where there is none, before the true one: photos show other places of it.
  Mesh wall;
  wall.vertices = {{-8, -8, 1.5}, {8, -8, 1.5}, {8, 8, 1.5}, {-8, 8, 1.5}};
  wall.faces = {{0, 1, 2}, {0, 2, 3}};
  const auto exact = MeasureCorrelation(c.scene, c.proxy, c.photos, {}),
             rough = MeasureCorrelation(c.scene, wall, c.photos, {});
  ASSERT_TRUE(exact && rough);
  ASSERT_FALSE(exact->bins.empty() || rough->bins.empty());
  // In the first bin from this angle on.
  const auto at = [](const MeasuredCorrelation& m, double deg) {
    for (const CorrelationBin& b : m.bins)
      if (b.angle_rad >= deg * kRadPerDeg) return b.correlation;
    return m.bins.back().correlation;
  };
  EXPECT_GT(at(*exact, 10), at(*rough, 10) + 0.1);
  EXPECT_GT(at(*rough, 2), at(*rough, 20));
  EXPECT_GT(exact->points, 1000);
  // The same again, whatever the threads do.
  const auto again = MeasureCorrelation(c.scene, c.proxy, c.photos, {});
  EXPECT_EQ(again->r_max_rad, exact->r_max_rad);
  EXPECT_EQ(again->bins[0].correlation, exact->bins[0].correlation);
}

TEST(CorrelationFit, OnePhotoTellsNothing) {
  const test::Capture c = test::MakeCapture(5, 48);
  EXPECT_FALSE(MeasureCorrelation(c.scene, c.proxy, c.photos, {true, false, false, false, false}));
}

TEST(CorrelationFit, LeavesOutThePhotosThatAreLeftOut) {
  test::Capture c = test::MakeCapture(25, 96);
  std::vector<bool> use(25, true);
  use[7] = false;
  const auto before = MeasureCorrelation(c.scene, c.proxy, c.photos, use);
  for (Image8& level : c.photos[7].levels) std::ranges::fill(level.data, std::uint8_t{0});
  const auto after = MeasureCorrelation(c.scene, c.proxy, c.photos, use);
  ASSERT_TRUE(before && after);
  for (std::size_t i = 0; i < before->bins.size(); ++i)
    EXPECT_EQ(before->bins[i].correlation, after->bins[i].correlation);
}

}  // namespace
}  // namespace lumi
