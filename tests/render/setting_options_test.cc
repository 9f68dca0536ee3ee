#include "render/settings_json.h"

#include <gtest/gtest.h>

#include "scene/program/error.h"

namespace lumi {
namespace {

TEST(SettingOptions, EveryOptionComesBack) {
  RadianceSettings s;
  s.similarity = Similarity::kFull;
  s.correlation = Correlation::kFallingLeaves;
  s.k = 0;
  s.grid_columns = 25;
  s.grid_rows = 16;
  s.sampling = Sampling::kInterpolated;
  s.epipoles = false;
  s.sum = WeightSum::kConstrained;
  s.combine = Combine::kAdditive;
  s.alpha = 0.5;
  s.resolution = Resolution::kJacobian;
  s.resolution_low = 0.7;
  s.resolution_high = 2;
  s.field_of_view = false;
  s.visibility = false;
  s.time = true;
  s.time_s = 12.25;
  s.exposure = true;
  s.prefilter = false;
  RadianceSettings back;
  const auto words = JsonKeys(s).Words();
  for (const auto& [name, text] : words) EXPECT_TRUE(SetOption(back, name, text)) << name;
  EXPECT_EQ(s, back);
  EXPECT_EQ(words.at("k"), "all");
  EXPECT_EQ(words.at("grid"), "25x16");
  EXPECT_FALSE(SetOption(back, "backend", "cpu")) << "no setting of the reconstruction";
}

TEST(SettingOptions, TheCommandLinesTextWillDo) {
  RadianceSettings s;
  EXPECT_TRUE(SetOption(s, "k", "7"));
  EXPECT_TRUE(SetOption(s, "grid", "16x16"));
  EXPECT_TRUE(SetOption(s, "r-max-deg", "10"));
  EXPECT_EQ(s.k, 7);
  EXPECT_EQ(s.grid_columns, 16);
  EXPECT_EQ(s.grid_rows, 16);
  EXPECT_NEAR(s.r_max_rad, 0.17453, 1e-5);
}

TEST(SettingOptions, BadValuesAreNamed) {
  for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{{"k", "0"},
                                                                                    {"k", "17"},
                                                                                    {"k", "four"},
                                                                                    {"k", "4x"},
                                                                                    {"grid", "1"},
                                                                                    {"grid", "25"},
                                                                                    {"grid", "8x"},
                                                                                    {"grid", "8x1"},
                                                                                    {"grid", "x8"},
                                                                                    {"resolution", "sharp"},
                                                                                    {"epipoles", "maybe"},
                                                                                    {"alpha", "1,0"},
                                                                                    {"alpha", "nan"},
                                                                                    {"alpha", ""},
                                                                                    {"resolution-range", "2"},
                                                                                    {"similarity", "Full"}}) {
    RadianceSettings s;
    try {
      SetOption(s, name, value);
      ADD_FAILURE() << name << " " << value;
    } catch (const UsageError& e) {
      EXPECT_NE(std::string(e.what()).find("--" + name), std::string::npos) << e.what();
    }
  }
}

TEST(SettingOptions, OffIsAlsoFalseAsJsonHasIt) {
  RadianceSettings s;
  s.resolution = Resolution::kJacobian;
  s.visibility = true;
  EXPECT_TRUE(SetOption(s, "resolution", "false"));
  EXPECT_TRUE(SetOption(s, "visibility", "false"));
  EXPECT_EQ(s.resolution, Resolution::kOff);
  EXPECT_FALSE(s.visibility);
}

TEST(Settings, ImpossibleCombinationsAreRefused) {
  const auto refused = [](auto change) {
    RadianceSettings s;
    change(s);
    return !Validate(s).empty();
  };
  EXPECT_FALSE(refused([](RadianceSettings&) {}));
  EXPECT_TRUE(refused([](RadianceSettings& s) { s.alpha = -1; }));
  EXPECT_TRUE(refused([](RadianceSettings& s) { s.r_min_rad = 2 * s.r_max_rad; }));
  EXPECT_TRUE(refused([](RadianceSettings& s) { s.resolution_high = 1; }));
  EXPECT_TRUE(refused([](RadianceSettings& s) { s.time_window_s = 0; }));
  EXPECT_TRUE(refused([](RadianceSettings& s) { s.grid_columns = 8; }));
  EXPECT_TRUE(refused([](RadianceSettings& s) { s.similarity = Similarity::kFull; })) << "1/h is no covariance";
}

}  // namespace
}  // namespace lumi
