// The viewer without a window: navigation, script, background loading.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <thread>

#include "render/radiance/setting_options.h"
#include "render/viewer/motion_budget.h"
#include "render/viewer/navigation.h"
#include "render/viewer/photo_loader.h"
#include "render/viewer/recorder.h"
#include "render/viewer/refiner.h"
#include "render/viewer/script.h"
#include "render/viewer/setting_rules.h"
#include "render/world/visibility_maps.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

using testing::HasSubstr;

constexpr double kTolerance = 1e-9;  // chains of a few rotations in double

ViewState StateAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  ViewState s;
  s.cam_from_world = LookAt(eye, target, Eigen::Vector3d::UnitZ());
  return s;
}

TEST(Navigation, AWindowOfThePhotosSizeHasThePhotosCamera) {
  const test::World w = test::MakeWorld(6, 120);
  for (int j = 0; j < 6; ++j) {
    const View& view = w.scene.views[static_cast<std::size_t>(j)];
    const Camera& c = w.scene.CameraOf(view);
    const RenderView window = MakeWindowView(StateOfView(w.scene, {j}), c.width_px, c.height_px);
    const RenderView photo = MakeRenderView(w.scene, view);
    EXPECT_LT((window.P - photo.P).norm(), kTolerance * photo.P.norm());
    EXPECT_LT((window.centre - photo.centre).norm(), kTolerance);
  }
}

TEST(Navigation, EveryWindowShowsTheWholePhoto) {
  const test::World w = test::MakeWorld(3, 120);
  const View& view = w.scene.views[1];
  const Camera& camera = w.scene.CameraOf(view);
  for (const auto& [width, height] : {std::pair{300, 100}, {100, 300}, {640, 480}}) {
    const RenderView window = MakeWindowView(StateOfView(w.scene, {1}), width, height);
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), Eigen::Vector2d(camera.width_px, camera.height_px)}) {
      const auto ray = camera.Normalized(corner);
      const auto x =
          Project(window.P, Eigen::Vector3d(view.cam_from_world.Inverse() * Eigen::Vector3d(ray->x(), ray->y(), 1.0)));
      ASSERT_TRUE(x);
      EXPECT_GE(x->minCoeff(), -1e-6);
      EXPECT_LE(x->x(), width + 1e-6);
      EXPECT_LE(x->y(), height + 1e-6);
    }
  }
}

TEST(Navigation, AnOrbitKeepsItsPointInPlaceAndUpUp) {
  const Eigen::Vector3d pivot(0.2, -0.1, 0.4);
  Navigator n(StateAt({3, 1, 1.5}, pivot), Eigen::Vector3d::UnitZ(), 1.0);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> angle(-0.7, 0.7);
  const double distance = (n.state().cam_from_world.OriginInSource() - pivot).norm();
  for (int i = 0; i < 500; ++i) {
    n.Orbit(pivot, angle(random), angle(random));
    const Eigen::Vector3d in_cam = n.state().cam_from_world * pivot;
    ASSERT_NEAR(in_cam.x(), 0, 1e-8);
    ASSERT_NEAR(in_cam.y(), 0, 1e-8);
    ASSERT_NEAR(in_cam.z(), distance, 1e-8);
    ASSERT_NEAR(n.Roll(), 0, 1e-8);
    ASSERT_LE(std::abs(n.Elevation()), Navigator::kMaxElevation + 1e-9);
  }
}

TEST(Navigation, AnOrbitGoesWhereItSays) {
  const Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  Navigator n(StateAt({0, -4, 0}, pivot), Eigen::Vector3d::UnitZ(), 1.0);
  n.Orbit(pivot, 0.5, 0);  // to the right: the camera looks along +y, its right is +x
  EXPECT_GT(n.state().cam_from_world.OriginInSource().x(), 1.0);
  EXPECT_NEAR(n.state().cam_from_world.OriginInSource().z(), 0, kTolerance);
  n.Orbit(pivot, 0, 0.3);
  EXPECT_GT(n.state().cam_from_world.OriginInSource().z(), 1.0);
  EXPECT_NEAR(n.Elevation(), -0.3, kTolerance);
}

TEST(Navigation, LookingTurnsOnTheSpot) {
  const Eigen::Vector3d eye(1, 2, 3);
  Navigator n(StateAt(eye, {1, 5, 3}), Eigen::Vector3d::UnitZ(), 1.0);
  n.Look(0.4, 0.2);
  EXPECT_LT((n.state().cam_from_world.OriginInSource() - eye).norm(), kTolerance);
  const Eigen::Vector3d forward = n.state().cam_from_world.R().row(2).transpose();
  EXPECT_GT(forward.x(), 0.3);  // it looked along +y: its right is +x
  EXPECT_NEAR(std::asin(forward.z()), 0.2, kTolerance);
}

TEST(Navigation, LooksStraightUpAndDownWithoutTumbling) {
  Navigator n(StateAt({0, 0, 5}, {0, 0, 0}), Eigen::Vector3d::UnitZ(),
              1.0);  // straight down: right is not defined by up
  for (int i = 0; i < 100; ++i) {
    n.Look(0.1, 0.05);
    ASSERT_TRUE(n.state().cam_from_world.R().allFinite());
  }
  EXPECT_NEAR(n.Elevation(), Navigator::kMaxElevation, 1e-6);
  EXPECT_NEAR(n.Roll(), 0, 1e-8);
}

TEST(Navigation, ARollIsLevelledAfterATurnOnly) {
  ViewState tilted = StateAt({3, 0, 1}, {0, 0, 0});
  const Eigen::Vector3d eye = tilted.cam_from_world.OriginInSource();
  tilted.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())) * tilted.cam_from_world.rotation;
  tilted.cam_from_world.translation = -(tilted.cam_from_world.rotation * eye);
  Navigator n(tilted, Eigen::Vector3d::UnitZ(), 1.0);
  EXPECT_NEAR(std::abs(n.Roll()), 0.4, kTolerance);
  EXPECT_FALSE(n.Tick(1.0));
  EXPECT_NEAR(std::abs(n.Roll()), 0.4, kTolerance);
  n.Orbit({0, 0, 0}, 0.01, 0);
  double last = 0.41;
  for (int i = 0; i < 40; ++i) {
    n.Tick(0.05);
    ASSERT_LE(std::abs(n.Roll()), last + kTolerance);
    last = std::abs(n.Roll());
  }
  EXPECT_NEAR(n.Roll(), 0, 2e-4);
}

TEST(Navigation, AFlightEndsAtItsTargetAndAMoveEndsTheFlight) {
  const test::World w = test::MakeWorld(4, 100);
  Navigator n(StateOfView(w.scene, {0}), Eigen::Vector3d::UnitZ(), 1.0);
  n.FlyTo(StateOfView(w.scene, {3}), 0.5);
  Eigen::Vector3d last = n.state().cam_from_world.OriginInSource();
  for (int i = 0; n.flying(); ++i) {
    ASSERT_LT(i, 100);
    EXPECT_TRUE(n.Tick(0.02));
    const Eigen::Vector3d now = n.state().cam_from_world.OriginInSource();
    EXPECT_LT((now - last).norm(), 0.6);  // no jump: 7 units in 25 steps, fastest in the middle
    last = now;
  }
  EXPECT_EQ(NearestView(w.scene, n.state().cam_from_world), 3);
  EXPECT_LT((MakeWindowView(n.state(), 100, 75).P - MakeWindowView(StateOfView(w.scene, {3}), 100, 75).P).norm(), 1e-9);
  n.FlyTo(StateOfView(w.scene, {0}), 1.0);
  n.Tick(0.3);
  n.Fly(0.1, 0, 0);
  EXPECT_FALSE(n.flying());
}

TEST(Navigation, DollyNeverPassesItsPoint) {
  Navigator n(StateAt({3, 0, 0}, {0, 0, 0}), Eigen::Vector3d::UnitZ(), 1.0);
  for (int i = 0; i < 1000; ++i) n.Dolly({0, 0, 0}, 0.8);
  EXPECT_GE(n.state().cam_from_world.OriginInSource().x(), 1e-3);
  for (int i = 0; i < 300; ++i) n.Zoom(0.5);
  EXPECT_GT(n.state().lens.extent.minCoeff(), 0.001);
}

TEST(Script, ReadsStatements) {
  const auto steps =
      ParseScript(" jump 3; orbit 10 -2.5 ;\n wait; wait 0.5; k all; show false-color; screenshot a b.png;;");
  ASSERT_EQ(steps.size(), 7U);
  EXPECT_EQ(steps[0].verb, ScriptVerb::kJump);
  EXPECT_EQ(steps[0].word, "3");
  EXPECT_EQ(steps[1].numbers, (std::vector<double>{10, -2.5}));
  EXPECT_TRUE(steps[2].numbers.empty());
  EXPECT_EQ(steps[3].numbers, (std::vector<double>{0.5}));
  EXPECT_EQ(steps[6].word, "a b.png");
  EXPECT_TRUE(ParseScript(" ;\n").empty());
}

TEST(Script, NamesTheStatementThatIsWrong) {
  for (const char* bad : {"dance",
                          "orbit 10",
                          "orbit 10 20 30",
                          "orbit a b",
                          "k 0",
                          "k 17",
                          "k 1.5",
                          "dolly 0",
                          "zoom -1",
                          "frusta maybe",
                          "show red",
                          "jump",
                          "wait -1",
                          "move 1 2",
                          "orbit 1 nan",
                          "screenshot",
                          "set k",
                          "set colour red",
                          "set k 99",
                          "set resolution sharp",
                          "effects magic",
                          "effects fov,magic",
                          "key-update",
                          "key-update 1.5",
                          "key-time 0 -1",
                          "path-size 8 8",
                          "path-fps 0",
                          "path-seconds 0",
                          "budget 0.1",
                          "panel perhaps",
                          "play 3",
                          "record",
                          "time now"}) {
    try {
      ParseScript(std::string("wait; ") + bad + "; home");
      ADD_FAILURE() << bad << " was accepted";
    } catch (const UsageError& e) {
      EXPECT_THAT(std::string(e.what()), HasSubstr(std::string("'") + bad + "'"));
    }
  }
}

TEST(Script, SetTakesEveryOptionOfTheReconstruction) {
  const auto steps =
      ParseScript("set k 7; set resolution-range 0.5,4; effects fov,time; key-add; key-add 3; record a b.mp4");
  ASSERT_EQ(steps.size(), 6U);
  EXPECT_EQ(steps[0].word, "k");
  EXPECT_EQ(steps[0].value, "7");
  EXPECT_EQ(steps[1].value, "0.5,4");
  EXPECT_EQ(steps[5].word, "a b.mp4");
  for (const SettingOption& o : SettingOptions()) {
    const auto again = ParseScript("set " + o.name + " " + o.fallback);
    ASSERT_EQ(again.size(), 1U);
    EXPECT_EQ(again[0].word, o.name);
  }
}

// Whatever a user changes, in whatever order: the settings stay ones that are drawn.
TEST(SettingRules, ChangesFromThePanelNeverMakeAnInvalidCombination) {
  RadianceSettings s;
  std::mt19937_64 random(11);
  const std::vector<std::pair<std::string, std::vector<std::string>>> moves = {
      {"similarity", {"identity", "full"}},
      {"correlation", {"inverse", "falling-leaves"}},
      {"grid", {"pixel", "25x25", "2x9"}},
      {"sampling", {"candidates", "interpolated"}},
      {"r-min-deg", {"0", "3", "50"}},
      {"r-max-deg", {"0.01", "5", "90"}},
      {"k", {"1", "16", "all"}},
      {"resolution", {"off", "jacobian"}},
      {"time", {"on", "off"}}};
  int full = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto& [name, values] = moves[random() % moves.size()];
    SetOption(s, name, values[random() % values.size()]);
    Reconcile(s, name);
    ASSERT_EQ(Validate(s), "") << "after " << name << " in step " << i;
    full += s.similarity == Similarity::kFull ? 1 : 0;
  }
  EXPECT_GT(full, 100);  // it is not that the optimum was never reached
}

TEST(SettingRules, AnOptionSaysWhyItHasNoEffect) {
  RadianceSettings s;
  EXPECT_EQ(WhyWithoutEffect(s, "k"), "");
  EXPECT_NE(WhyWithoutEffect(s, "cutoff-deg"), "");
  EXPECT_NE(WhyWithoutEffect(s, "epipoles"), "");
  EXPECT_NE(WhyWithoutEffect(s, "beta"), "");
  s.similarity = Similarity::kFull;
  Reconcile(s, "similarity");
  EXPECT_EQ(WhyWithoutEffect(s, "k"), "") << "its local mean is over the k nearest";
  EXPECT_EQ(WhyWithoutEffect(s, "cutoff-deg"), "");
  EXPECT_EQ(WhyWithoutEffect(s, "r-min-deg"), "");
  s.grid_columns = s.grid_rows = 25;
  EXPECT_EQ(WhyWithoutEffect(s, "epipoles"), "");
}

// Frame times are simulated: what a setting costs on some machine, times a load that changes.
class Budget : public testing::Test {
 protected:
  static double Cost(const RadianceSettings& s) {
    return !s.Sparse() ? 90 : s.sampling == Sampling::kInterpolated ? 8.0 * s.k : 14.0 + 3.0 * s.k;
  }
  static void ProbeAll(MotionBudget& budget) {
    while (const RadianceSettings* s = budget.ToProbe()) budget.Probed(Cost(*s));
  }
  const FrontKey nowhere_{"none", "gl", "a machine", 640, 480};
};

TEST_F(Budget, AMovingCameraGetsWhatFitsAndARestingOneTheUsersSettings) {
  RadianceSettings base;
  base.visibility = false;
  base.k = 7;  // no setting that is probed
  MotionBudget budget;
  EXPECT_FALSE(budget.active());
  budget.Begin(40, "/nonexistent", nowhere_, base);
  ASSERT_NE(budget.ToProbe(), nullptr);
  EXPECT_EQ(budget.Next(0, true, base), base);  // nothing is known yet
  ProbeAll(budget);
  double now = 0, slowest = 0;
  for (int i = 0; i < 100; ++i, now += 0.04) {
    const RadianceSettings s = budget.Next(now, true, base);
    EXPECT_FALSE(s.visibility);  // what a user switched off stays off
    EXPECT_EQ(Validate(s), "");
    slowest = std::max(slowest, Cost(s));
    budget.Measured(Cost(s));
  }
  EXPECT_LE(slowest, 40);
  EXPECT_GT(slowest, 15);  // nor is the time left unused
  // The machine becomes slower by half: within frames it fits again, as far as anything does.
  double last = 0;
  for (int i = 0; i < 60; ++i, now += 0.04) {
    last = 1.5 * Cost(budget.Next(now, true, base));
    budget.Measured(last);
  }
  EXPECT_LE(last, 40 * 1.15);
  EXPECT_EQ(budget.Next(now + 1, false, base), base);
  budget.End();
  EXPECT_EQ(budget.Next(now + 2, true, base), base);
}

TEST_F(Budget, WhatTheBackendRefusesIsPassedOver) {
  MotionBudget budget;
  budget.Begin(40, "/nonexistent", nowhere_, {});
  while (const RadianceSettings* s = budget.ToProbe())
    budget.Probed(s->sampling == Sampling::kInterpolated ? std::nullopt : std::optional(Cost(*s)));
  for (int i = 0; i < 20; ++i) {
    const RadianceSettings s = budget.Next(0.04 * i, true, {});
    EXPECT_EQ(s.sampling, Sampling::kCandidates);
    budget.Measured(Cost(s));
  }
  MotionBudget none;
  none.Begin(40, "/nonexistent", nowhere_, {});
  while (none.ToProbe() != nullptr) none.Probed(std::nullopt);
  EXPECT_EQ(none.Next(0, true, {}), RadianceSettings{});
}

class Recording : public testing::Test {
 protected:
  void SetUp() override {
    if (!FindProgram("ffmpeg")) GTEST_SKIP() << "ffmpeg is not installed";
    folder_ = std::filesystem::temp_directory_path() / ("lumi_recorder_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }
  // Everything in the folder, hidden files too.
  std::set<std::string> Names() const {
    std::set<std::string> names;
    for (const auto& e : std::filesystem::directory_iterator(folder_)) names.insert(e.path().filename());
    return names;
  }
  static void Feed(Recorder& recorder, int frames) {
    for (int i = 0; i < frames; ++i) {
      while (recorder.Full() && !recorder.Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      recorder.Add(Image8(64, 48, 3, static_cast<std::uint8_t>(20 * i)));
    }
  }
  static void Await(const Recorder& recorder) {
    for (int i = 0; i < 20000 && !recorder.Ended(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::filesystem::path folder_;
};

TEST_F(Recording, TheLastPictureLastsUntilThereAreAsManyFramesAsAreWanted) {
  // What a busy machine drew in half a second: three pictures.
  Recorder recorder(folder_ / "clip.mp4", 30);
  Feed(recorder, 3);
  recorder.Finish(15);
  recorder.Finish(90);  // it is finished: nothing is added any more
  Await(recorder);
  ASSERT_EQ(recorder.state(), Recorder::State::kWritten) << recorder.problem();
  EXPECT_EQ(recorder.encoded(), 15);
  VideoReader video(folder_ / "clip.mp4");
  int frames = 0, last = -1;
  while (const auto frame = video.Next()) {
    ++frames;
    last = frame->rgb.At(32, 24, 0);
  }
  EXPECT_EQ(frames, 15);
  EXPECT_NEAR(last, 40, 6);  // the third's grey, after the codec
}

TEST_F(Recording, AFileIsThereWhenAllOfItIsAndNoneIsWrittenOver) {
  std::ofstream(folder_ / "clip.mp4") << "a user's own";
  Recorder recorder(folder_ / "clip.mp4", 25);
  Feed(recorder, 10);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "clip_001.mp4"));
  recorder.Finish();
  Await(recorder);
  ASSERT_EQ(recorder.state(), Recorder::State::kWritten) << recorder.problem();
  EXPECT_EQ(recorder.file(), folder_ / "clip_001.mp4");
  EXPECT_EQ(std::filesystem::file_size(folder_ / "clip.mp4"), 12U);
  EXPECT_EQ(Names(), (std::set<std::string>{"clip.mp4", "clip_001.mp4"}));
  VideoReader video(folder_ / "clip_001.mp4");
  int frames = 0;
  while (video.Next()) ++frames;
  EXPECT_EQ(frames, 10);
  EXPECT_NEAR(video.fps(), 25, 1e-6);
}

TEST_F(Recording, CancelledOrForgottenItLeavesNothing) {
  {
    Recorder recorder(folder_ / "clip.mp4", 25);
    Feed(recorder, 6);
    recorder.Cancel();
    Await(recorder);
    EXPECT_EQ(recorder.state(), Recorder::State::kCancelled);
  }
  {
    Recorder recorder(folder_ / "clip.mp4", 25);
    Feed(recorder, 6);
  }
  EXPECT_TRUE(Names().empty());
}

TEST_F(Recording, SaysWhatWentWrong) {
  Recorder none(folder_ / "none.mp4", 25);
  none.Finish();
  Await(none);
  EXPECT_EQ(none.state(), Recorder::State::kFailed);
  EXPECT_THAT(none.problem(), HasSubstr("no frame"));
  Recorder sizes(folder_ / "sizes.mp4", 25);
  sizes.Add(Image8(64, 48, 3));
  sizes.Add(Image8(32, 48, 3));
  Await(sizes);
  EXPECT_EQ(sizes.state(), Recorder::State::kFailed);
  sizes.Add(Image8(64, 48, 3));  // nobody listens any more: no harm
  EXPECT_TRUE(Names().empty());
  EXPECT_THROW(Recorder(folder_ / "clip.avi", 25), UsageError);
}

constexpr double kPatience_s = 60;  // for a picture of a second on an idle machine

class Refining : public testing::Test {
 protected:
  Refining() {
    test::Photograph(world_);
    const Sources sources = MakeSources(world_.scene);
    tracer_ = std::make_shared<const ProxyTracer>(world_.proxy, world_.scene.normalized_from_world);
    visibility_ = std::make_shared<const VisibilityMaps>(MakeVisibilityMaps(sources, *tracer_));
  }
  Refinement Wanted(int width, int height) const {
    Refinement r;
    r.request.view = MakeWindowView(StateAt({2.6, 0.4, 1.9}, {0, 0, 0.3}), width, height);
    r.request.settings = OptimalSettings({});
    r.sources = MakeSources(world_.scene);
    r.proxy = tracer_;
    r.visibility = visibility_;
    r.photos = std::make_shared<const std::vector<Photo>>(world_.photos);
    return r;
  }
  Refinement Slow() const {
    Refinement r = Wanted(2400, 1800);
    r.request.settings.accuracy = 1e-6;
    return r;
  }
  ImageF ByTheRenderer(const Refinement& r) const {
    return MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos)->Render(r.request);
  }
  static std::optional<RefinedPicture> Finished(Refiner& refiner) {
    for (const auto start = std::chrono::steady_clock::now(); SecondsSince(start) < kPatience_s;) {
      if (auto picture = refiner.Take()) return picture;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return std::nullopt;
  }
  static bool Drawing(const Refiner& refiner) {
    for (const auto start = std::chrono::steady_clock::now(); SecondsSince(start) < kPatience_s;) {
      if (refiner.fraction() > 0) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }

  test::World world_ = test::MakeWorld(7, 160);
  std::shared_ptr<const ProxyTracer> tracer_;
  std::shared_ptr<const VisibilityMaps> visibility_;
};

TEST_F(Refining, GivesWhatTheCpuRendererDraws) {
  Refiner refiner;
  Refinement wanted = Wanted(200, 150);
  for (const Show show : {Show::kColor, Show::kFalseColor}) {
    wanted.request.show = show;
    refiner.Start(wanted);
    EXPECT_TRUE(refiner.busy());
    const auto picture = Finished(refiner);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->problem, "");
    EXPECT_GT(picture->seconds, 0);
    EXPECT_EQ(picture->image.data, ByTheRenderer(wanted).data);  // the same tiles
    EXPECT_FALSE(refiner.busy());
    EXPECT_FALSE(refiner.Take());
  }
}

TEST_F(Refining, APhotoThatIsMissingTakesNoPart) {
  auto photos = world_.photos;
  photos[3].levels.clear();
  Refinement wanted = Wanted(160, 120);
  wanted.photos = std::make_shared<const std::vector<Photo>>(photos);
  Refiner refiner;
  refiner.Start(wanted);
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  wanted.request.use.assign(photos.size(), true);
  wanted.request.use[3] = false;
  EXPECT_EQ(picture->image.data, ByTheRenderer(wanted).data);
}

TEST_F(Refining, WhatIsWantedNextTakesThePlaceOfWhatIsBeingDrawn) {
  Refiner refiner;
  double handed_over_s = 1e300;
  for (int i = 0; i < 10; ++i) {  // the least of them: on a busy machine any one may have to wait for a core
    refiner.Start(Slow());
    ASSERT_TRUE(Drawing(refiner));
    const auto start = std::chrono::steady_clock::now();
    refiner.Start(Wanted(64, 48));
    handed_over_s = std::min(handed_over_s, SecondsSince(start));
  }
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->image.width, 64);
  EXPECT_LT(handed_over_s, 0.005);  // the window's thread never waits for a tile: microseconds
}

TEST_F(Refining, ACancelledPictureNeverComesAndTheCoresAreFreeAtTheNextTile) {
  auto refiner = std::make_unique<Refiner>();
  refiner->Start(Slow());
  ASSERT_TRUE(Drawing(*refiner));
  refiner->Cancel();
  EXPECT_FALSE(refiner->busy());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(refiner->Take());
  // An end in the middle of a picture waits for its tiles only: 4300 of them make a picture.
  const auto begun = std::chrono::steady_clock::now();
  refiner->Start(Slow());
  ASSERT_TRUE(Drawing(*refiner));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const double fraction = refiner->fraction(), whole_s = SecondsSince(begun) / fraction;
  ASSERT_LT(fraction, 0.9);
  const auto start = std::chrono::steady_clock::now();
  refiner.reset();
  EXPECT_LT(SecondsSince(start), 0.25 * whole_s);
}

TEST_F(Refining, AnyOrderOfCallsEndsWithThePictureThatWasWantedLast) {
  Refiner refiner;
  std::mt19937_64 random(11);
  for (int i = 0; i < 200; ++i) {
    switch (random() % 4) {
      case 0: refiner.Cancel(); break;
      case 1: refiner.Take(); break;
      default: refiner.Start(Wanted(64 + static_cast<int>(random() % 64), 40)); break;
    }
    if (random() % 3 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 3000));
  }
  refiner.Start(Wanted(33, 17));
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->image.width, 33);
}

TEST_F(Refining, SaysWhatCannotBeDrawn) {
  Refinement wanted = Wanted(64, 48);
  wanted.request.view.P.setZero();
  Refiner refiner;
  refiner.Start(wanted);
  const auto picture = Finished(refiner);
  ASSERT_TRUE(picture);
  EXPECT_THAT(picture->problem, HasSubstr("singular"));
}

TEST(OptimalSettingsTest, AreValidWhereTheSettingsAreAndKeepWhatTheOptimumReads) {
  RadianceSettings s;
  s.grid_columns = s.grid_rows = 25;
  s.r_max_rad = 0.2;
  s.field_of_view = false;
  const RadianceSettings optimal = OptimalSettings(s);
  EXPECT_EQ(Validate(optimal), "");
  EXPECT_EQ(optimal.similarity, Similarity::kFull);
  EXPECT_FALSE(optimal.Sparse());
  EXPECT_EQ(optimal.r_max_rad, 0.2);
  EXPECT_FALSE(optimal.field_of_view);
}

TEST(PhotoBudget, HalvesUntilThePhotosFit) {
  const test::World w = test::MakeWorld(10, 160);
  const PhotoBudget whole = PlanPhotos(w.scene, 1000000000);
  EXPECT_EQ(whole.sizes_px[0], Eigen::Vector2i(160, 120));
  EXPECT_EQ(whole.sizes_px[2], Eigen::Vector2i(117, 155));
  const PhotoBudget less = PlanPhotos(w.scene, whole.bytes / 2);
  EXPECT_LE(less.bytes, whole.bytes / 2);
  EXPECT_EQ(less.sizes_px[0], Eigen::Vector2i(80, 60));
  EXPECT_EQ(less.sizes_px[2], Eigen::Vector2i(58, 77));
  EXPECT_EQ(PlanPhotos(w.scene, 1).max_side_px, 1);  // nothing smaller exists
}

class Loading : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("lumi_loader_test_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    world_ = test::MakeWorld(9, 64);
    test::Photograph(world_);
    world_.scene.image_folder = folder_;
    for (std::size_t j = 0; j < 9; ++j) WriteImage(folder_ / world_.scene.views[j].name, world_.photos[j].levels[0]);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::vector<PhotoLoader::Loaded> TakeAll(PhotoLoader& loader) {
    std::vector<PhotoLoader::Loaded> all;
    const auto start = std::chrono::steady_clock::now();
    while (loader.outstanding() > 0 && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
      if (auto loaded = loader.Take())
        all.push_back(std::move(*loaded));
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return all;
  }

  std::filesystem::path folder_;
  test::World world_;
};

TEST_F(Loading, GivesEveryPhotoOnceInThePlannedSize) {
  const PhotoBudget plan = PlanPhotos(world_.scene, 60000);
  EXPECT_LT(plan.max_side_px, 64);
  PhotoLoader loader(world_.scene, plan.max_side_px, 3);
  std::set<int> seen;
  for (const auto& l : TakeAll(loader)) {
    EXPECT_TRUE(l.error.empty()) << l.error;
    EXPECT_TRUE(seen.insert(l.view.value).second);
    const Eigen::Vector2i planned = plan.sizes_px[static_cast<std::size_t>(l.view.value)];
    EXPECT_EQ(l.photo.levels.at(0).width, planned.x());
    EXPECT_EQ(l.photo.levels.at(0).height, planned.y());
  }
  EXPECT_EQ(seen.size(), 9U);
}

TEST_F(Loading, NamesAPhotoThatCannotBeRead) {
  std::filesystem::remove(folder_ / world_.scene.views[4].name);
  PhotoLoader loader(world_.scene, 0, 2);
  int failed = 0;
  for (const auto& l : TakeAll(loader)) {
    if (l.error.empty()) continue;
    ++failed;
    EXPECT_EQ(l.view.value, 4);
    EXPECT_TRUE(l.photo.levels.empty());
  }
  EXPECT_EQ(failed, 1);
}

TEST_F(Loading, EndsWhileItLoads) {
  for (int i = 0; i < 5; ++i) PhotoLoader loader(world_.scene, 0, 2);  // destroyed at once: no hang, no crash
  SUCCEED();
}

}  // namespace
}  // namespace lumi
