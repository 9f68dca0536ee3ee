#include "render/tradeoff/tradeoff.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "capture_files.h"
#include "render/settings_json.h"
#include "render/tradeoff/budget.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/front.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/sweep.h"
#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/plot/plot.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

FrontPoint At(double ms, double db, int k = 4) {
  FrontPoint p;
  p.name = "k " + std::to_string(k);
  p.settings.k = k;
  p.ms = ms;
  p.psnr_holdout_db = db;
  return p;
}

// A folder of its own that goes with it.
struct Folder {
  fs::path path;
  explicit Folder(const std::string& name)
      : path(fs::temp_directory_path() / ("lumi-tradeoff-" + name + "-" + std::to_string(::getpid()))) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
};

// A scene of `views` tiny photos on disk, with its true proxy.
struct SceneOnDisk {
  Folder folder;
  test::Capture capture;
  explicit SceneOnDisk(const std::string& name, int views) : folder(name), capture(test::MakeCapture(views, 64)) {
    test::WriteAsScene(capture, Scene());
  }
  fs::path Scene() const { return folder.path / "scene"; }
  MeasureOptions Options(const std::string& out) const {
    MeasureOptions o;
    o.scene = Scene();
    o.output = folder.path / out;
    o.holdout = 4;
    o.views = 1;
    o.repeats = 1;
    o.quick = true;
    return o;
  }
};

TEST(Front, KeepsWhatNothingElseBeatsInBothTimeAndQuality) {
  const std::vector<FrontPoint> front =
      ParetoFront({At(10, 30, 1), At(5, 31, 2), At(20, 33, 3), At(20, 32, 4), At(40, 33, 5), At(1, 10, 6)});
  ASSERT_EQ(front.size(), 3u);
  EXPECT_EQ(front[0].settings.k, 6);
  EXPECT_EQ(front[1].settings.k, 2);
  EXPECT_EQ(front[2].settings.k, 3);
}

TEST(Front, HasNoPointWithoutATimeOrAFigure) {
  FrontPoint bare = At(5, 0);
  bare.psnr_holdout_db.reset();
  EXPECT_TRUE(ParetoFront({bare, At(0, 30), At(NAN, 30), At(INFINITY, 30), At(3, NAN)}).empty());
  bare.psnr_optimum_db = 20;
  EXPECT_EQ(ParetoFront({bare}).size(), 1u);
}

TEST(Front, RecommendsTheBestWithinTheBudgetAndTheFastestWhereNoneFits) {
  const std::vector<FrontPoint> front = {At(5, 20), At(15, 30), At(90, 35)};
  bool fits = false;
  EXPECT_EQ(Recommend(front, 16, &fits), 1u);
  EXPECT_TRUE(fits);
  EXPECT_EQ(Recommend(front, 15), 1u) << "a budget that is met exactly is met";
  EXPECT_EQ(Recommend(front, 1, &fits), 0u);
  EXPECT_FALSE(fits);
  EXPECT_EQ(Recommend(front, std::nullopt), 2u);
  EXPECT_THROW(Recommend({}, 1), std::invalid_argument);
}

struct Stored {
  Folder folder{"front"};
  StoredFront front;
  Stored() {
    WriteMesh(ProxyPath(folder.path, "mesh"), test::PlaneAndBox());
    front.key = {"mesh", "cpu", "a device", 640, 480};
    front.proxy_fingerprint = Fingerprint(ProxyPath(folder.path, "mesh"));
    front.points = {At(5, 20, 1), At(20, 30, 2)};
  }
};

TEST(Front, ComesBackAsItWasStoredAndScalesWithThePixels) {
  Stored s;
  s.front.points[1].settings.sampling = Sampling::kInterpolated;
  s.front.points[1].settings.grid_columns = s.front.points[1].settings.grid_rows = 16;
  s.front.points[1].psnr_optimum_db = 41.5;
  WriteFront(s.folder.path, s.front);
  const auto same = FindFront(s.folder.path, s.front.key);
  ASSERT_TRUE(same);
  ASSERT_EQ(same->points.size(), 2u);
  EXPECT_EQ(same->points[1].settings, s.front.points[1].settings);
  EXPECT_EQ(same->points[1].psnr_optimum_db, 41.5);
  EXPECT_EQ(same->points[1].ms, 20);
  FrontKey half = s.front.key;
  half.width = 320;
  half.height = 240;
  EXPECT_DOUBLE_EQ(FindFront(s.folder.path, half)->points[1].ms, 5);
  // The nearest size wins.
  StoredFront small = s.front;
  small.key = half;
  small.points = {At(3, 20, 7)};
  WriteFront(s.folder.path, small);
  half.width = 400;
  half.height = 300;
  EXPECT_EQ(FindFront(s.folder.path, half)->points.front().settings.k, 7);
}

TEST(Front, OfAnotherDeviceBackendProxyOrAChangedProxyIsNone) {
  Stored s;
  WriteFront(s.folder.path, s.front);
  std::string why;
  FrontKey key = s.front.key;
  key.device = "another";
  EXPECT_FALSE(FindFront(s.folder.path, key, &why));
  EXPECT_THAT(why, testing::HasSubstr("another device"));
  key = s.front.key;
  key.backend = "gl";
  EXPECT_FALSE(FindFront(s.folder.path, key, &why));
  key = s.front.key;
  Mesh changed = test::PlaneAndBox();
  changed.vertices[0].x() += 1;
  WriteMesh(ProxyPath(s.folder.path, "mesh"), changed);
  EXPECT_FALSE(FindFront(s.folder.path, key, &why));
  EXPECT_THAT(why, testing::HasSubstr("proxy has changed"));
}

TEST(Front, OfAnotherKindSaysWhichWay) {
  Stored s;
  const fs::path file = WriteFront(s.folder.path, s.front);
  const std::string text = ReadText(file);
  const auto said_with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    const std::size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    std::ofstream(file) << changed.replace(at, from.size(), to);
    try {
      ReadFront(file);
      return std::string("nothing");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
  };
  EXPECT_THAT(said_with("\"version\": 1", "\"version\": 2"), testing::HasSubstr("newer version"));
  EXPECT_THAT(said_with("\"lumigraph-front\"", "\"something\""), testing::HasSubstr("not a front"));
  EXPECT_THAT(said_with("\"k\"", "\"glow\""), testing::HasSubstr("glow"));
  EXPECT_THAT(said_with("\"settings\": {", "\"settings\": \"all\", \"more\": {"), testing::HasSubstr("not a front"));
}

TEST(Front, ThatIsCorruptIsNamedAndPassedOver) {
  Stored s;
  const fs::path file = WriteFront(s.folder.path, s.front);
  const std::string text = ReadText(file);
  for (const std::string& bad : {std::string("{"), std::string("[]"), text.substr(0, text.size() / 2),
                                 std::string("{\"format\": \"lumigraph-front\", \"version\": 99}")}) {
    std::ofstream(file) << bad;
    EXPECT_THROW(ReadFront(file), InputError) << bad;
    std::string why;
    EXPECT_FALSE(FindFront(s.folder.path, s.front.key, &why));
    EXPECT_THAT(why, testing::HasSubstr(file.filename().string()));
  }
}

TEST(Front, LeavesAloneWhatASceneOrAUserDecides) {
  RadianceSettings base, point;
  base.visibility = false;
  base.gamma = 3;
  base.time = true;
  base.time_s = 2;
  point.k = 7;
  point.grid_columns = point.grid_rows = 9;
  const RadianceSettings s = WithTradedSettings(base, point);
  EXPECT_EQ(s.k, 7);
  EXPECT_EQ(s.grid_columns, 9);
  EXPECT_FALSE(s.visibility);
  EXPECT_EQ(s.gamma, 3);
  EXPECT_EQ(s.time_s, 2);
}

TEST(FrameError, IsSummedOverChannelsAndSeesLessThanACodeValue) {
  ImageF a(8, 8, 4, 0.5F), b = a;
  EXPECT_EQ(ErrorBetween(a, b).psnr_db, 99);
  for (float& v : b.data) v += 0.1F / 255;
  const FrameError e = ErrorBetween(b, a);
  EXPECT_NEAR(e.mse, 3 * 0.01, 1e-4);  // float's rounding of 0.5 + 0.1 / 255
  EXPECT_NEAR(e.psnr_db, 10 * std::log10(255 * 255 / 0.01), 0.02);
  EXPECT_THROW(ErrorBetween(a, ImageF(8, 7, 4)), std::invalid_argument);
}

TEST(Sweep, HasNoPointTwiceAndEveryPointIsValidAndNamed) {
  for (const SweepSize size : {SweepSize::kMethods, SweepSize::kQuick, SweepSize::kFull}) {
    RadianceSettings base;
    base.similarity = Similarity::kFull;  // whatever the user's own settings are
    base.correlation = Correlation::kFallingLeaves;
    base.sampling = Sampling::kInterpolated;
    for (const RadianceSettings& b : {RadianceSettings(), base}) {
      std::set<std::string> names, settings;
      for (const SweepPoint& p : SweepTable(b, size)) {
        EXPECT_EQ(Validate(p.settings), "") << p.name;
        EXPECT_TRUE(names.insert(p.name).second) << p.name;
        EXPECT_TRUE(settings.insert(JsonKeys(p.settings).Text()).second) << p.name;
      }
      EXPECT_GE(names.size(), 5u);
    }
  }
}

TEST(Sweep, PerPixelForgetsOnlyTheSamples) {
  RadianceSettings s = WithMethod({}, Method::kInterpolated, 16);
  s.k = 7;
  EXPECT_EQ(MethodOf(PerPixel(s)), Method::kPixel);
  EXPECT_EQ(PerPixel(s).k, 7);
  EXPECT_EQ(MethodOf(PerPixel(WithMethod({}, Method::kOptimumGrid))), Method::kOptimumPixel);
}

// ---- the budget in a viewer, with simulated times

class Simulated {
 public:
  Simulated(std::vector<FrontPoint> front, BudgetController::Options options)
      : front_(front), controller_(front, std::nullopt, options) {}
  // A frame while the camera moves; `load`: how many times slower than the front says.
  void Frame(double load, bool moves = true) {
    const FrontPoint& p = controller_.Next(now_, moves);
    const double ms = p.ms * load;
    controller_.Measured(ms);
    now_ += ms / 1000;
    if (shown_ != p.name) ++changes_;
    shown_ = p.name;
    last_ms_ = ms;
  }
  BudgetController& controller() { return controller_; }
  int changes() const { return changes_; }
  void ForgetChanges() { changes_ = 0; }
  double last_ms() const { return last_ms_; }
  const std::string& shown() const { return shown_; }
  void Wait(double s) { now_ += s; }

 private:
  std::vector<FrontPoint> front_;
  BudgetController controller_;
  double now_ = 100, last_ms_ = 0;
  std::string shown_;
  int changes_ = 0;
};

const std::vector<FrontPoint> kFront = {At(4, 20, 1), At(8, 25, 2), At(14, 30, 3), At(25, 33, 4), At(300, 40, 5)};

TEST(BudgetController, BeginsWithTheBestThatFitsAndStaysWhereTimesAreAsExpected) {
  BudgetController::Options o;
  o.budget_ms = 16;
  Simulated s(kFront, o);
  for (int i = 0; i < 500; ++i) s.Frame(1);
  EXPECT_EQ(s.shown(), "k 3");
  EXPECT_EQ(s.changes(), 1) << "the first frame's";
}

TEST(BudgetController, StepsDownOnABusyMachineAndComesBack) {
  BudgetController::Options o;
  o.budget_ms = 16;
  Simulated s(kFront, o);
  for (int i = 0; i < 20; ++i) s.Frame(1);
  int slow = 0;
  for (int i = 0; i < 60; ++i) {
    s.Frame(3);
    slow += s.last_ms() > o.budget_ms * o.too_slow ? 1 : 0;
  }
  EXPECT_EQ(s.shown(), "k 1");  // 12 ms
  EXPECT_LE(slow, 6);
  for (int i = 0; i < 400; ++i) s.Frame(1);
  EXPECT_EQ(s.shown(), "k 2") << "k 3 at 14 ms leaves no room below 0.8 of 16 ms to climb to";
  o.budget_ms = 20;
  Simulated t(kFront, o);
  for (int i = 0; i < 60; ++i) t.Frame(3);
  for (int i = 0; i < 400; ++i) t.Frame(1);
  EXPECT_EQ(t.shown(), "k 3");
}

TEST(BudgetController, DoesNotFlickerWhereTheLoadWavers) {
  BudgetController::Options o;
  o.budget_ms = 16;
  Simulated s(kFront, o);
  for (int i = 0; i < 50; ++i) s.Frame(1);
  s.ForgetChanges();
  // Every level's time lies at the limit now and then: the load swings between 0.7 and 1.9 every 40 frames.
  for (int i = 0; i < 4000; ++i) s.Frame(1.3 + 0.6 * std::sin(2 * M_PI * i / 40.0));
  EXPECT_LE(s.changes(), 40) << "one in a hundred frames";
}

TEST(BudgetController, TriesAStepThatFailsEverMoreRarely) {
  // The front promises 12 ms for a point that takes 20 here: each attempt is one too many.
  const std::vector<FrontPoint> front = {At(4, 20, 1), At(8, 25, 2), At(12, 30, 3)};
  BudgetController::Options o;
  o.budget_ms = 16;
  BudgetController c(front, std::nullopt, o);
  int changes = 0, before = 0;
  for (int i = 0; i < 3000; ++i) {
    const FrontPoint& p = c.Next(0.01 * i, true);
    c.Measured(p.settings.k == 3 ? 20 : p.ms);
    changes += p.settings.k != before ? 1 : 0;
    before = p.settings.k;
  }
  EXPECT_LE(changes, 30) << "about log2 of the wait, then once in 400 frames; without the wait, 300 times";
}

TEST(BudgetController, RefinesAtRestAndLearnsNothingFromIt) {
  BudgetController::Options o;
  o.budget_ms = 16;
  Simulated s(kFront, o);
  for (int i = 0; i < 20; ++i) s.Frame(1);
  EXPECT_FALSE(s.controller().Refining());
  s.Wait(0.5);
  for (int i = 0; i < 10; ++i) s.Frame(1, false);
  EXPECT_TRUE(s.controller().Refining());
  EXPECT_EQ(s.shown(), "k 5") << "the front's best, 300 ms";
  s.Frame(1, true);
  EXPECT_EQ(s.shown(), "k 3") << "where it was before";
  EXPECT_NEAR(s.controller().load(), 1, 0.01);
}

TEST(BudgetController, GivesTheRefinedPointItWasToldOf) {
  FrontPoint optimum = At(2000, 50, 9);
  BudgetController c(kFront, optimum, {});
  c.Next(0, true);
  EXPECT_EQ(c.Next(10, false).settings.k, 9);
}

TEST(BudgetController, SurvivesNonsenseTimes) {
  BudgetController c(kFront, std::nullopt, {});
  c.Next(0, true);
  for (const double ms : {0.0, -1.0, double(NAN), double(INFINITY)}) c.Measured(ms);
  EXPECT_EQ(c.load(), 1);
  EXPECT_THROW(BudgetController({}, std::nullopt, {}), std::invalid_argument);
  EXPECT_THROW(c.SetBudget(0), std::invalid_argument);
}

// ---- the probe

// Takes the time it is told, and refuses the optimum.
class FakeRenderer : public Renderer {
 public:
  ImageF Render(const RenderRequest& r) override {
    if (r.settings.similarity == Similarity::kFull) throw MachineError("no optimum here");
    if (!r.settings.Sparse()) std::this_thread::sleep_for(std::chrono::milliseconds(60));
    return ImageF(4, 3, 4);
  }
  std::string Device() const override { return "fake"; }
};

TEST(Probe, TakesTheMostAccurateThatFitsAndPassesOverWhatTheBackendCannotDo) {
  FakeRenderer renderer;
  RenderRequest request;
  const BudgetChoice tight = Probe(renderer, request, {}, {}, 20);
  EXPECT_TRUE(tight.fits);
  EXPECT_EQ(MethodOf(tight.settings), Method::kCandidates);
  EXPECT_EQ(tight.settings.grid_columns, 32);
  const BudgetChoice ample = Probe(renderer, request, {}, {}, 500);
  EXPECT_EQ(MethodOf(ample.settings), Method::kPixel);
  const BudgetChoice fixed = Probe(renderer, request, {}, {{"k", "2"}, {"grid", "pixel"}}, 1);
  EXPECT_FALSE(fixed.fits);
  EXPECT_EQ(fixed.settings.k, 2);
  EXPECT_FALSE(fixed.settings.Sparse());
}

TEST(Probe, ServesWhereTheSceneHasNoFrontAndTheFrontWhereItHas) {
  Stored s;
  FakeRenderer renderer;
  s.front.key.device = renderer.Device();
  RenderRequest request;
  request.view.size_px = {640, 480};
  request.settings.visibility = false;
  EXPECT_THAT(ChooseForBudget(s.folder.path, "cpu", "mesh", renderer, request, {}, 20).why,
              testing::HasSubstr("no measured front"));
  WriteFront(s.folder.path, s.front);
  const BudgetChoice choice = ChooseForBudget(s.folder.path, "cpu", "mesh", renderer, request, {}, 10);
  EXPECT_THAT(choice.why, testing::HasSubstr("measured at 640x480"));
  EXPECT_EQ(choice.settings.k, 1);
  EXPECT_FALSE(choice.settings.visibility) << "what the scene decided stays";
  // An option that no point of the front has.
  EXPECT_THAT(ChooseForBudget(s.folder.path, "cpu", "mesh", renderer, request, {{"k", "9"}}, 10).why,
              testing::HasSubstr("no point of the scene's front"));
  EXPECT_THROW(ChooseForBudget(s.folder.path, "cpu", "mesh", renderer, request, {}, 0), UsageError);
}

// ---- the commands

TEST(Tradeoff, WritesItsTablesAndPlotsAndKeepsTheFrontWithTheScene) {
  SceneOnDisk d("whole", 13);
  const MeasureOptions o = d.Options("out");
  const Answer answer = RunTradeoff(o, SilentProgress());
  const Json j = Json::parse(answer.keys.Text());
  for (const char* file : {"tradeoff.csv", "tradeoff.json", "tradeoff.svg", "figure-5-4.svg"})
    EXPECT_GT(fs::file_size(o.output / file), 500u) << file;
  ASSERT_GE(j["points"].size(), 3u);
  ASSERT_FALSE(j["front"].empty());
  ASSERT_EQ(j["recommended"].size(), 5u);
  EXPECT_EQ(j["recommended"][0]["budget_ms"], 8);
  EXPECT_TRUE(j["recommended"][4]["budget_ms"].is_null());
  for (const Json& r : j["recommended"]) {
    RadianceSettings s;
    for (const auto& [name, value] : r["settings"].items())
      EXPECT_TRUE(name == "backend" || SetOption(s, name, value.is_string() ? value.get<std::string>() : value.dump()))
          << name;
    EXPECT_EQ(Validate(s), "");
    EXPECT_TRUE(r["report"]["psnr_db"].is_number());
  }
  for (const Json& p : j["points"]) {
    EXPECT_GT(p["ms"], 0.0);
    EXPECT_TRUE(p["psnr_holdout_db"].is_number());
  }
  EXPECT_GE(j["sparse"].size(), 6u);
  for (const Json& row : j["sparse"]) {
    EXPECT_TRUE(row["speed_up"].is_number() || row["similarity"] == "full") << row["name"];
    EXPECT_LE(row["psnr_pixel_worst_db"], row["psnr_pixel_db"]);
  }
  const auto stored = FindFront(d.Scene(), {"truth", "cpu", j["device"], 64, 48});
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->points.size(), j["front"].size());
  EXPECT_FALSE(answer.text.empty());
}

TEST(Tradeoff, ChoosesOnOneFoldAndReportsOnTheOther) {
  SceneOnDisk d("folds", 13);
  MeasureOptions o = d.Options("out");
  o.views = 9;
  const Json j = Json::parse(RunTradeoff(o, SilentProgress()).keys.Text());
  std::set<std::string> chosen, reported;
  for (const Json& v : j["views"]) chosen.insert(v);
  for (const Json& v : j["report_views"]) reported.insert(v);
  EXPECT_EQ(chosen, (std::set<std::string>{"view102.png", "view106.png", "view110.png"}));
  EXPECT_EQ(reported, (std::set<std::string>{"view100.png", "view104.png", "view108.png", "view112.png"}));
}

TEST(HeldOutViews, OfTheChoosingFoldAreRenderedWithoutTheReportingOne) {
  SceneOnDisk d("strict", 13);
  OpenOptions open;
  const Scene scene = OpenScene(d.Scene(), open, SilentProgress());
  for (const TestView& t : HeldOutViews(scene, 6, Fold::kChoose, 9, 0))
    for (const std::size_t held : {0, 3, 6, 9, 12}) EXPECT_FALSE(t.use[held]);
  for (const TestView& t : HeldOutViews(scene, 6, Fold::kReport, 9, 0)) {
    EXPECT_FALSE(t.use[0]);
    EXPECT_TRUE(t.use[3]) << "what is reported may use what was chosen on";
  }
  // Few are spread over the fold; too large an N is lowered until there is one.
  EXPECT_EQ(HeldOutViews(scene, 2, Fold::kReport, 1, 0).front().name, "view106.png");
  EXPECT_EQ(HeldOutViews(scene, 1000, Fold::kChoose, 1, 0).size(), 1u);
  EXPECT_EQ(HeldOutViews(scene, 6, Fold::kReport, 1, 32).front().photo.width, 32);
}

TEST(Tradeoff, DoesNotWriteIntoAnotherToolsWorkspace) {
  SceneOnDisk d("colmap", 9);
  fs::remove(d.Scene() / "lumigraph.json");
  MeasureOptions o = d.Options("out");
  o.proxies = {"truth"};
  RunTradeoff(o, SilentProgress());
  EXPECT_TRUE(fs::exists(o.output / "tradeoff.json"));
  EXPECT_FALSE(fs::exists(d.Scene() / "fronts"));
  EXPECT_FALSE(fs::exists(d.Scene() / "LOCK"));
}

TEST(Tradeoff, InterruptedLeavesNothing) {
  struct Stop : ProgressSink {
    int reports = 0;
    void Report(const std::string& task, long, long, double, double) override {
      if (task == "measuring settings" && ++reports == 3) throw Interrupted();
    }
    void Finish(const std::string&, long, double) override {}
    void Message(const std::string&) override {}
  } stop;
  SceneOnDisk d("stopped", 9);
  MeasureOptions o = d.Options("out");
  o.width_px = 640;
  o.repeats = 60;  // slow enough that progress is reported more than at the ends
  EXPECT_THROW(RunTradeoff(o, stop), Interrupted);
  EXPECT_FALSE(fs::exists(o.output));
  EXPECT_FALSE(fs::exists(d.Scene() / "fronts"));
}

TEST(Tradeoff, RefusesBadOptionsInOneLine) {
  SceneOnDisk d("bad", 5);
  const auto refused = [&](auto&& change) {
    MeasureOptions o = d.Options("out");
    change(o);
    try {
      RunTradeoff(o, SilentProgress());
      return std::string("nothing");
    } catch (const UsageError& e) {
      return std::string(e.what());
    }
  };
  EXPECT_EQ(refused([](MeasureOptions& o) { o.holdout = 1; }), "--holdout takes 2 or more");
  EXPECT_EQ(refused([](MeasureOptions& o) { o.repeats = 0; }), "--repeats takes 1 to 1000");
  EXPECT_EQ(refused([](MeasureOptions& o) { o.views = 0; }), "--views takes 1 or more");
  EXPECT_EQ(refused([](MeasureOptions& o) { o.width_px = -1; }), "--width and --reference-width take 1 to 32768");
  EXPECT_EQ(refused([](MeasureOptions& o) { o.proxies = {"truth", "truth"}; }), "--proxy truth is given twice");
  EXPECT_THAT(refused([](MeasureOptions& o) { o.proxies = {"nope"}; }), testing::HasSubstr("nope"));
  EXPECT_THAT(refused([](MeasureOptions& o) { o.settings.grid_columns = o.settings.grid_rows = 1; }),
              testing::HasSubstr("--grid"));
  EXPECT_THAT(refused([](MeasureOptions& o) { o.effects = "fov,glow"; }), testing::HasSubstr("glow"));
}

TEST(Ablation, ShowsARowForEachOptimisation) {
  SceneOnDisk d("ablation", 13);
  MeasureOptions o = d.Options("out");
  const Json j = Json::parse(RunAblation(o, SilentProgress()).keys.Text());
  ASSERT_EQ(j["rows"].size(), 6u);
  int pictures = 0;
  for (const Json& r : j["rows"]) {
    if (r.contains("refused")) continue;
    ++pictures;
    for (const char* key : {"image", "false_color", "difference"})
      EXPECT_TRUE(fs::exists(o.output / r[key].get<std::string>()));
    if (r["name"] == j["compared_with"]) {
      EXPECT_EQ(r["psnr_db"], 99.0);
      EXPECT_EQ(r["mse"], 0.0);
    }
  }
  EXPECT_GE(pictures, 3) << "at every pixel, without the optimum, at least";
  EXPECT_TRUE(fs::exists(o.output / "index.html"));
  EXPECT_TRUE(fs::exists(o.output / "ablation.csv"));
  o.view = "no such photo";
  EXPECT_THROW(RunAblation(o, SilentProgress()), UsageError);
}

TEST(Properties, EachHasItsFigure) {
  SceneOnDisk d("properties", 13);
  MeasureOptions o = d.Options("out");
  const Json j = Json::parse(RunProperties(o, SilentProgress()).keys.Text());
  ASSERT_EQ(j["properties"].size(), 9u);
  const auto figure = [&](const char* property, const char* key) {
    for (const Json& row : j["properties"])
      if (row["property"] == property) return row[key].get<double>();
    ADD_FAILURE() << property;
    return 0.0;
  };
  EXPECT_EQ(figure("unstructured input", "used"), 13);
  EXPECT_LT(figure("natural navigation", "weight_change_max"), 1e-5);
  EXPECT_LT(figure("natural navigation", "turned_difference_max"), 0.05);
  EXPECT_GT(figure("use of correspondence", "proxy_psnr_db"), figure("use of correspondence", "infinity_psnr_db") + 3);
  const double direction = figure("angle-based view dependence", "direction_error");
  EXPECT_LT(direction, figure("angle-based view dependence", "nearest_photo_direction_error"));
  EXPECT_LT(direction, 0.5 * figure("angle-based view dependence", "all_photos_direction_error"));
  for (const char* key :
       {"pixel_weight_min", "interpolated_25_weight_min", "candidates_25_weight_min", "optimum_25_weight_min",
        "optimum_pixel_weight_min", "optimum_25_visibility_weight_min", "optimum_pixel_visibility_weight_min"})
    EXPECT_GE(figure("epipole consistency", key), 0.99) << key;
  EXPECT_LE(figure("radiance consistency", "weight_difference_max"), 1e-6);
  EXPECT_NEAR(figure("continuity", "ratio_1e-3_1e-4"), 10, 2);
  EXPECT_TRUE(fs::exists(o.output / "properties.json"));
}

TEST(Plot, EscapesWhatItIsGivenAndSaysWhereNothingWasMeasured) {
  Plot plot;
  plot.title = "a < b & \"c\"";
  plot.x = {"x", true, false};
  plot.series.push_back({"none", "#000000", Marker::kCircle, true, true, false, {{-1, 2, "", ""}, {NAN, 1, "", ""}}});
  const std::string svg = SvgOf({plot});
  EXPECT_THAT(svg, testing::HasSubstr("a &lt; b &amp; &quot;c&quot;"));
  EXPECT_THAT(svg, testing::HasSubstr("no measurement"));
  EXPECT_THAT(svg, testing::Not(testing::HasSubstr("nan")));
}

}  // namespace
}  // namespace lumi
