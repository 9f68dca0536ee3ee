#include "simulate/camera_paths.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "scene/program/error.h"
#include "simulate/examples.h"

namespace lumi {
namespace {

SceneDescription WithPath(const std::string& path) {
  return ParseScene(R"({"name": "s", "cameras": [{"size": [8, 6], "fov_deg": 50}], "path": )" + path + "}", "test.json",
                    ".");
}

Eigen::Vector3d Eye(const PathDescription& path, double frame) { return PoseAt(path, frame).OriginInSource(); }

TEST(CameraPaths, ARingIsEvenAndLooksInwards) {
  const auto scene = WithPath(R"({"kind": "ring", "views": 12, "centre": [1, 2, 3], "radius": 4, "height": 1})");
  const PathDescription& path = scene.paths[0];
  const double step = (Eye(path, 1) - Eye(path, 0)).norm();
  for (int i = 0; i < 12; ++i) {
    EXPECT_NEAR((Eye(path, i) - Eye(path, (i + 1) % 12)).norm(), step, 1e-12);
    const Eigen::Vector3d centre = PoseAt(path, i) * Eigen::Vector3d(1, 2, 3);
    EXPECT_NEAR(centre.head<2>().norm(), 0, 1e-12);
    EXPECT_GT(centre.z(), 0);
  }
}

TEST(CameraPaths, AHalfCircleEndsOppositeToWhereItBegan) {
  const auto scene = WithPath(R"({"kind": "half-circle", "views": 4, "radius": 2})");
  EXPECT_LT((Eye(scene.paths[0], 0) + Eye(scene.paths[0], 3)).norm(), 1e-12);
}

TEST(CameraPaths, AWalkBobsAtItsGait) {
  const auto scene = WithPath(R"({"kind": "walk", "views": 91, "fps": 30, "from": [0, 0, 1.6], "to": [3, 0, 1.6],
                                  "gait": {"step_hz": 2, "bob": 0.05, "sway": 0, "shake_deg": 0}})");
  // 2 steps a second: the head is highest an eighth of a second after each step begins.
  EXPECT_NEAR(Eye(scene.paths[0], 30 * 0.125).z(), 1.65, 1e-12);
  EXPECT_NEAR(Eye(scene.paths[0], 30 * 0.375).z(), 1.55, 1e-12);
  EXPECT_NEAR(Eye(scene.paths[0], 90).x(), 3, 1e-12);
}

TEST(CameraPaths, AGridIsReadFromTheTopLeft) {
  const auto scene = WithPath(
      R"({"kind": "grid", "centre": [0, -5, 0], "columns": 3, "rows": 2, "spacing": [0.2, 0.1], "look_at": [0, 0, 0]})");
  EXPECT_EQ(scene.paths[0].views, 6);
  EXPECT_LT((Eye(scene.paths[0], 0) - Eigen::Vector3d(-0.2, -5, 0.05)).norm(), 1e-12);
  EXPECT_LT((Eye(scene.paths[0], 5) - Eigen::Vector3d(0.2, -5, -0.05)).norm(), 1e-12);
}

TEST(CameraPaths, UpIsUpInEveryPhoto) {
  for (const Example& example : Examples()) {
    if (example.name == "boards") continue;  // looks straight down
    const auto scene = ParseScene(ExampleJson(example.name), example.name, ".");
    for (const PathDescription& path : scene.paths)
      for (int i = 0; i < path.views; i += 7) {
        // The image's y axis points down: world's z has a negative y component there.
        EXPECT_LT((PoseAt(path, i).rotation * Eigen::Vector3d::UnitZ()).y(), -0.3) << example.name << " " << i;
      }
  }
}

TEST(CameraPaths, ExamplesAreAsLongAsTheThesisSays) {
  const auto views = [](const char* name) { return PlanViews(ParseScene(ExampleJson(name), name, "."), 0).size(); };
  EXPECT_EQ(views("desk"), 262u);
  EXPECT_EQ(views("street"), 5000u);
  EXPECT_EQ(views("hallway"), 1096u);
  EXPECT_EQ(views("car"), 36u);
  EXPECT_EQ(views("person"), 4u);
}

TEST(CameraPaths, AFewOfManyAreEvenlySpreadAndKeepTheirNames) {
  const auto line = WithPath(R"({"kind": "drive", "views": 101, "from": [0, 0, 0], "to": [1, 0, 0], "fps": 10})");
  const auto all = PlanViews(line, 0), few = PlanViews(line, 5);
  ASSERT_EQ(few.size(), 5u);
  for (int i = 0; i < 5; ++i) {
    const PlannedView& view = few[static_cast<std::size_t>(i)];
    EXPECT_EQ(view.frame_index, 25 * i);
    EXPECT_EQ(view.name, all[static_cast<std::size_t>(25 * i)].name);
    EXPECT_NEAR(view.time_s, 2.5 * i, 1e-12);
  }
  const auto ring = WithPath(R"({"kind": "ring", "views": 36, "radius": 1})");
  const auto quarter = PlanViews(ring, 4);
  EXPECT_EQ(quarter[3].frame_index, 27);  // a closed path: the last is not the first again
  EXPECT_THROW(PlanViews(ring, 37), UsageError);
}

TEST(CameraPaths, ClustersHaveTheirViewsAboutTheirCentres) {
  const auto scene = ParseScene(ExampleJson("desk"), "desk", ".");
  const PathDescription& path = scene.paths[0];
  ASSERT_EQ(path.centres.size(), 13u);
  std::set<std::size_t> used;
  for (int i = 0; i < path.views; ++i) {
    std::size_t nearest = 0;
    for (std::size_t k = 0; k < path.centres.size(); ++k)
      if ((Eye(path, i) - path.centres[k]).norm() < (Eye(path, i) - path.centres[nearest]).norm()) nearest = k;
    EXPECT_LT((Eye(path, i) - path.centres[nearest]).norm(), 1.2 * path.spread);
    used.insert(nearest);
  }
  EXPECT_EQ(used.size(), 13u);
}

}  // namespace
}  // namespace lumi
