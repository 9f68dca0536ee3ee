#include "scene/model/scene.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "random_scene.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/constants.h"
#include "scene/model/photo_twins.h"

namespace lumi {
namespace {

Scene SmallScene(int views) {
  test::Random random(31);
  Scene scene;
  scene.cameras.push_back(test::TestCamera());
  for (int i = 0; i < views; ++i) {
    View v;
    v.name = "photo" + std::to_string(100 + i) + ".jpg";
    v.camera = {0};
    v.cam_from_world = LookAt({std::cos(0.1 * i) * 4, std::sin(0.1 * i) * 4, 1.5}, {0, 0, 0}, {0, 0, 1});
    scene.views.push_back(v);
  }
  for (int i = 0; i < 200; ++i) {
    Point p;
    p.x_in_world = random.InBox(1);
    p.track = {{ViewId{0}, Eigen::Vector2d::Zero()}, {ViewId{i % views}, Eigen::Vector2d::Zero()}};
    scene.points.push_back(p);
  }
  return scene;
}

TEST(Scene, UpIsThePhotosOwnEvenWithSomePortraitShots) {
  Scene scene = SmallScene(20);
  for (int i = 0; i < 4; ++i) {  // camera turned by a quarter about its axis
    View& v = scene.views[static_cast<std::size_t>(i)];
    const Eigen::Vector3d c = v.CentreInWorld();
    v.cam_from_world.rotation = Eigen::AngleAxisd(1.5707963, Eigen::Vector3d::UnitZ()) * v.cam_from_world.rotation;
    v.cam_from_world.translation = -(v.cam_from_world.rotation * c);
  }
  UpdateFrameOfReference(scene);
  // The cameras look down by 20 degrees all round a part of a circle: their mean up leans towards it, but they are
  // level.
  EXPECT_LT(AngleBetween(scene.up, Eigen::Vector3d::UnitZ()) * kDegPerRad, 1);
}

// Hands roll a camera a little, each time another way; and where all photos look the same way, their mean is all there
// is.
TEST(Scene, UpIsLevelWithHandHeldPhotosAndThePhotosOwnWithoutATurn) {
  Scene scene = SmallScene(20);
  test::Random random(5);
  for (View& v : scene.views) {
    const Eigen::Vector3d c = v.CentreInWorld();
    v.cam_from_world.rotation =
        Eigen::AngleAxisd(0.07 * random.InBox(1).x(), Eigen::Vector3d::UnitZ()) * v.cam_from_world.rotation;
    v.cam_from_world.translation = -(v.cam_from_world.rotation * c);
  }
  UpdateFrameOfReference(scene);
  EXPECT_LT(AngleBetween(scene.up, Eigen::Vector3d::UnitZ()) * kDegPerRad, 2);

  for (View& v : scene.views) v.cam_from_world.rotation = scene.views[0].cam_from_world.rotation;
  UpdateFrameOfReference(scene);
  const Eigen::Vector3d own = -scene.views[0].cam_from_world.R().row(1).transpose();
  EXPECT_LT(AngleBetween(scene.up, own), 1e-9);
}

TEST(Scene, NormalisationCentresPointsAndIgnoresTheHorizon) {
  Scene scene = SmallScene(10);
  for (int i = 0; i < 10; ++i) scene.points[static_cast<std::size_t>(i)].x_in_world = {1e6, 0, 0};
  UpdateFrameOfReference(scene);
  const auto& s = scene.normalized_from_world;
  EXPECT_LT((s * Eigen::Vector3d(0, 0, 0)).norm(), 0.3);
  for (const View& v : scene.views) EXPECT_LT((s * v.CentreInWorld()).norm(), 4);
}

TEST(Scene, FoldsAreDisjointAndSortedByName) {
  const Scene scene = SmallScene(20);
  const auto report = FoldViews(scene, 8, Fold::kReport), choose = FoldViews(scene, 8, Fold::kChoose);
  ASSERT_EQ(report.size(), 3u);
  EXPECT_EQ(report[1].value, 8);
  ASSERT_EQ(choose.size(), 2u);
  EXPECT_EQ(choose[0].value, 4);
  EXPECT_THROW(FoldViews(scene, 1, Fold::kReport), std::invalid_argument);
}

TEST(PhotoTwins, CopiesAndSecondShotsAreLeftOutWithThePhoto) {
  Scene scene = SmallScene(20);  // points 3 to 6 away
  const auto add = [&](int of, double step, double turned_deg, std::optional<double> time_s = {}) {
    View v = scene.views[static_cast<std::size_t>(of)];
    const Eigen::Vector3d c = v.CentreInWorld() + step * Eigen::Vector3d(0.6, 0, 0.8);
    v.cam_from_world.rotation =
        Eigen::AngleAxisd(turned_deg * kRadPerDeg, Eigen::Vector3d::UnitY()) * v.cam_from_world.rotation;
    v.cam_from_world.translation = -(v.cam_from_world.rotation * c);
    v.time_s = time_s;
    scene.views.push_back(v);
    return scene.views.size() - 1;
  };
  const std::size_t copy = add(3, 0, 0), again = add(3, 0.001, 2), elsewhere = add(3, 0.02, 0), turned = add(3, 0, 20),
                    frame = add(3, 0, 0, 1.0), of_five = add(5, 0, 0);
  const PhotoTwins twins(scene);
  const auto without = [&](std::size_t photo, int count) {
    std::vector<bool> keep(scene.views.size(), true);
    keep[photo] = false;
    EXPECT_EQ(twins.LeaveOut(keep), count);
    return keep;
  };
  const std::vector<bool> keep = without(3, 2);
  for (const std::size_t twin : {copy, again}) EXPECT_FALSE(keep[twin]);
  for (const std::size_t other : {elsewhere, turned, frame, of_five, std::size_t{5}}) EXPECT_TRUE(keep[other]);
  EXPECT_FALSE(without(copy, 2)[3]) << "each is the other's";
  without(7, 0);
  // In another unit, and from far: the same.
  Transform(scene, {1e4, Eigen::Quaterniond::Identity(), {1e6, 0, 0}});
  std::vector<bool> moved(scene.views.size(), true);
  moved[3] = false;
  EXPECT_EQ(PhotoTwins(scene).LeaveOut(moved), 2);
  EXPECT_EQ(moved, keep);
}

TEST(PhotoTwins, WhereAllAreTwinsNoneIsLeftOut) {
  Scene scene = SmallScene(1);
  for (int i = 0; i < 5; ++i) scene.views.push_back(scene.views[0]);
  std::vector<bool> keep(scene.views.size(), true);
  keep[2] = false;
  EXPECT_EQ(PhotoTwins(scene).LeaveOut(keep), 0);
  EXPECT_EQ(std::ranges::count(keep, true), 5);
  scene.frame = Frame::kProjective;
  EXPECT_EQ(PhotoTwins(scene).LeaveOut(keep), 0);
  EXPECT_EQ(PhotoTwins(Scene{}).LeaveOut(keep = {}), 0);
}

TEST(Scene, MovingTheWorldLeavesThePhotosAlone) {
  Scene scene = SmallScene(10);
  UpdateFrameOfReference(scene);
  Scene moved = scene;
  const Similarity3 s{3.0, test::Random(5).Rotation(), {10, -4, 2}};
  Transform(moved, s);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const auto a = Project(MakeRenderView(scene, scene.views[i]).P, scene.points[7].x_in_world);
    const auto b = Project(MakeRenderView(moved, moved.views[i]).P, moved.points[7].x_in_world);
    EXPECT_LT((*a - *b).norm(), 1e-9);
    EXPECT_LT((scene.normalized_from_world * scene.views[i].CentreInWorld() -
               moved.normalized_from_world * moved.views[i].CentreInWorld())
                  .norm(),
              1e-12);
  }
}

TEST(Scene, DistortedCamerasAreNotRendered) {
  const Camera camera{CameraModel::kSimpleRadial, 640, 480, {500, 320, 240, 0.1}};
  EXPECT_THROW(MakeRenderView(camera, Rigid3{}), std::invalid_argument);
}

}  // namespace
}  // namespace lumi
