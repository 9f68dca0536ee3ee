// Silhouettes that disagree: in most views, which is refused in bounded time, and a little, where the user chooses
// between covering them all and being tight.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "proxy/hull/soundness.h"
#include "proxy/hull/visual_hull.h"
#include "scene/program/error.h"
#include "tests/proxy/hull_bodies.h"

namespace lumi::test {
namespace {

using testing::HasSubstr;

const Body kVase = Union(Ellipsoid({1, 0.6, 0.5}), Block({0.2, 0.2, 0.9}));

void PaintDisc(Image8& mask, double u, double v, double radius_px, std::uint8_t value) {
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      if (std::hypot(x + 0.5 - u, y + 0.5 - v) < radius_px) mask.At(x, y, 0) = value;
}

// A cloth hangs somewhere else in each view but every fourth.
std::vector<SilhouetteView> WithCloths(int count) {
  std::vector<SilhouetteView> views = Around(kVase, count);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> at(60, 260);
  for (std::size_t n = 0; n < views.size(); ++n)
    if (n % 4 != 0) PaintDisc(views[n].mask, at(random), at(random), 60, 255);
  return views;
}

// A table's cloth before and below the thing, to three sides of each photo, its edge found at another height in each.
std::vector<SilhouetteView> OnATable(int count) {
  std::vector<SilhouetteView> views;
  std::mt19937 random(5);
  std::uniform_int_distribution<int> edge(54, 69);
  const Shot small{96, 96, 147, {48, 48}};
  for (int n = 0; n < count; ++n) {
    const double turn = 2 * std::numbers::pi * n / count;
    views.push_back(Photograph(kVase, {5 * std::cos(turn), 5 * std::sin(turn), 1.2}, Eigen::Vector3d::Zero(), small));
    views.back().name = "view" + std::to_string(n);
    Image8& mask = views.back().mask;
    for (int y = edge(random); y < mask.height; ++y)
      for (int x = 0; x < mask.width; ++x) mask.At(x, y, 0) = 255;
  }
  return views;
}

// Bites of one to three pixels out of the outlines, and as many bumps.
std::vector<SilhouetteView> WithNibbledOutlines(int count) {
  std::vector<SilhouetteView> views = Around(kVase, count);
  std::mt19937 random(7);
  for (SilhouetteView& view : views) {
    const Image8 before = view.mask;
    std::vector<Eigen::Vector2i> border;
    for (int y = 1; y + 1 < before.height; ++y)
      for (int x = 1; x + 1 < before.width; ++x)
        if (before.At(x, y, 0) != 0 && (before.At(x - 1, y, 0) == 0 || before.At(x + 1, y, 0) == 0 ||
                                        before.At(x, y - 1, 0) == 0 || before.At(x, y + 1, 0) == 0))
          border.emplace_back(x, y);
    std::uniform_int_distribution<std::size_t> which(0, border.size() - 1);
    for (int bite = 0; bite < 24; ++bite) {
      const Eigen::Vector2i at = border[which(random)];
      PaintDisc(view.mask, at.x() + 0.5, at.y() + 0.5, 1.5 + 0.5 * (bite % 3), bite % 2 == 0 ? 0 : 255);
    }
  }
  return views;
}

struct Refused {
  std::string message, hint;
  HullSummary summary;
};
Refused RefusalOf(const std::vector<SilhouetteView>& views, const HullOptions& options = {}) {
  Refused refused;
  try {
    BuildVisualHull(views, options, SilentProgress(), &refused.summary);
    ADD_FAILURE() << "not refused";
  } catch (const DataError& e) {
    refused.message = e.what();
    refused.hint = e.hint();
  }
  return refused;
}

TEST(HullDisagreement, InMostViewsIsRefusedBeforeAnyHullIsBuilt) {
  const std::vector<SilhouetteView> views = WithCloths(16);
  const Refused refused = RefusalOf(views);
  EXPECT_THAT(refused.message, HasSubstr("the silhouettes disagree in most views"));
  EXPECT_THAT(refused.message, HasSubstr("of 16 would have to be left out; most: view")) << "they are named";
  EXPECT_THAT(refused.message, testing::Not(HasSubstr("view4 "))) << "a good one is not";
  for (const char* way : {"--rule", "--silhouettes", "--max-left-out"}) EXPECT_THAT(refused.hint, HasSubstr(way));
  EXPECT_EQ(refused.summary.coarse_hulls + refused.summary.fine_hulls, 0);
  // The user may want what is left all the same.
  HullOptions options;
  options.max_left_out = 1;
  options.cell_px = 4;
  HullSummary s;
  const Mesh mesh = BuildVisualHull(views, options, SilentProgress(), &s);
  EXPECT_TRUE(CheckSoundness(mesh).IsSolid());
  EXPECT_THAT(s.used, testing::IsSubsetOf({"view0", "view4", "view8", "view12"}));
}

TEST(HullDisagreement, OfAClothInEveryViewEndsAfterFewHulls) {
  HullOptions options;
  options.cell_px = 4;
  HullSummary s;
  try {
    BuildVisualHull(OnATable(12), options, SilentProgress(), &s);
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("view")) << "views are named";
  }
  EXPECT_LE(s.coarse_hulls, 8);
  EXPECT_LE(s.fine_hulls, 17);
}

TEST(HullDisagreement, AHullThatTakesTooLongIsGivenUpWithTheViewsNamed) {
  HullOptions options;
  options.max_minutes = 1e-9;
  const Refused refused = RefusalOf(WithNibbledOutlines(8), options);
  EXPECT_THAT(refused.message, HasSubstr("no hull of these 8 silhouettes within 1e-09 minutes"));
  EXPECT_THAT(refused.hint, HasSubstr("--max-minutes"));
  EXPECT_EQ(refused.summary.fine_hulls, 0);
  options.max_minutes = 0;  // as long as it takes
  options.cell_px = 4;
  EXPECT_NO_THROW(BuildVisualHull(WithNibbledOutlines(8), options, SilentProgress()));
}

TEST(HullDisagreement, TightHasMoreInCommonWithTheSilhouettesAndCoverCoversThem) {
  const std::vector<SilhouetteView> views = WithNibbledOutlines(24);
  HullOptions options;
  options.cell_px = 3;
  HullSummary cover, tight, plain;
  EXPECT_TRUE(CheckSoundness(BuildVisualHull(views, options, SilentProgress(), &cover)).IsSolid());
  options.prefer = HullPreference::kTight;
  EXPECT_TRUE(CheckSoundness(BuildVisualHull(views, options, SilentProgress(), &tight)).IsSolid());
  EXPECT_GE(cover.fit.coverage_min, 0.995);
  EXPECT_LT(tight.fit.coverage_min, cover.fit.coverage_min);
  EXPECT_GT(tight.fit.iou_median, cover.fit.iou_median);
  EXPECT_GT(tight.fit.iou_min, cover.fit.iou_min);
  EXPECT_LT(tight.volume, cover.volume);
  EXPECT_EQ(tight.used.size(), views.size()) << "none is left out for a few pixels";
  EXPECT_TRUE(tight.mended.empty());
  EXPECT_TRUE(tight.tight);
  EXPECT_EQ(tight.fine_hulls, 1);
  EXPECT_LE(tight.coarse_hulls, 7);
  // A dilation that is given is kept: the silhouettes as they are.
  options.dilation_px = 0;
  BuildVisualHull(views, options, SilentProgress(), &plain);
  EXPECT_EQ(plain.dilation_px, 0);
  EXPECT_EQ(plain.coarse_hulls, 0);
  EXPECT_LE(plain.fit.iou_median, tight.fit.iou_median + 1e-3) << "coarse hulls choose, fine ones are compared";
  EXPECT_LE(plain.fit.coverage_min, tight.fit.coverage_min);
}

TEST(HullDisagreement, TightLeavesOutWhatIsOffAltogether) {
  std::vector<SilhouetteView> views = Around(kVase, 16);
  std::swap(views[3].mask, views[9].mask);
  HullOptions options;
  options.prefer = HullPreference::kTight;
  options.cell_px = 4;
  HullSummary s;
  BuildVisualHull(views, options, SilentProgress(), &s);
  EXPECT_EQ(s.used.size(), 14u);
  EXPECT_GT(s.fit.iou_min, 0.9);
}

}  // namespace
}  // namespace lumi::test
