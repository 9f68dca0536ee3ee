// The correlation that is read off photos, and the leaves that fit it.
#include "render/effects/correlation_fit.h"

#include <gtest/gtest.h>

#include <cmath>
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

TEST(CorrelationFit, TellsAGlossyHalfFromADullOne) {
  // A wall, one half of it painted, the other one lit otherwise in each photo: there photos have nothing in common.
  test::Capture c = test::MakeCapture(25, 96);
  for (std::size_t i = 0; i < c.photos.size(); ++i) {
    Image8& level = c.photos[i].levels[0];
    std::mt19937 engine(static_cast<unsigned>(i));
    const RenderView v = MakeRenderView(c.scene, c.scene.views[i]);
    for (int y = 0; y < level.height; ++y)
      for (int x = 0; x < level.width; ++x) {
        const Eigen::Vector3d d = RayDirection(v.P, {x + 0.5, y + 0.5})->normalized();
        const double t = test::HitDistance(c.proxy, v.centre, d);
        if (!std::isfinite(t) || (v.centre + t * d).x() < 0) continue;
        for (int ch = 0; ch < level.channels; ++ch) level.At(x, y, ch) = static_cast<std::uint8_t>(engine() % 256);
      }
  }
  const auto found = MeasureCorrelation(c.scene, c.proxy, c.photos, {}, 4);
  ASSERT_TRUE(found && found->by_place);
  ASSERT_GE(found->kinds.size(), 2u);
  EXPECT_EQ(found->kinds.size(), found->by_place->kinds.size());
  double all = 0, least = 1e9, most = 0;
  for (const CorrelationKind& k : found->kinds) {
    all += k.share;
    if (k.share < 0.05) continue;
    least = std::min(least, k.leaves.noise);
    most = std::max(most, k.leaves.noise);
  }
  EXPECT_NEAR(all, 1, 1e-9);
  EXPECT_GT(most, 2) << "the half without anything in common, and its border";
  EXPECT_LT(least, 1) << "the painted half";
  const auto again = MeasureCorrelation(c.scene, c.proxy, c.photos, {}, 4);
  EXPECT_EQ(again->by_place->kind, found->by_place->kind);
  const auto whole = MeasureCorrelation(c.scene, c.proxy, c.photos, {});
  EXPECT_FALSE(whole->by_place);
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
