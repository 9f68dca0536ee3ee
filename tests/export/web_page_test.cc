// The page that lumi-export writes, in a real browser.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <fstream>
#include <set>

#include "scene/files/scene_folder.h"
#include "tests/support/chromium.h"
#include "tests/support/simulated_capture.h"
#include "tests/support/static_server.h"
#include "tests/support/web_page.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::IsEmpty;

constexpr int kPhotos = 6;

// A desk of six photos, its page, and the page's data as a scene.
class DeskPage {
 public:
  DeskPage() : capture_("desk", kPhotos, 320) {
    const ProgramResult made = RunProgram({"lumi-export", "web", capture_.path().string(), "-o", page().string(),
                                           "--as-scene", scene().string(), "--quiet"});
    if (made.exit_code != 0) throw std::runtime_error("lumi-export failed: " + made.err);
  }
  const SimulatedCapture& capture() const { return capture_; }
  fs::path page() const { return capture_ / "desk.html"; }
  fs::path scene() const { return capture_ / "as-scene"; }

 private:
  SimulatedCapture capture_;
};
DeskPage& Desk() {
  static DeskPage desk;
  return desk;
}

Chromium& Browser() {
  static Chromium browser(800, 600);
  return browser;
}

// The browser at a page, all photos loaded.
Chromium& At(const std::string& url) {
  Chromium& browser = Browser();
  browser.Open(url);
  EXPECT_TRUE(browser.WaitFor("window.lumigraph && lumigraph.photos.finished"))
      << browser.Evaluate("document.getElementById('message').textContent") << testing::PrintToString(browser.errors());
  return browser;
}
Chromium& AtDesk() { return At("file://" + Desk().page().string()); }

TEST(WebPage, ShowsWhatTheRendererShows) {
  SKIP_WITHOUT_BROWSER();
  Chromium& browser = AtDesk();
  SceneBeside beside(Desk().scene(), PageSettings(browser));
  std::vector<RenderView> views = PhotosViews(beside.scene(), kPhotos);
  for (RenderView& view : ViewsBetween(beside.scene(), 5, {320, 240})) views.push_back(view);
  constexpr double kEdge = 0.005;  // of the pixels: at silhouettes a rasteriser and a tracer may disagree
  for (std::size_t i = 0; i < views.size(); ++i) {
    const json wanted = ViewForPage(views[i], beside.scene().normalized_from_world);
    const Agreement agreement = Compare(beside.Render(views[i]), PagePicture(browser, wanted));
    EXPECT_GE(agreement.psnr_db, kSamePictureDb) << i;
    EXPECT_LE(agreement.differ, kEdge) << i;
  }
  EXPECT_THAT(browser.errors(), IsEmpty());
}

TEST(WebPage, AsksForNothingBesideItself) {
  SKIP_WITHOUT_BROWSER();
  const Chromium& browser = AtDesk();
  EXPECT_FALSE(browser.requests().empty());
  for (const std::string& url : browser.requests())
    EXPECT_TRUE(url == "file://" + Desk().page().string() || url.starts_with("data:") || url.starts_with("blob:"))
        << url;
}

TEST(WebPage, FollowsMouseWheelAndKeys) {
  SKIP_WITHOUT_BROWSER();
  Chromium& browser = AtDesk();
  const auto pose = [&] {
    return browser.Evaluate("[...lumigraph.camera.centre, ...lumigraph.camera.forward, lumigraph.camera.pivotDistance]")
        .get<std::vector<double>>();
  };
  const auto mouse = [&](const char* type, double x, double y, const char* button = "left") {
    browser.Command("Input.dispatchMouseEvent",
                    {{"type", type}, {"x", x}, {"y", y}, {"button", button}, {"clickCount", 1}});
  };
  const auto angle = [](const std::vector<double>& a, const std::vector<double>& b) {
    return std::acos(std::clamp(a[3] * b[3] + a[4] * b[4] + a[5] * b[5], -1.0, 1.0));
  };
  // A tenth of the height, upwards: a tenth of half a turn, about the pivot.
  const auto before = pose();
  mouse("mousePressed", 400, 300);
  mouse("mouseMoved", 400, 270);
  mouse("mouseMoved", 400, 240);
  mouse("mouseReleased", 400, 240);
  const auto turned = pose();
  EXPECT_NEAR(angle(before, turned), 0.1 * M_PI, 1e-3);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(before[i] + before[6] * before[3 + i], turned[i] + turned[6] * turned[3 + i], 1e-6)
        << "the pivot stays";
  // A step of the wheel towards the person: nearer by a factor.
  browser.Command("Input.dispatchMouseEvent",
                  {{"type", "mouseWheel"}, {"x", 400}, {"y", 300}, {"deltaX", 0}, {"deltaY", -80}});
  ASSERT_TRUE(browser.WaitFor("lumigraph.camera.pivotDistance < " + std::to_string(0.95 * turned[6]), 10));
  EXPECT_NEAR(pose()[6] / turned[6], std::exp(-0.1), 1e-6);
  // Next photo, by its key: the camera flies there.
  browser.Command("Input.dispatchKeyEvent", {{"type", "keyDown"}, {"code", "Period"}, {"key", "."}});
  browser.Command("Input.dispatchKeyEvent", {{"type", "keyUp"}, {"code", "Period"}, {"key", "."}});
  ASSERT_TRUE(browser.WaitFor("lumigraph.state.photo >= 0 && lumigraph.camera.flight === null", 20));
  EXPECT_TRUE(browser
                  .Evaluate("(() => { const p = lumigraph.manifest.photos[lumigraph.state.photo].centre, c = "
                            "lumigraph.camera.centre; return Math.hypot(p[0]-c[0], p[1]-c[1], p[2]-c[2]) < 1e-9; })()")
                  .get<bool>());
  EXPECT_THAT(browser.errors(), IsEmpty());
}

TEST(WebPage, FollowsKeys) {
  SKIP_WITHOUT_BROWSER();
  Chromium& browser = AtDesk();
  const auto tap = [&](const std::string& code) {
    for (const char* type : {"keyDown", "keyUp"})
      browser.Command("Input.dispatchKeyEvent", {{"type", type}, {"code", code}, {"key", code}});
  };
  const auto centre = [&] {
    const auto c = browser.Evaluate("[...lumigraph.camera.centre]").get<std::vector<double>>();
    return Eigen::Vector3d(c[0], c[1], c[2]);
  };
  const auto axis = [&](int row) {
    const auto r = browser.Evaluate("[...lumigraph.camera.rotation]").get<std::vector<double>>();
    const auto at = static_cast<std::size_t>(3 * row);
    return Eigen::Vector3d(r[at], r[at + 1], r[at + 2]);
  };
  // Also where a button took the focus.
  browser.Evaluate("document.getElementById('more').focus()");
  // A step along each axis, and back by the opposite key. Image axes: x right, y down, z forward.
  struct Step {
    const char *there, *back;
    int row;
    double sign;
  };
  for (const Step& step : {Step{"KeyW", "KeyS", 2, 1}, Step{"ArrowUp", "ArrowDown", 2, 1}, Step{"KeyD", "KeyA", 0, 1},
                           Step{"ArrowRight", "ArrowLeft", 0, 1}, Step{"KeyE", "KeyQ", 1, -1}}) {
    const Eigen::Vector3d before = centre();
    tap(step.there);
    const Eigen::Vector3d moved = centre() - before;
    EXPECT_GT(moved.norm(), 0) << step.there;
    EXPECT_NEAR(moved.normalized().dot(step.sign * axis(step.row)), 1, 1e-6) << step.there;
    tap(step.back);
    EXPECT_LT((centre() - before).norm(), 1e-9) << step.back;
  }
  // What is shown, and the panel.
  tap("KeyC");
  EXPECT_EQ(browser.Evaluate("lumigraph.state.show").get<std::string>(), "false-color");
  tap("KeyC");
  EXPECT_EQ(browser.Evaluate("lumigraph.state.show").get<std::string>(), "color");
  tap("KeyV");
  EXPECT_TRUE(browser.Evaluate("lumigraph.state.overlay").get<bool>());
  tap("KeyV");
  const bool panel = browser.Evaluate("document.getElementById('panel').hidden");
  tap("KeyM");
  EXPECT_NE(browser.Evaluate("document.getElementById('panel').hidden").get<bool>(), panel);
  tap("KeyM");
  // The fly-through, until a key ends it; and home.
  const Eigen::Vector3d begun = centre();
  tap("Space");  // the button's own
  EXPECT_TRUE(browser.Evaluate("lumigraph.state.playing === null").get<bool>());
  browser.Evaluate("document.activeElement.blur()");
  tap("Space");
  ASSERT_TRUE(
      browser.WaitFor("lumigraph.state.playing !== null && Math.hypot(...lumigraph.camera.centre.map((c, i) => c - " +
                          std::string("[") + std::to_string(begun.x()) + "," + std::to_string(begun.y()) + "," +
                          std::to_string(begun.z()) + "][i])) > 1e-3",
                      20));
  tap("KeyW");
  EXPECT_TRUE(browser.Evaluate("lumigraph.state.playing === null").get<bool>());
  const auto from_home = [&] {
    return browser.Evaluate("Math.hypot(...lumigraph.camera.centre.map((c, i) => c - lumigraph.home.centre[i]))")
        .get<double>();
  };
  ASSERT_GT(from_home(), 1e-3);
  tap("Home");
  ASSERT_TRUE(browser.WaitFor("lumigraph.camera.flight === null", 20));
  EXPECT_LT(from_home(), 1e-9);
  EXPECT_THAT(browser.errors(), IsEmpty());
}

TEST(WebPage, FollowsFingers) {
  SKIP_WITHOUT_BROWSER();
  Chromium& browser = AtDesk();
  const auto touch = [&](const char* type, const std::vector<std::pair<double, double>>& fingers) {
    json points = json::array();
    for (std::size_t i = 0; i < fingers.size(); ++i)
      points.push_back({{"x", fingers[i].first}, {"y", fingers[i].second}, {"id", i}});
    browser.Command("Input.dispatchTouchEvent", {{"type", type}, {"touchPoints", points}});
  };
  const double before = browser.Evaluate("lumigraph.camera.pivotDistance");
  touch("touchStart", {{300, 300}, {500, 300}});
  touch("touchMove", {{250, 300}, {550, 300}});
  touch("touchMove", {{200, 300}, {600, 300}});
  touch("touchEnd", {});
  // Twice as far apart: half the distance.
  EXPECT_NEAR(browser.Evaluate("lumigraph.camera.pivotDistance").get<double>() / before, 0.5, 0.02);
  const std::string pose = browser.Evaluate("lumigraph.poseText()");
  touch("touchStart", {{400, 300}});
  touch("touchMove", {{400, 330}});
  touch("touchEnd", {});
  EXPECT_NE(browser.Evaluate("lumigraph.poseText()").get<std::string>(), pose);
}

TEST(WebPage, ALinkToAViewOpensThere) {
  SKIP_WITHOUT_BROWSER();
  AtDesk();
  Chromium& browser = Browser();
  const std::string pose = browser.Evaluate(
      "(lumigraph.camera.walk(0.3, 0.2, 0.1), lumigraph.camera.turn(0.2, 0.1), "
      "lumigraph.poseText())");
  browser.Open("about:blank");
  At("file://" + Desk().page().string() + "#pose=" + pose);
  // Seven digits.
  const json there = json::parse("[" + browser.Evaluate("lumigraph.poseText()").get<std::string>() + "]"),
             wanted = json::parse("[" + pose + "]");
  for (std::size_t i = 0; i < wanted.size(); ++i)
    EXPECT_NEAR(there[i].get<double>(), wanted[i].get<double>(), 1e-6) << i;
  const std::string name = browser.Evaluate("lumigraph.manifest.photos[2].name");
  browser.Open("about:blank");
  At("file://" + Desk().page().string() + "#view=" + name);
  EXPECT_EQ(browser.Evaluate("lumigraph.state.photo").get<int>(), 2);
  // What is no pose changes nothing, and breaks nothing.
  browser.Open("about:blank");
  At("file://" + Desk().page().string() + "#pose=1,2,nonsense");
  EXPECT_THAT(browser.errors(), IsEmpty());
}

// Their pixels lie on their side, and EXIF says so: who looks through such a camera sees the picture as a person does.
TEST(WebPage, PhotosThatWereTakenUprightAreSeenUpright) {
  SKIP_WITHOUT_BROWSER();
  const SimulatedCapture portrait("desk", 4, 160, {"--portrait-every", "1"});
  const fs::path page = portrait / "page.html";
  const ProgramResult made =
      RunProgram({"lumi-export", "web", portrait.path().string(), "-o", page.string(), "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  At("file://" + page.string());
  Chromium& browser = Browser();
  for (int i = 0; i < 4; ++i) {
    const std::string photo = "lumigraph.manifest.photos[" + std::to_string(i) + "]";
    EXPECT_EQ(browser.Evaluate(photo + ".turns").get<int>(), 1);
    EXPECT_EQ(browser.Evaluate(photo + ".size[0] > " + photo + ".size[1]"), true) << "as it is stored";
    const std::string name = browser.Evaluate(photo + ".name");
    browser.Open("about:blank");
    At("file://" + page.string() + "#view=" + name);
    EXPECT_EQ(browser.Evaluate("lumigraph.state.photo").get<int>(), i);
    EXPECT_NEAR(browser.Evaluate("lumigraph.camera.aspect").get<double>(), 3.0 / 4, 1e-6);
    const json down = browser.Evaluate("lumigraph.camera.rotation.slice(3, 6)"),
               up = browser.Evaluate("lumigraph.camera.up");
    double against_up = 0, across_up = 0;
    const json right = browser.Evaluate("lumigraph.camera.rotation.slice(0, 3)");
    for (std::size_t k = 0; k < 3; ++k) {
      against_up -= down[k].get<double>() * up[k].get<double>();
      across_up += right[k].get<double>() * up[k].get<double>();
    }
    EXPECT_GT(against_up, 0.5) << name;
    EXPECT_NEAR(across_up, 0, 0.05) << name;  // the photographer holds the horizon level
  }
  EXPECT_THAT(browser.errors(), IsEmpty());
}

TEST(WebPage, StreamsFromAFolder) {
  SKIP_WITHOUT_BROWSER();
  const fs::path folder = Desk().capture() / "web-folder";
  const ProgramResult made =
      RunProgram({"lumi-export", "web", Desk().capture().path().string(), "-o", folder.string(), "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const StaticServer server(folder);
  Chromium& browser = At(server.Url("index.html"));
  EXPECT_GT(browser.requests().size(), static_cast<std::size_t>(kPhotos));
  for (const std::string& url : browser.requests()) EXPECT_TRUE(url.starts_with(server.Url(""))) << url;
  EXPECT_EQ(browser.Evaluate("lumigraph.photos.loadedCount").get<int>(), kPhotos);
  EXPECT_THAT(browser.errors(), IsEmpty());
  // A second export into it replaces it; a folder of somebody else's is left alone.
  EXPECT_EQ(
      RunProgram({"lumi-export", "web", Desk().capture().path().string(), "-o", folder.string(), "--quiet"}).exit_code,
      0);
  const fs::path other = Desk().capture() / "somebodys";
  fs::create_directories(other);
  std::ofstream(other / "letter.txt") << "dear";
  EXPECT_EQ(
      RunProgram({"lumi-export", "web", Desk().capture().path().string(), "-o", other.string(), "--quiet"}).exit_code,
      2);
  EXPECT_EQ(std::distance(fs::directory_iterator(other), fs::directory_iterator()), 1);
}

TEST(WebPage, PlaysWhatRepeatsAndStreamsThePhotosOfThePhase) {
  SKIP_WITHOUT_BROWSER();
  // A rotor filmed for several turns.
  const SimulatedCapture rotor("helicopter", 24, 96, {"--video", "--fixed-frames", "2"});
  const fs::path folder = rotor / "web", data = rotor / "web-data";
  const ProgramResult made = RunProgram({"lumi-export", "web", rotor.path().string(), "-o", folder.string(),
                                         "--as-scene", data.string(), "--effects", "fov,visibility,time", "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const StaticServer server(folder);
  Chromium& browser = At(server.Url("index.html"));
  const json times = browser.Evaluate("lumigraph.manifest.time");
  const double begin_s = times["begin_s"], period_s = times["end_s"].get<double>() - begin_s;
  ASSERT_GT(period_s, 0.1);
  // One camera at several phases: as the renderer draws them, and not all the same.
  browser.Evaluate("lumigraph.actions.timeRuns(false)");
  SceneBeside beside(data, PageSettings(browser));
  RenderView view = MakeRenderView(beside.scene(), beside.scene().views[12]);
  std::set<std::string> pictures;
  for (const double phase : {0.0, 0.3, 0.65}) {
    view.time_s = begin_s + phase * period_s;
    const std::string picture = PagePicture(browser, ViewForPage(view, beside.scene().normalized_from_world));
    EXPECT_GE(Compare(beside.Render(view), picture).psnr_db, kSamePictureDb) << phase;
    pictures.insert(picture);
  }
  EXPECT_EQ(pictures.size(), 3U);
  // The photo of the moment comes before the others of its place.
  const json order = browser.Evaluate("(lumigraph.photos.setOrder(lumigraph.orderFor(" +
                                      ViewForPage(view, beside.scene().normalized_from_world).dump() +
                                      ")), lumigraph.photos.order.slice(0, 4))");
  for (const json& photo : order) {
    double off = std::abs(browser.Evaluate("lumigraph.manifest.photos[" + photo.dump() + "].time_s").get<double>() -
                          *view.time_s);
    off = std::abs(off - period_s * std::round(off / period_s));
    EXPECT_LT(off, 0.2 * period_s) << photo;
  }
  // It goes on, from the end to the beginning; and stops.
  browser.Evaluate("(lumigraph.state.time_s = lumigraph.manifest.time.end_s - 0.05, lumigraph.actions.timeRuns(true))");
  ASSERT_TRUE(browser.WaitFor("lumigraph.state.time_s < lumigraph.manifest.time.end_s - 0.06", 20));
  browser.Evaluate("document.getElementById('time-runs').click()");
  const double stopped = browser.Evaluate("lumigraph.state.time_s");
  browser.Evaluate("new Promise((resolve) => setTimeout(resolve, 300))");
  EXPECT_EQ(browser.Evaluate("lumigraph.state.time_s").get<double>(), stopped);
  EXPECT_THAT(browser.errors(), IsEmpty());
}

TEST(WebPage, ComesToRestWhereItsMemoryHoldsFewerPhotosThanItHas) {
  SKIP_WITHOUT_BROWSER();
  constexpr int kMany = 30;  // of one size, of which 16 stay in any case
  const SimulatedCapture desk("desk", kMany, 64);
  const fs::path page = desk / "desk.html";
  const ProgramResult made = RunProgram({"lumi-export", "web", desk.path().string(), "-o", page.string(), "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  Chromium& browser = At("file://" + page.string() + "?memory-mb=1");
  EXPECT_EQ(browser.Evaluate("lumigraph.photos.loadedCount").get<int>(), 16);
  // The nearest are those that are there, after a jump too.
  browser.Evaluate("lumigraph.actions.jump(29, 0)");
  ASSERT_TRUE(
      browser.WaitFor("!lumigraph.state.dirty && lumigraph.photos.finished && lumigraph.photos.levelOf(29) >= 0"));
  EXPECT_EQ(
      browser.Evaluate("lumigraph.photos.order.slice(0, 16).filter((j) => lumigraph.photos.levelOf(j) < 0).length")
          .get<int>(),
      0);
  EXPECT_THAT(browser.errors(), IsEmpty());
}

TEST(WebPage, ADeviceWithSmallTexturesShowsSmallerPhotosOfTheSameView) {
  SKIP_WITHOUT_BROWSER();
  const std::string page = "file://" + Desk().page().string();
  Chromium& whole = At(page);
  SceneBeside beside(Desk().scene(), PageSettings(whole));
  const RenderView view = ViewsBetween(beside.scene(), 5, {320, 240})[2];
  const json wanted = ViewForPage(view, beside.scene().normalized_from_world);
  EXPECT_EQ(whole.Evaluate("lumigraph.manifest.visibility.size"), json({128, 96}));
  EXPECT_EQ(whole.Evaluate("lumigraph.renderer.columns").get<int>(), 3) << "six maps, about square";

  // Photos of 320 x 240 are halved; the maps go into two columns of three.
  Chromium& small = At(page + "?texture-px=288");
  EXPECT_EQ(small.Evaluate("lumigraph.renderer.columns").get<int>(), 2);
  EXPECT_EQ(small.Evaluate("lumigraph.manifest.photos[0].levels[0].size"), json({160, 120}));
  EXPECT_EQ(small.Evaluate("lumigraph.manifest.photos[0].levels[0].shift").get<int>(), 1);
  constexpr double kHalvedDb = 24;  // of a picture as large as the whole photos
  EXPECT_GE(Compare(beside.Render(view), PagePicture(small, wanted)).psnr_db, kHalvedDb);
  EXPECT_THAT(small.errors(), IsEmpty());

  // One column of maps would be too high.
  Chromium& tiny = At(page + "?texture-px=128");
  EXPECT_EQ(tiny.Evaluate("document.getElementById('status').textContent").get<std::string>(),
            "this device cannot hold what each photo sees: hidden things may shine through");
  PagePicture(tiny, wanted);
  EXPECT_THAT(tiny.errors(), IsEmpty());
}

TEST(WebPage, NamesAreTextWhateverTheySay) {
  SKIP_WITHOUT_BROWSER();
  const fs::path scene = Desk().capture() / "<img src=x onerror='window.taken=1'>";
  fs::copy(Desk().capture().path(), scene, fs::copy_options::recursive);
  ProgressSink& sink = SilentProgress();
  Scene hostile = OpenScene(scene, {}, sink);
  const std::vector<std::string> names = {"a<script>window.taken=1<\u002fscript>.png", "\"><b>.png",
                                          "';window.taken=1;'.png"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::string name = names[i];
    std::replace(name.begin(), name.end(), '/', '_');
    fs::rename(hostile.ImagePath(hostile.views[i]), hostile.image_folder / name);
    hostile.views[i].name = name;
  }
  std::ranges::sort(hostile.views, {}, &View::name);
  for (Point& point : hostile.points) point.track.clear();
  hostile.points.clear();
  WriteScene(hostile, scene);
  const fs::path page = Desk().capture() / "hostile.html";
  const ProgramResult made = RunProgram({"lumi-export", "web", scene.string(), "-o", page.string(), "--quiet"});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  Chromium& browser = At("file://" + page.string());
  EXPECT_TRUE(browser.Evaluate("window.taken === undefined").get<bool>());
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#photos li').length").get<int>(), kPhotos);
  EXPECT_EQ(browser.Evaluate("document.querySelectorAll('#photos b, #photos img, h1 img').length").get<int>(), 0);
  EXPECT_EQ(browser.Evaluate("document.title").get<std::string>(), scene.filename().string());
}

TEST(WebPage, RefusalsSayWhatToDo) {
  const std::string scene = Desk().capture().path().string();
  const auto refused = [](const std::vector<std::string>& more, int code, const std::string& words) {
    std::vector<std::string> argv{"lumi-export", "web"};
    argv.insert(argv.end(), more.begin(), more.end());
    const ProgramResult run = RunProgram(argv);
    EXPECT_EQ(run.exit_code, code) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr(words));
  };
  refused({scene}, 2, "-o FILE.html");
  const fs::path letter = Desk().capture() / "letter.html";
  std::ofstream(letter) << "<p>dear";
  refused({scene, "-o", letter.string()}, 2, "no page of ours");
  refused({scene, "-o", (Desk().capture() / "x.html").string(), "--max-mb", "0.3"}, 1, "--max-mb");
  refused({scene, "-o", (Desk().capture() / "x.html").string(), "--proxy", "per-view"}, 2, "lumi-proxy auto");
  refused({(Desk().capture() / "nothing").string(), "-o", (Desk().capture() / "x.html").string()}, 2, "nothing");
  EXPECT_FALSE(fs::exists(Desk().capture() / "x.html"));
}

}  // namespace
}  // namespace lumi
