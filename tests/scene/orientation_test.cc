#include "scene/model/orientation.h"

#include <gtest/gtest.h>

#include "random_scene.h"
#include "scene/geometry/angle.h"
#include "scene/model/scene.h"

namespace lumi {
namespace {

// Where EXIF says that row 0 and column 0 of the stored picture are, for 1 to 8: what is up, in stored pixels.
TEST(Orientation, NamesTheSideThatIsUp) {
  const Eigen::Vector3d top(0, -1, 0), bottom(0, 1, 0), left(-1, 0, 0), right(1, 0, 0);
  const Eigen::Vector3d up[] = {top, top, bottom, bottom, left, left, right, right};
  for (int orientation = 1; orientation <= 8; ++orientation)
    EXPECT_EQ(UpInCamera(orientation), up[orientation - 1]) << orientation;
  for (const int none : {-1, 0, 9}) EXPECT_EQ(QuarterTurns(none), 0);
}

TEST(Orientation, APictureIsTurnedClockwiseByAQuarterForSix) {
  Image8 stored(3, 2, 3);
  for (int i = 0; i < 6; ++i) stored.At(i % 3, i / 3, 1) = static_cast<std::uint8_t>(i + 1);  // 1 2 3 / 4 5 6
  const auto greens = [](const Image8& image) {
    std::vector<int> values;
    for (std::size_t i = 1; i < image.data.size(); i += 3) values.push_back(image.data[i]);
    return values;
  };
  EXPECT_EQ(greens(UprightPicture(stored, 6)), (std::vector<int>{4, 1, 5, 2, 6, 3}));
  EXPECT_EQ(greens(UprightPicture(stored, 8)), (std::vector<int>{3, 6, 2, 5, 1, 4}));
  EXPECT_EQ(greens(UprightPicture(stored, 3)), (std::vector<int>{6, 5, 4, 3, 2, 1}));
  EXPECT_EQ(UprightPicture(stored, 6).width, 2);
  for (int orientation = 1; orientation <= 8; ++orientation)
    EXPECT_EQ(StoredPicture(UprightPicture(stored, orientation), orientation).data, stored.data) << orientation;
}

// The upright camera sees a point where the upright picture shows it.
TEST(Orientation, TheUprightCameraIsThatOfTheUprightPicture) {
  const Camera stored = Camera::Pinhole(64, 48, 60, 62, 30, 25);
  const Rigid3 pose = LookAt({1, -3, 0.5}, {0, 0, 0}, {0, 0, 1});
  test::Random random(3);
  for (const int orientation : {1, 3, 6, 8}) {
    const auto [camera, upright_pose] = UprightCamera(stored, pose, orientation);
    EXPECT_EQ(camera.width_px, UprightSize({64, 48}, orientation).x());
    EXPECT_LT((upright_pose.OriginInSource() - pose.OriginInSource()).norm(), 1e-12);
    EXPECT_LT((UprightPose(StoredPose(pose, orientation), orientation).Matrix() - pose.Matrix()).norm(), 1e-12);
    // Up in the upright picture is what the stored one's orientation says.
    EXPECT_LT((upright_pose.R().transpose() * UpInCamera(1) - pose.R().transpose() * UpInCamera(orientation)).norm(),
              1e-12);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d x = random.InBox(0.5);
      const Eigen::Vector2d at = *stored.Project(pose * x), upright = *camera.Project(upright_pose * x);
      const Eigen::Vector2d turned = orientation == 6   ? Eigen::Vector2d(48 - at.y(), at.x())
                                     : orientation == 8 ? Eigen::Vector2d(at.y(), 64 - at.x())
                                     : orientation == 3 ? Eigen::Vector2d(64 - at.x(), 48 - at.y())
                                                        : at;
      EXPECT_LT((upright - turned).norm(), 1e-9) << orientation;
    }
  }
}

// All portrait, half of them, held either way round: where the scene's up is does not change.
TEST(Orientation, PortraitPhotosLeaveTheScenesUpWhereItIs) {
  constexpr int kViews = 24;
  for (const bool all : {true, false}) {
    Scene scene;
    scene.cameras.push_back(test::TestCamera());
    for (int i = 0; i < kViews; ++i) {
      View v;
      v.name = "photo" + std::to_string(100 + i) + ".jpg";
      v.camera = {0};
      const double turn = 0.04 * i;  // a short walk
      v.orientation = !all && i % 2 == 0 ? 1 : i % 9 == 0 ? 8 : i % 7 == 0 ? 3 : 6;
      v.cam_from_world =
          StoredPose(LookAt({4 * std::cos(turn), 4 * std::sin(turn), 1.5}, {0, 0, 0}, {0, 0, 1}), v.orientation);
      scene.views.push_back(v);
    }
    UpdateFrameOfReference(scene);
    EXPECT_LT(AngleBetween(scene.up, Eigen::Vector3d::UnitZ()) * kDegPerRad, 1) << all;
    for (View& view : scene.views) view.orientation = 1;  // as if nothing was said
    UpdateFrameOfReference(scene);
    EXPECT_GT(AngleBetween(scene.up, Eigen::Vector3d::UnitZ()) * kDegPerRad, 5) << all;
  }
}

}  // namespace
}  // namespace lumi
