// The table of accuracy against time that all stages share: its front, and how it is written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <new>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/tradeoff/table.h"
#include "tests/support/json_rows.h"

namespace lumi {
namespace {

using nlohmann::ordered_json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kNan = CostAndQuality::kNone, kInfinity = std::numeric_limits<double>::infinity();

TEST(ParetoFront, HoldsWhatNoOtherRowBeatsInBothTheCheapestFirst) {
  EXPECT_THAT(ParetoFront({{10, 30}, {5, 31}, {20, 33}, {15, 30}, {1, 10}}), ElementsAre(4, 1, 2));
  EXPECT_THAT(ParetoFront({{7, -2}}), ElementsAre(0));
  EXPECT_THAT(ParetoFront({}), IsEmpty());
}

TEST(ParetoFront, OfTiesTheBetterTheCheaperOrTheFirstIsOnIt) {
  EXPECT_THAT(ParetoFront({{5, 30}, {5, 31}}), ElementsAre(1)) << "equal cost";
  EXPECT_THAT(ParetoFront({{6, 30}, {5, 30}}), ElementsAre(1)) << "equal quality";
  EXPECT_THAT(ParetoFront({{5, 30}, {5, 30}, {5, 30}}), ElementsAre(0));
  EXPECT_THAT(ParetoFront({{5, 31}, {5, 30}, {6, 31}, {6, 32}}), ElementsAre(0, 3));
}

TEST(ParetoFront, RowsWithoutACostOrAQualityAreOnNone) {
  EXPECT_THAT(ParetoFront({{kNan, 40}, {1, kNan}, {0, 40}, {-1, 40}, {kInfinity, 40}, {1, kInfinity}, {}, {9, 20}}),
              ElementsAre(7));
}

TEST(RecommendedRow, IsTheBestWithinTheBudgetAndTheCheapestWhereNoneFits) {
  const std::vector<CostAndQuality> rows = {{90, 35}, {5, 20}, {16, 18}, {15, 30}};
  EXPECT_EQ(RecommendedRow(rows, 16).row, 3U) << "not the beaten one, whose cost is nearest";
  EXPECT_TRUE(RecommendedRow(rows, 15).fits) << "a budget that is met exactly is met";
  EXPECT_EQ(RecommendedRow(rows, 14.9).row, 1U);
  EXPECT_EQ(RecommendedRow(rows, std::nullopt).row, 0U);
  const Recommended below = RecommendedRow(rows, 4);
  EXPECT_EQ(below.row, 1U);
  EXPECT_FALSE(below.fits);
  EXPECT_THROW(RecommendedRow({{kNan, 3}}, 1), std::invalid_argument);
}

struct Row {
  std::string name, line;
  double seconds = 0, error_px = 0;
  int views = 0;
  std::optional<double> share;
  std::string failed;
};

TradeoffTable TableOf(const std::vector<Row>& rows) {
  using enum TradeoffRole;
  TradeoffTable table =
      TradeoffTableOf<Row>({{{"name", kSetting, "setting", -10, "{}", "setting"}, &Row::name},
                            {{"line", kSetting}, &Row::line},
                            {{"seconds", kCost, "seconds", 8, "{:.2f}"}, &Row::seconds},
                            {{"figures.error_px", kLessIsBetter, "error", 9, "{:.1f} px"}, &Row::error_px},
                            {{"views", kFigure, "views", 6}, &Row::views},
                            {{"share", kMoreIsBetter, "share", 8, "{:.1f}%"}, &Row::share},
                            {{"", kFigure, "both", 6}, [](const Row& r) { return std::to_string(r.views) + "/9"; }},
                            {{"failed", kFailed}, &Row::failed}},
                           rows);
  table.MarkFront("seconds", "figures.error_px");
  return table;
}

const std::vector<Row> kRows = {{"as given: 9, \"all\"", "", 4, 0.5, 9, 0.25, ""},
                                {"4 views", "views", 1.0 / 3, 1.5, 4, {}, ""},
                                {"5 views", "views", 5, 2, 5, {}, ""},
                                {"1 view", "views", 0.1, 0, 0, {}, "too few, \"say\""}};

TEST(TradeoffTable, IsATextWithItsFrontStarredAndReasonsInsteadOfFigures) {
  EXPECT_EQ(TextOf(TableOf(kRows)),
            "  setting             seconds     error  views    share   both\n"
            "* as given: 9, \"all\"     4.00    0.5 px      9    25.0%    9/9\n"
            "* 4 views                0.33    1.5 px      4        -    4/9\n"
            "  5 views                5.00    2.0 px      5        -    5/9\n"
            "  1 view                 0.10 too few, \"say\"");
  EXPECT_EQ(TextOf(TableOf({})), "  setting     seconds     error  views    share   both");
}

TEST(TradeoffTable, QuotesInCsvWhatNeedsIt) {
  EXPECT_EQ(CsvOf(TableOf(kRows)),
            "setting,line,seconds,error_px,views,share,failed,front\n"
            "\"as given: 9, \"\"all\"\"\",,4,0.5,9,0.25,,1\n"
            "\"4 views\",views,0.3333333,1.5,4,,,1\n"
            "\"5 views\",views,5,2,5,,,0\n"
            "\"1 view\",views,0.1,,,,\"too few, \"\"say\"\"\",\n");
}

#ifndef __SANITIZE_ADDRESS__  // which needs more addresses than there are
TEST(TradeoffTable, MemoryMayRunOutWhileAValueIsCopied) {
  const TradeoffValue value(std::string(std::size_t{256} << 20, 'x'));
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &limit), 0);
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  rlimit less = limit;
  less.rlim_cur = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + (std::size_t{64} << 20);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &less), 0);
  TradeoffValue other("as it was");
  EXPECT_THROW(const TradeoffValue copy(value), std::bad_alloc);
  EXPECT_THROW(other = value, std::bad_alloc);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &limit), 0);
  EXPECT_EQ(std::get<std::string>(other), "as it was");
}
#endif

TEST(TradeoffTable, ComesBackFromJsonAsItWas) {
  TradeoffTable table = TableOf(kRows);
  table.facts = {{"device", "a \"GPU\""}, {"best.row", 0}};
  const ordered_json json = ordered_json::parse(JsonTextOf(table));
  EXPECT_EQ(json["device"], "a \"GPU\"");
  EXPECT_EQ(json["best"]["row"], 0);
  const ordered_json& rows = json["points"];
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[1]["seconds"].get<double>(), 1.0 / 3) << "to the last bit";
  EXPECT_EQ(rows[0]["figures"]["error_px"], 0.5);
  EXPECT_TRUE(rows[1]["share"].is_null());
  EXPECT_EQ(rows[0]["front"], true);
  EXPECT_FALSE(rows[0].contains("failed"));
  EXPECT_FALSE(rows[0].contains(""));
  EXPECT_EQ(rows[3]["failed"], "too few, \"say\"");
  for (const char* figure : {"figures", "views", "share", "front"}) EXPECT_FALSE(rows[3].contains(figure)) << figure;

  TradeoffTable again{.columns = table.columns};
  AddRows(rows, again);
  EXPECT_EQ(CsvOf(again), CsvOf(table));
  EXPECT_EQ(ordered_json::parse(JsonTextOf(again))["points"], rows);
}

TEST(TradeoffTable, RefusesARowThatIsNoneAndAColumnThatIsNot) {
  TradeoffTable table = TableOf({});
  EXPECT_THROW(table.Add({"too", "few"}), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(table.Front("seconds", "nothing")), std::invalid_argument);
}

TEST(TradeoffTable, IsDrawnASeriesALineWithTheFrontAsSteps) {
  const TradeoffTable table = TableOf(kRows);
  TradeoffPanel panel{"Error",
                      "",
                      "seconds",
                      {"seconds", true},
                      "figures.error_px",
                      {"px", true},
                      {{"", "as given"}, {"views", "fewer views", "#1f6feb"}, {"cell", "wider cells"}},
                      "line"};
  panel.front = table.Front("seconds", "figures.error_px");
  panel.least = 1;
  const Plot plot = PlotOf(table, panel);
  ASSERT_EQ(plot.series.size(), 3U) << "the front, and a series for each line that has a row";
  EXPECT_TRUE(plot.series[0].steps);
  EXPECT_EQ(plot.series[0].points[0].x, 1.0 / 3);
  ASSERT_EQ(plot.series[1].points.size(), 1U);
  EXPECT_EQ(plot.series[1].points[0].label, "as given");
  EXPECT_EQ(plot.series[1].points[0].y, 1) << "drawn where the axis ends";
  EXPECT_THAT(plot.series[1].points[0].tip, HasSubstr("all"));
  EXPECT_EQ(plot.series[2].points.size(), 2U) << "a row that failed has no point";
  panel.label_front_only = true;
  EXPECT_EQ(PlotOf(table, panel).series[2].points[1].label, "");
}

TEST(TradeoffTable, IsWrittenAsThreeFiles) {
  const TemporaryFolder folder;
  const TradeoffFiles files = WriteTradeoff(folder.path() / "new" / "stage", TableOf(kRows), {Plot()});
  EXPECT_EQ(files.json.filename(), "stage.json");
  EXPECT_EQ(ReadText(files.json), JsonTextOf(TableOf(kRows)));
  EXPECT_EQ(ReadText(files.csv), CsvOf(TableOf(kRows)));
  EXPECT_THAT(ReadText(files.svg), HasSubstr("</svg>"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "new"), {}), 3);
}

}  // namespace
}  // namespace lumi
