// A scene's scale from two places: each kind of place in closed form, what is refused, and that the manifest keeps it.
#include "reconstruct/measure_scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/projection.h"
#include "scene/program/error.h"
#include "tests/reconstruct/database_fixture.h"

namespace lumi {
namespace {
namespace fs = std::filesystem;

// Five cameras in a row, 0.5 units apart, that look along z at a wall in the plane z = 4.
Scene Row() {
  Scene scene;
  scene.cameras = {Camera::Pinhole(640, 480, 500, 500, 320, 240)};
  for (int i = 0; i < 5; ++i) {
    View view;
    view.name = i == 3 ? "odd+name:1,2.jpg" : "photo_" + std::to_string(i) + ".jpg";
    view.camera = {0};
    view.cam_from_world.translation = Eigen::Vector3d(-0.5 * i, 0, 0);
    scene.views.push_back(view);
  }
  for (int i = 0; i < 60; ++i) {
    Point point;
    point.x_in_world = {-1 + 0.05 * i, 0.3 * std::sin(i), 4};
    for (int v = 0; v < 5; ++v)
      point.track.push_back(
          {{v}, *scene.cameras[0].Project(scene.views[static_cast<std::size_t>(v)].cam_from_world * point.x_in_world)});
    scene.points.push_back(point);
  }
  UpdateFrameOfReference(scene);
  return scene;
}

Mesh Wall() {
  Mesh wall;
  wall.vertices = {{-3, -3, 4}, {5, -3, 4}, {5, 3, 4}, {-3, 3, 4}};
  wall.faces = {{0, 2, 1}, {0, 3, 2}};
  return wall;
}

// Where photo `view` shows a point, as a place.
std::string Seen(const Scene& scene, int view, const Eigen::Vector3d& x) {
  const View& v = scene.views[static_cast<std::size_t>(view)];
  const Eigen::Vector2d x_px = *scene.cameras[0].Project(v.cam_from_world * x);
  return v.name + ":" + std::to_string(x_px.x()) + "," + std::to_string(x_px.y());
}

TEST(MeasureScene, EveryKindOfPlaceIsWhereItIs) {
  const Scene scene = Row();
  const Mesh wall = Wall();
  const Eigen::Vector3d x(0.7, -0.4, 4), near(0.2, 0.1, 3);
  EXPECT_EQ(FindPlace(scene, "photo_2.jpg", nullptr).x_in_world, Eigen::Vector3d(1, 0, 0));
  EXPECT_EQ(FindPlace(scene, "odd+name:1,2.jpg", nullptr).x_in_world, Eigen::Vector3d(1.5, 0, 0));
  EXPECT_EQ(FindPlace(scene, "0.25,-1e-3,2", nullptr).x_in_world, Eigen::Vector3d(0.25, -1e-3, 2));
  constexpr double kTextDigits = 1e-7;  // six decimals of a pixel
  EXPECT_LT((FindPlace(scene, Seen(scene, 1, x), &wall).x_in_world - x).norm(), kTextDigits);
  EXPECT_LT((FindPlace(scene, Seen(scene, 0, near) + "+" + Seen(scene, 4, near), nullptr).x_in_world - near).norm(),
            kTextDigits);
  const MeasuredPlace three =
      FindPlace(scene, Seen(scene, 0, near) + "+" + Seen(scene, 3, near) + "+" + Seen(scene, 4, near), &wall);
  EXPECT_LT((three.x_in_world - near).norm(), kTextDigits);
  EXPECT_EQ(three.from, "photos");
  EXPECT_EQ(FindPlace(scene, Seen(scene, 3, x), &wall).from, "proxy");
}

TEST(MeasureScene, TheScaleAndWhatAPixelIsWorth) {
  Scene scene = Row();
  const Mesh wall = Wall();
  // Two cameras: no pixel counts.
  MeasureSummary s = Measure(scene, {"", "photo_0.jpg", "photo_4.jpg", 3.0}, nullptr);
  EXPECT_DOUBLE_EQ(s.metres_per_unit, 1.5);
  EXPECT_EQ(s.percent_for_a_pixel, 0);
  EXPECT_DOUBLE_EQ(s.cameras_extent_m, 3.0);
  EXPECT_FALSE(s.metres_per_unit_before);
  // Two pixels of one photo on the wall, one unit apart: a pixel is 4/500 unit there, and counts along their line only.
  const MeasureOptions request{"", Seen(scene, 0, {0, 0, 4}), Seen(scene, 0, {1, 0, 4}), 0.25};
  scene.metres_per_unit = 2;
  s = Measure(scene, request, &wall);
  EXPECT_NEAR(s.metres_per_unit, 0.25, 1e-7);
  EXPECT_EQ(s.metres_per_unit_before, 2);
  EXPECT_NEAR(s.percent_for_a_pixel, 100 * std::sqrt(2.0) * 4 / 500, 0.01);
}

TEST(MeasureScene, WhatCannotBeMeasuredIsRefused) {
  const Scene scene = Row();
  const Mesh wall = Wall();
  const auto measure = [&](const std::string& a, const std::string& b, double metres = 1) {
    return Measure(scene, {"", a, b, metres}, &wall);
  };
  EXPECT_THROW(measure("photo_0.jpg", "photo_9.jpg"), UsageError);  // no such photo
  EXPECT_THROW(measure("photo_0.jpg", "1,2"), UsageError);          // no point
  EXPECT_THROW(measure("photo_0.jpg", "1,2,nan"), UsageError);
  EXPECT_THROW(measure("photo_0.jpg", "photo_1.jpg:641,5"), UsageError);  // outside of the photo
  EXPECT_THROW(measure("photo_0.jpg", "photo_1.jpg", 0), UsageError);
  EXPECT_THROW(measure("photo_0.jpg", "photo_1.jpg", -1), UsageError);
  EXPECT_THROW(measure("photo_0.jpg", "photo_1.jpg", INFINITY), UsageError);
  EXPECT_THROW(measure("photo_0.jpg", "photo_0.jpg"), DataError);          // one place
  EXPECT_THROW(FindPlace(scene, "photo_1.jpg:5,5", nullptr), UsageError);  // no proxy
  Mesh aside = wall;
  for (Eigen::Vector3d& v : aside.vertices) v.z() = -4;
  EXPECT_THROW(FindPlace(scene, "photo_1.jpg:5,5", &aside), DataError);
  // Two pixels that show different things, and rays that hardly meet.
  EXPECT_THROW(FindPlace(scene, "photo_0.jpg:100,100+photo_4.jpg:100,300", nullptr), DataError);
  EXPECT_THROW(FindPlace(scene, Seen(scene, 0, {0, 0, 400}) + "+" + Seen(scene, 1, {0, 0, 400}), nullptr), DataError);
}

TEST(MeasureScene, TheManifestKeepsTheScale) {
  const FixtureFolder folder("measure-scene");
  Scene scene = Row();
  scene.image_folder = folder.path() / "images";
  WriteScene(scene, folder.path());
  fs::create_directories(folder.path() / "images");
  const std::string points = ReadText(folder.path() / "sparse/points3D.bin");
  const MeasureSummary s = MeasureScene({folder.path(), "photo_0.jpg", "photo_1.jpg", 0.2}, SilentProgress());
  EXPECT_DOUBLE_EQ(s.metres_per_unit, 0.4);
  OpenOptions as_it_is;
  as_it_is.check_photos = false;
  Scene again = OpenScene(folder.path(), as_it_is, SilentProgress());
  EXPECT_EQ(again.metres_per_unit, s.metres_per_unit);
  EXPECT_EQ(ReadText(folder.path() / "sparse/points3D.bin"), points);
  // In a world twice as large a unit is half as long.
  Transform(again, {2, Eigen::Quaterniond::Identity(), {1, 2, 3}});
  EXPECT_DOUBLE_EQ(*again.metres_per_unit, 0.2);
  EXPECT_THROW(MeasureScene({folder.path() / "sparse", "a", "b", 1}, SilentProgress()), UsageError);
}

TEST(MeasureScene, ARigsStep) {
  Scene scene = Row();
  EXPECT_DOUBLE_EQ(StepOfCameras(scene), 0.5);
  for (View& view : scene.views) view.cam_from_world.translation.setZero();
  EXPECT_THROW(StepOfCameras(scene), DataError);
  scene.views.resize(1);
  EXPECT_THROW(StepOfCameras(scene), DataError);
}

}  // namespace
}  // namespace lumi
