// The comparison of methods on a tiny scene on disk, and the figures of Table 3.1 by methods whose answer is known.
#include "render/tradeoff/methods.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "capture_files.h"
#include "render/comparators/comparators.h"
#include "render/tradeoff/ray_bench.h"
#include "render/tradeoff/ray_figures.h"
#include "render/tradeoff/table_3_1.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct SceneOfPhotos {
  fs::path folder;
  SceneOfPhotos(const std::string& name, int views)
      : folder(fs::temp_directory_path() / ("lumi-methods-" + name + "-" + std::to_string(::getpid()))) {
    fs::remove_all(folder);
    fs::create_directories(folder);
    test::Capture capture = test::MakeCapture(views, 64);
    test::WriteAsScene(capture, folder / "scene");
  }
  ~SceneOfPhotos() { fs::remove_all(folder); }
  MethodsOptions Options() const {
    MethodsOptions o;
    o.scene = folder / "scene";
    o.output = folder / "out";
    o.repeats = 1;
    return o;
  }
};

const Json& RowOf(const Json& rows, const std::string& method) {
  for (const Json& r : rows)
    if (r["method"] == method) return r;
  static const Json none;
  ADD_FAILURE() << "no row of " << method;
  return none;
}

TEST(Methods, EachIsChosenOnOneFoldAndReportedOnTheOther) {
  const SceneOfPhotos d("folds", 32);
  MethodsOptions o = d.Options();
  o.methods = {"ulr", "debevec-1996", "sibr-ulr"};
  const Json j = Json::parse(RunMethods(o, SilentProgress()).keys.Text());
  ASSERT_EQ(j["methods"].size(), 4u);  // the nearest photo first
  EXPECT_EQ(j["views"], 4);            // 0, 8, 16, 24
  EXPECT_EQ(RowOf(j["methods"], "ulr")["tried"], 12);
  EXPECT_EQ(RowOf(j["methods"], "debevec-1996")["tried"], 12);
  for (const Json& r : j["per_view"]) {
    ASSERT_EQ(r["views"].size(), 4u);
    EXPECT_EQ(r["views"][1]["name"], "view108.png");
  }
  const double nearest = RowOf(j["methods"], "nearest photo")["psnr_seen_db"];
  for (const char* name : {"ulr", "debevec-1996", "sibr-ulr"})
    EXPECT_GT(RowOf(j["methods"], name)["psnr_seen_db"], nearest) << name;
  // What is chosen is a file for --settings.
  EXPECT_EQ(RowOf(j["per_view"], "sibr-ulr")["settings"]["method"], "sibr-ulr");
  for (const char* file : {"methods.json", "methods.csv", "methods.svg", "methods-views.csv"})
    EXPECT_TRUE(fs::exists(o.output / file)) << file;
  TableOptions report{{o.output / "methods.json"}, d.folder / "report.md"};
  EXPECT_THAT(RunMethodsReport(report).text, testing::HasSubstr("| sibr-ulr |"));
  EXPECT_TRUE(fs::exists(report.output));
  EXPECT_THROW(RunTable(report), InputError) << "properties were not asked for";
}

TEST(Methods, OfFewPhotosEachIsLeftOutInTurn) {
  const SceneOfPhotos d("few", 9);
  MethodsOptions o = d.Options();
  o.methods = {"ulr", "heigl-1999"};
  o.output.clear();
  const Json j = Json::parse(RunMethods(o, SilentProgress()).keys.Text());
  EXPECT_EQ(j["views"], 5);  // 0, 2, 4, 6, 8: the others choose
  EXPECT_FALSE(fs::exists(d.folder / "out"));
}

TEST(Methods, AMethodThatCannotTakeTheCamerasIsARefusedRow) {
  // Two photos, one of which is left out: there is no pair.
  const SceneOfPhotos two("two", 2);
  MethodsOptions o = two.Options();
  o.methods = {"ulr", "no-such"};
  EXPECT_THROW(RunMethods(o, SilentProgress()), UsageError);
  o.methods = {"ulr", "lhuillier-quan-1999"};
  const Json j = Json::parse(RunMethods(o, SilentProgress()).keys.Text());
  EXPECT_THAT(RowOf(j["methods"], "lhuillier-quan-1999")["refused"].get<std::string>(),
              testing::HasSubstr("two photos at different places"));
  EXPECT_THAT(RunMethodsReport({{o.output / "methods.json"}, {}}).text, testing::HasSubstr("refused"));
}

class TableFigures : public testing::Test {
 protected:
  RayFigures Of(Algorithm method) const {
    RadianceSettings s;
    s.method = method;
    if (method == Algorithm::kUlr) s.resolution = Resolution::kJacobian;
    return MeasureRays(bench_, s);
  }
  const test::Capture capture_ = test::MakeCapture(13, 64);
  const RayBench bench_{capture_.scene, capture_.proxy};
};

TEST_F(TableFigures, ThisRendererHasAllThatRaysTell) {
  const RayFigures f = Of(Algorithm::kUlr);
  EXPECT_EQ(*f.photos_used, 1);
  EXPECT_LT(*f.direction_error, 0.5);
  EXPECT_GT(*f.own_weight, 0.999);
  EXPECT_LT(*f.ray_difference, 1e-6);
  EXPECT_LT(*f.jump, 0.01);
  EXPECT_LT(*f.border_weight, 0.05);
  EXPECT_LT(*f.coarse_weight_ratio, 0.5);
  EXPECT_LT(*f.hidden_weight, 0.05);
}

TEST_F(TableFigures, MethodsMissWhatTheirPapersDoNotHave) {
  // SIBR's weight of a photo at its own camera is 1 - 1e-4/fourth over the sum with two others.
  const RayFigures sibr = Of(Algorithm::kSibrUlr);
  EXPECT_LT(*sibr.own_weight, 0.9);
  EXPECT_GT(*sibr.border_weight, 0.3) << "frustum tests are hard";
  // A view map is looked up a face: neighbouring views jump, and a photo is not given back.
  const RayFigures faces = Of(Algorithm::kDebevec1998);
  EXPECT_GT(*faces.jump, 0.05);
  EXPECT_LT(*faces.own_weight, 0.9);
  // Barycentric coordinates in the view's plane change along a ray; 1/angle does not, and gives a photo back.
  EXPECT_GT(*Of(Algorithm::kHeigl1999).ray_difference, 0.05);
  const RayFigures angles = Of(Algorithm::kDebevec1996);
  EXPECT_LT(*angles.ray_difference, 1e-5);
  EXPECT_GT(*angles.own_weight, 0.999);
  EXPECT_EQ(*angles.coarse_weight_ratio, 1) << "angles know no resolution";
  // A light field has no geometry that hides anything from a photo.
  EXPECT_GT(*Of(Algorithm::kGortler1996).hidden_weight, *angles.hidden_weight);
}

TEST(Table31, TicksFollowFromFiguresAndTheWorstSceneDecides) {
  SceneFigures good{"good", {{"debevec-1996", {}}}}, bad{"bad", {{"debevec-1996", {}}}};
  for (std::size_t i = 0; i < kTableColumns; ++i) {
    const TableColumn& c = TableColumns()[i];
    good.properties[0].figures[i] = c.threshold;
    bad.properties[0].figures[i] = c.less_is_better ? 2 * c.threshold : 0.5 * c.threshold;
  }
  const std::string all = TableText({good});
  const auto line = [](const std::string& text) {
    const std::size_t at = text.find("| Debevec et al. 1996 |");
    return text.substr(at, text.find('\n', at) - at);
  };
  // The thesis gives it neither real-time nor resolution.
  EXPECT_THAT(line(all), testing::HasSubstr("real-time (good), resolution (good)"));
  EXPECT_TRUE(line(all).ends_with("|  |")) << "nothing was refused";
  SceneFigures refusing{"ring", {}, {{"debevec-1996", "no"}, {"ulr", ""}}};
  EXPECT_TRUE(line(TableText({good, refusing})).ends_with("| ring |"));
  const std::string none = line(TableText({good, bad}));
  EXPECT_THAT(none, testing::Not(testing::HasSubstr("**yes**")));
  EXPECT_THAT(line(all), testing::HasSubstr("| **yes** 100 (no) |")) << "a tick that the thesis does not give";
  EXPECT_THAT(none, testing::HasSubstr("epipole consistency (bad)"));
  for (const TableRow& row : TableRows()) {
    EXPECT_TRUE(row.ticks.empty() || row.ticks.size() == kTableColumns) << row.paper;
    EXPECT_NE(row.method.empty(), row.why_not.empty()) << row.paper;
  }
}

}  // namespace
}  // namespace lumi
