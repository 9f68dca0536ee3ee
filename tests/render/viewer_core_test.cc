// The viewer without a window: navigation, script, background loading.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <random>
#include <set>
#include <thread>

#include "render/viewer/navigation.h"
#include "render/viewer/photo_loader.h"
#include "render/viewer/script.h"
#include "scene/program/error.h"
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
      const auto x = Project(window.P, Eigen::Vector3d(view.cam_from_world.Inverse() * Eigen::Vector3d(ray->x(), ray->y(), 1.0)));
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
  Navigator n(StateAt({0, 0, 5}, {0, 0, 0}), Eigen::Vector3d::UnitZ(), 1.0);  // straight down: right is not defined by up
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
  tilted.cam_from_world.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ())) * tilted.cam_from_world.rotation;
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
  EXPECT_EQ(NearestView(w.scene, n.state()), 3);
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
  const auto steps = ParseScript(" jump 3; orbit 10 -2.5 ;\n wait; wait 0.5; k all; show false-color; screenshot a b.png;;");
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
  for (const char* bad : {"dance", "orbit 10", "orbit 10 20 30", "orbit a b", "k 0", "k 17", "k 1.5", "dolly 0", "zoom -1", "frusta maybe",
                          "show red", "jump", "wait -1", "move 1 2", "orbit 1 nan", "screenshot"}) {
    try {
      ParseScript(std::string("wait; ") + bad + "; home");
      ADD_FAILURE() << bad << " was accepted";
    } catch (const UsageError& e) {
      EXPECT_THAT(std::string(e.what()), HasSubstr(std::string("'") + bad + "'"));
    }
  }
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
