#include "reconstruct/held_cameras.h"

#include <random>

#include "database_fixture.h"
#include "reconstruct/reprojection.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// Cameras on an arc around points whose matches are known, a tenth of them wrong.
class HeldCameras : public ::testing::Test {
 protected:
  static constexpr int kViews = 6;
  static constexpr int kPoints = 200;

  void SetUp() override {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> coordinate(-1, 1);
    for (int i = 0; i < kPoints; ++i) truth_.emplace_back(coordinate(random), coordinate(random), coordinate(random));
    Camera camera;
    camera.model = CameraModel::kSimpleRadial;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.params = {600, 320, 240, -0.05};
    TestDatabase db(folder_.path() / "database.db");
    for (int v = 0; v < kViews; ++v) {
      HeldView view;
      view.name = "photo" + std::to_string(v) + ".jpg";
      view.camera = camera;
      const double angle = 0.15 * v;
      view.cam_from_world = LookAt(Eigen::Vector3d(6 * std::sin(angle), 0.5, -6 * std::cos(angle)),
                                   Eigen::Vector3d::Zero(), Eigen::Vector3d(0, -1, 0));
      views_.push_back(view);
      std::vector<Eigen::Vector2d> keypoints;
      for (const auto& X : truth_) keypoints.push_back(*camera.Project(view.cam_from_world * X));
      db.AddImage(v + 1, view.name, keypoints);
    }
    std::uniform_int_distribution<int> any(0, kPoints - 1);
    for (int a = 0; a < kViews; ++a)
      for (int b = a + 1; b < kViews; ++b) {
        std::vector<std::pair<int, int>> matches;
        for (int i = 0; i < kPoints; ++i) matches.emplace_back(i, i % 10 == 3 ? any(random) : i);
        db.AddMatches(a + 1, b + 1, matches);
      }
  }

  FixtureFolder folder_{"held"};
  std::vector<Eigen::Vector3d> truth_;
  std::vector<HeldView> views_;
};

TEST_F(HeldCameras, PointsAreTriangulatedAndWrongMatchesLeftOut) {
  const Scene scene = TriangulateHeld(views_, folder_.path() / "database.db", {}, SilentProgress());
  ASSERT_EQ(scene.views.size(), static_cast<std::size_t>(kViews));
  EXPECT_EQ(scene.cameras.size(), 1u);  // equal cameras are one
  EXPECT_GE(scene.points.size(), 175u);
  EXPECT_LE(scene.points.size(), 215u);
  // Keypoints are floats: 640 px * 2^-24 each, times depth over focal length and the geometry's condition.
  constexpr double kExact = 1e-4;
  int exact = 0;
  for (const Point& point : scene.points) {
    double nearest = 1e9;
    for (const auto& X : truth_) nearest = std::min(nearest, (X - point.x_in_world).norm());
    exact += nearest < kExact;
    std::set<int> views;
    for (const Observation& o : point.track) views.insert(o.view.value);
    EXPECT_EQ(views.size(), point.track.size());  // a photo sees a point once
  }
  EXPECT_GE(exact, 175);
  // The cameras are held exactly.
  for (int v = 0; v < kViews; ++v)
    EXPECT_EQ(scene.views[static_cast<std::size_t>(v)].cam_from_world.translation,
              views_[static_cast<std::size_t>(v)].cam_from_world.translation);
}

TEST_F(HeldCameras, ObservationsArePhotoPixelsUnderTheDistortedCamera) {
  Scene scene = TriangulateHeld(views_, folder_.path() / "database.db", {}, SilentProgress());
  EXPECT_LT(UpdatePointErrors(scene), 0.1);  // the few points of wrong matches are within 4 px each
}

TEST_F(HeldCameras, WrongCamerasGiveHardlyAnyPoint) {
  for (auto& view : views_) view.cam_from_world = view.cam_from_world.Inverse();
  EXPECT_LT(TriangulateHeld(views_, folder_.path() / "database.db", {}, SilentProgress()).points.size(), 40u);
}

TEST_F(HeldCameras, AMatchOfAFeatureThatIsNotThereIsRefused) {
  {
    TestDatabase other(folder_.path() / "bad.db");
    other.AddImage(1, "photo0.jpg", 3);
    other.AddImage(2, "photo1.jpg", 3);
    other.AddMatches(1, 2, {{0, 99}});
  }
  EXPECT_THROW(TriangulateHeld(views_, folder_.path() / "bad.db", {}, SilentProgress()), InputError);
}

}  // namespace
}  // namespace lumi
