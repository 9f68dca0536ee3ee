// The table of settings that --tradeoff measures, its front, and what is written of it.
#include "reconstruct/tradeoff.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include "tests/support/summary_json.h"

namespace lumi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::set<int> ValuesOf(const std::vector<ReconstructSetting>& settings, int ReconstructOptions::*value) {
  std::set<int> values;
  for (const ReconstructSetting& s : settings) values.insert(s.options.*value);
  return values;
}

TEST(TradeoffSettings, OfTheFactorisationAreFeaturesWindowAndAdjustment) {
  ReconstructOptions o;
  o.backend = Backend::kFactorization;
  o.tradeoff = true;
  o.reference = "truth";
  const auto settings = TradeoffSettings(o, {60, true, 640});
  EXPECT_THAT(ValuesOf(settings, &ReconstructOptions::features), ElementsAre(200, 400, 800, 1600));
  EXPECT_THAT(ValuesOf(settings, &ReconstructOptions::window_frames), ElementsAre(10, 20, 40));
  EXPECT_THAT(ValuesOf(settings, &ReconstructOptions::max_image_size_px),
              ElementsAre(0));     // a video is followed at its own size
  ASSERT_EQ(settings.size(), 9U);  // as given, 3 + 2 + 1 beside, two of all dials
  EXPECT_EQ(settings[0].name, "as given: features 800, window 20, adjusted");
  EXPECT_EQ(settings[0].line, "");
  EXPECT_EQ(settings[1].name, "features 200");
  EXPECT_EQ(settings[7].name, "features 200, window 10, not adjusted");
  EXPECT_EQ(settings[7].line, "several");
  EXPECT_EQ(settings[8].name, "features 1600, window 40");
  EXPECT_EQ(settings[8].effort, 4);
  for (const ReconstructSetting& s : settings) {
    EXPECT_FALSE(s.options.tradeoff);
    EXPECT_THAT(s.options.reference.string(), IsEmpty());
    EXPECT_FALSE(s.options.database_beside);
    EXPECT_LE(s.effort, settings[8].effort);
  }
}

TEST(TradeoffSettings, OfColmapAreImageSizeAndFeaturesAndStopAtThePhotosSize) {
  const auto settings = TradeoffSettings(ReconstructOptions{}, {20, false, 1000});
  EXPECT_THAT(ValuesOf(settings, &ReconstructOptions::max_image_size_px), ElementsAre(250, 500, 1000));
  EXPECT_THAT(ValuesOf(settings, &ReconstructOptions::max_features), ElementsAre(2048, 4096, 8192, 16384));
  ReconstructOptions smaller;
  smaller.max_image_size_px = 600;
  EXPECT_THAT(ValuesOf(TradeoffSettings(smaller, {20, false, 1000}), &ReconstructOptions::max_image_size_px),
              ElementsAre(150, 300, 600, 1000));
}

std::vector<std::string> NamesOn(const std::string& line, const std::vector<ReconstructSetting>& settings) {
  std::vector<std::string> names;
  for (const ReconstructSetting& s : settings)
    if (s.line == line) names.push_back(s.name);
  return names;
}

TEST(TradeoffSettings, OfColmapAlsoArePairsMapperAndWhoFindsTheFeatures) {
  const auto few = TradeoffSettings(ReconstructOptions{}, {30, false, 1000});
  EXPECT_EQ(few[0].name, "as given: 1000 px, features 4096, all pairs, quick mapper, own features");
  EXPECT_THAT(NamesOn("pairs", few), ElementsAre("10 partners", "20 partners"));
  EXPECT_THAT(NamesOn("mapper", few), ElementsAre("careful mapper"));
  EXPECT_THAT(NamesOn("features by", few), ElementsAre("COLMAP's features"));
  EXPECT_THAT(NamesOn("several", few),
              ElementsAre("250 px, features 1024, 10 partners", "features 8192, careful mapper"));
  for (const ReconstructSetting& s : few) {
    ReconstructOptions run = s.options;
    run.input = "photos", run.scene = "scene";
    EXPECT_EQ(Validate(run), "") << s.name;
  }
  const auto many = TradeoffSettings(ReconstructOptions{}, {150, false, 1000});
  EXPECT_EQ(many[0].name, "as given: 1000 px, features 4096, 40 partners, quick mapper, own features");
  EXPECT_THAT(NamesOn("pairs", many), ElementsAre("10 partners", "20 partners", "80 partners", "all pairs"));
  EXPECT_THAT(NamesOn("mapper", many), ElementsAre("hierarchical mapper", "careful mapper"));
  const auto crowd = TradeoffSettings(ReconstructOptions{}, {1000, false, 1000});
  EXPECT_THAT(NamesOn("pairs", crowd), ElementsAre("10 partners", "20 partners", "80 partners"));
  ReconstructOptions neighbours;
  neighbours.matching = Matching::kSequential;
  EXPECT_THAT(NamesOn("pairs", TradeoffSettings(neighbours, {150, false, 1000})), IsEmpty());
}

TEST(TradeoffSettings, StayWithinWhatTheCaptureHas) {
  ReconstructOptions o;
  o.backend = Backend::kFactorization;
  // All windows of 20 and more hold all of 12 photos.
  const auto few = TradeoffSettings(o, {12, false, 640});
  EXPECT_THAT(ValuesOf(few, &ReconstructOptions::window_frames), ElementsAre(6, 20));
  EXPECT_THAT(ValuesOf(few, &ReconstructOptions::features), ElementsAre(512, 1024, 2048, 4096));
  EXPECT_THAT(ValuesOf(few, &ReconstructOptions::max_image_size_px), ElementsAre(160, 320, 640));
  o.features = 60;
  o.adjust = false;
  const auto sparse = TradeoffSettings(o, {30, true, 640});
  EXPECT_THAT(ValuesOf(sparse, &ReconstructOptions::features), ElementsAre(60, 120));  // fewer than 50 are refused
  EXPECT_THAT(ValuesOf(sparse, &ReconstructOptions::window_frames), ElementsAre(10, 20, 30));
  std::set<bool> adjusted;
  for (const ReconstructSetting& s : sparse) adjusted.insert(s.options.adjust);
  EXPECT_EQ(adjusted.size(), 2U);
  std::set<std::string> names;
  for (const auto& s : sparse) {
    EXPECT_TRUE(names.insert(s.name).second) << s.name;
    ReconstructOptions run = s.options;
    run.input = "video.mp4", run.scene = "scene";
    EXPECT_EQ(Validate(run), "") << s.name;
  }
}

TradeoffRow Row(const std::string& name, double seconds, double px, std::optional<double> centres,
                int registered = 10) {
  TradeoffRow row;
  row.setting.name = name;
  row.setting.options.max_image_size_px = 800;
  row.setting.options.max_features = 1024;
  row.seconds = seconds;
  row.mean_reprojection_error_px = px;
  row.images_registered = registered;
  row.images_total = 10;
  row.points = 500;
  row.upgrade = "metric";
  if (centres) row.poses = PoseErrors{*centres, 2 * *centres, 0.1 * *centres, 0.2 * *centres};
  return row;
}

std::vector<std::string> FrontOf(std::vector<TradeoffRow> rows) {
  MarkFront(rows);
  std::vector<std::string> names;
  for (const TradeoffRow& row : rows)
    if (row.on_front) names.push_back(row.setting.name);
  return names;
}

TEST(TradeoffFront, HoldsWhatNothingElseBeatsInBoth) {
  EXPECT_THAT(FrontOf({Row("slow", 9, 0.5, 0.1), Row("fast", 1, 0.4, 0.9), Row("between", 4, 0.9, 0.3),
                       Row("beaten", 5, 0.1, 0.35)}),
              ElementsAre("slow", "fast", "between"));
  // Without a reference by the reprojection error.
  EXPECT_THAT(FrontOf({Row("slow", 9, 0.5, {}), Row("fast", 1, 0.4, {})}), ElementsAre("fast"));
}

TEST(TradeoffFront, PhotosLeftOutAreNoAccuracyAndTheReferenceIsNoJudgeOfItself) {
  std::vector<TradeoffRow> rows{Row("whole", 9, 0.5, 0.5), Row("half", 1, 0.1, 0.1, 5), Row("reference", 20, 0.3, {}),
                                Row("quasi-affine", 1, 0.3, {})};
  rows[2].is_reference = true;
  TradeoffRow failed = Row("failed", 0.1, 0, {});
  failed.failed = "planar scene";
  rows.push_back(failed);
  EXPECT_THAT(FrontOf(rows), ElementsAre("whole"));
  EXPECT_THAT(FrontOf({failed}), IsEmpty());
}

TEST(Tradeoff, AFailedSettingIsARowWithItsReason) {
  MeasuredReconstruction m;
  m.tradeoff.reference = "truth";
  m.tradeoff.rows = {Row("as given: 800 px", 8, 0.5, 0.25), Row("features 256", 2, 0.5, {})};
  m.tradeoff.rows[1].failed = "only 3 points, \"say\"";
  m.tradeoff.rows[1].setting.line = "features";
  m.tradeoff.files.json = "scene/tradeoff/colmap.json";
  MarkFront(m.tradeoff.rows);

  const auto j = AsJson(m);
  EXPECT_EQ(j["images_total"], 0);  // the scene's own summary stands beside it
  const auto& rows = j["tradeoff"]["points"];
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0]["settings"], (nlohmann::json{{"max_image_size", 800},
                                                 {"max_features", 1024},
                                                 {"matching", "auto"},
                                                 {"mapper", "quick"},
                                                 {"finder", "own"}}));
  EXPECT_EQ(rows[0]["centre_rms_percent"], 0.25);
  EXPECT_EQ(rows[0]["seconds_ratio"], 1);
  EXPECT_TRUE(rows[0]["front"]);
  EXPECT_EQ(rows[1]["failed"], "only 3 points, \"say\"");
  EXPECT_FALSE(rows[1].contains("mean_reprojection_error_px"));

  EXPECT_THAT(Describe(m.tradeoff),
              testing::AllOf(HasSubstr("* as given: 800 px"), HasSubstr("only 3 points"), HasSubstr("against truth")));
  EXPECT_FALSE(AsJson(m.summary).contains("tradeoff"));
  const std::string csv = TradeoffCsv(m.tradeoff);
  EXPECT_THAT(csv, HasSubstr("\"only 3 points, \"\"say\"\"\"\n"));
  std::set<std::ptrdiff_t> commas;
  std::istringstream lines(csv);
  for (std::string line; std::getline(lines, line);) {
    bool quoted = false;
    commas.insert(std::count_if(line.begin(), line.end(),
                                [&](char c) { return quoted = quoted != (c == '"'), c == ',' && !quoted; }));
  }
  EXPECT_EQ(commas.size(), 1U) << csv;  // every line has as many fields
  EXPECT_THAT(TradeoffSvg(m.tradeoff), testing::AllOf(HasSubstr("Camera centres"), HasSubstr("Reprojection error"),
                                                      HasSubstr("as given: 800 px")));
  m.tradeoff.rows.clear();
  EXPECT_THAT(TradeoffSvg(m.tradeoff), HasSubstr("no measurement"));
}

}  // namespace
}  // namespace lumi
