#include <gtest/gtest.h>

#include "proxy/silhouettes/colour_rule.h"
#include "proxy/silhouettes/grab_cut.h"
#include "proxy/silhouettes/silhouette.h"
#include "scene/program/error.h"

namespace lumi::test {
namespace {

double RuleOf(const char* text, double r, double g, double b) {
  const double rgb[3] = {r, g, b};
  return ColourRule(text).Evaluate(rgb, 10.5, 20.5);
}

void Disc(Image8& mask, double x, double y, double radius, std::uint8_t value = 255) {
  for (int j = 0; j < mask.height; ++j)
    for (int i = 0; i < mask.width; ++i)
      if (std::hypot(i + 0.5 - x, j + 0.5 - y) <= radius) mask.At(i, j, 0) = value;
}

TEST(ColourRule, ReadsArithmeticComparisonsAndLogic) {
  EXPECT_EQ(RuleOf("R + 2 * G - B / 4", 1, 10, 8), 19);
  EXPECT_EQ(RuleOf("-(R - G) * -2", 5, 3, 0), 4);
  EXPECT_EQ(RuleOf("(B - R) < 25 && R + G + B > 60", 20, 30, 40), 1);
  EXPECT_EQ(RuleOf("(B - R) < 25 && R + G + B > 60", 20, 30, 50), 0);
  EXPECT_EQ(RuleOf("not R > 5 or g >= 3", 6, 3, 0), 1);
  EXPECT_EQ(RuleOf("!(R != 6)", 6, 0, 0), 1);
  EXPECT_EQ(RuleOf("max(R, min(G, abs(-7)))", 1, 9, 0), 7);
  EXPECT_EQ(RuleOf("X + Y", 0, 0, 0), 31);
  EXPECT_EQ(RuleOf("1 < 2 && 2 < 1 || 3 == 3", 0, 0, 0), 1);
  EXPECT_NEAR(RuleOf("H", 0, 255, 0), 120, 1e-12);
  EXPECT_NEAR(RuleOf("H", 255, 0, 128), 360 - 60 * 128.0 / 255, 1e-12);
  EXPECT_NEAR(RuleOf("S", 200, 100, 100), 0.5, 1e-12);
  EXPECT_NEAR(RuleOf("V + L", 255, 255, 255), 256, 1e-9);
}

TEST(ColourRule, ADivisionByZeroIsNoObject) {
  Image8 photo(2, 1, 3);
  photo.At(1, 0, 0) = 9;
  const Image8 s = SilhouetteFromRule(photo, ColourRule("G / R < 1"));
  EXPECT_EQ(s.At(0, 0, 0), 0);
  EXPECT_EQ(s.At(1, 0, 0), 255);
  EXPECT_EQ(SilhouetteFromRule(photo, ColourRule("1 / 0")).At(0, 0, 0), 0);
}

TEST(ColourRule, WhatIsNotUnderstoodIsNamedByItsPlace) {
  for (const char* text : {"", "R <", "R < 5)", "(R", "Q > 3", "R && ", "min(R)", "R = 5", "1e999", "RR", "R < 5 G"}) {
    EXPECT_THROW(ColourRule{text}, UsageError) << text;
  }
  EXPECT_THROW(ColourRule(std::string(1000, '(') + "R"), UsageError);
  EXPECT_THROW(ColourRule(std::string(10000, '-') + "R"), UsageError);
  try {
    ColourRule("R + $");
    FAIL();
  } catch (const UsageError& e) {
    EXPECT_NE(std::string(e.what()).find("character 5"), std::string::npos) << e.what();
  }
}

TEST(Silhouettes, FromMasksAlphaAndBackgrounds) {
  Image8 rgba(3, 1, 4, 100);
  rgba.At(0, 0, 3) = 255;
  rgba.At(1, 0, 3) = 10;
  EXPECT_TRUE(HasAlpha(rgba));
  EXPECT_EQ(SilhouetteFromAlpha(rgba).data, (Image8::Values{255, 0, 0}));
  EXPECT_THROW(SilhouetteFromAlpha(Image8(1, 1, 3)), std::invalid_argument);
  Image8 mask(2, 1, 3, 255);
  mask.At(1, 0, 1) = mask.At(1, 0, 0) = 0;
  EXPECT_EQ(SilhouetteFromMask(mask).data, (Image8::Values{255, 0}));

  Image8 background(40, 30, 3, 200), photo = background;
  for (int y = 10; y < 20; ++y)
    for (int x = 5; x < 25; ++x) photo.At(x, y, 1) = 120;
  const Image8 by_image = SilhouetteFromBackground(photo, background, 40);
  EXPECT_EQ(Describe(by_image).pixels, 200u);
  EXPECT_EQ(SilhouetteFromBackground(photo, BorderColour(photo), 40).data, by_image.data);
  EXPECT_EQ(Describe(SilhouetteFromBackground(photo, background, 90)).kind, SilhouetteKind::kEmpty);
  EXPECT_THROW(SilhouetteFromBackground(photo, Image8(3, 3, 3), 40), std::invalid_argument);
}

TEST(Silhouettes, HolesPartsAndTheBorderAreCounted) {
  Image8 mask(100, 80, 1);
  EXPECT_EQ(Describe(mask).kind, SilhouetteKind::kEmpty);
  Disc(mask, 30, 40, 20);
  Disc(mask, 30, 40, 8, 0);
  Disc(mask, 75, 40, 10);
  SilhouetteInfo info = Describe(mask);
  EXPECT_EQ(info.parts, 2);
  EXPECT_EQ(info.holes, 1);
  EXPECT_FALSE(info.touches_border);
  Disc(mask, 99, 40, 6);
  EXPECT_TRUE(Describe(mask).touches_border);
  EXPECT_EQ(Describe(Image8(5, 5, 1, 255)).kind, SilhouetteKind::kFull);
  Image8 tiny(50, 50, 1);
  Disc(tiny, 20, 20, 1);
  EXPECT_EQ(Describe(tiny).kind, SilhouetteKind::kTiny);
}

TEST(Silhouettes, CleaningKeepsShapesAndDropsSpecks) {
  Image8 mask(200, 150, 1);
  Disc(mask, 80, 75, 40);
  const Image8 shape = mask;
  mask.At(180, 20, 0) = 255;                               // a speck
  for (int y = 0; y < 150; ++y) mask.At(198, y, 0) = 255;  // a seam along a side
  Disc(mask, 80, 75, 3, 0);                                // a highlight
  CleanOptions clean;
  clean.min_radius_px = 4;
  clean.min_hole_px = 60;
  EXPECT_EQ(Clean(mask, clean).data, shape.data);
  // Nothing but a speck: it is what there is.
  Image8 speck(50, 50, 1);
  speck.At(20, 20, 0) = 255;
  EXPECT_EQ(Clean(speck, clean).data, speck.data);
  EXPECT_EQ(Clean(Image8(50, 50, 1), clean).data, Image8(50, 50, 1).data);
  CleanOptions grow;
  grow.grow_px = 5;
  EXPECT_NEAR(static_cast<double>(Describe(Clean(shape, grow)).pixels), 3.14159 * 45 * 45, 100);
  grow.grow_px = -5;
  EXPECT_NEAR(static_cast<double>(Describe(Clean(shape, grow)).pixels), 3.14159 * 35 * 35, 150);
  CleanOptions close;
  close.close_px = 6;
  Image8 cut = shape;
  for (int y = 0; y < 150; ++y) cut.At(80, y, 0) = cut.At(81, y, 0) = 0;
  EXPECT_EQ(Describe(cut).parts, 2);
  EXPECT_EQ(Describe(Clean(cut, close)).parts, 1);
  close.close_px = -1;
  EXPECT_NE(Validate(close), "");
}

TEST(Silhouettes, GrabCutFindsADiscInABox) {
  Image8 photo(120, 90, 3), truth(120, 90, 1);
  Disc(truth, 60, 45, 22);
  for (int y = 0; y < 90; ++y) {
    for (int x = 0; x < 120; ++x) {
      const bool object = truth.At(x, y, 0) != 0;
      const auto noise = static_cast<std::uint8_t>((x * 7 + y * 13) % 11);
      photo.At(x, y, 0) = static_cast<std::uint8_t>((object ? 190 : 40) + noise);
      photo.At(x, y, 1) = static_cast<std::uint8_t>((object ? 90 : 110) + noise);
      photo.At(x, y, 2) = static_cast<std::uint8_t>(60 + noise);
    }
  }
  const Image8 found = SilhouetteFromBox(photo, {30, 15, 90, 75});
  std::size_t wrong = 0;
  for (std::size_t n = 0; n < found.data.size(); ++n) wrong += found.data[n] != truth.data[n] ? 1 : 0;
  EXPECT_LT(wrong, 30u);  // of 1520: pixels of the border
  EXPECT_EQ(SilhouetteFromBox(photo, {30, 15, 90, 75}).data, found.data);
  EXPECT_THROW(SilhouetteFromBox(photo, {0, 0, 120, 90}), DataError);
  EXPECT_THROW(SilhouetteFromBox(photo, {300, 15, 390, 75}), DataError);
  EXPECT_THROW(SilhouetteFromBox(photo, {30, 15, std::nan(""), 75}), DataError);
}

}  // namespace
}  // namespace lumi::test
