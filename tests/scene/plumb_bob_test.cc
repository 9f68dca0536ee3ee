#include <gtest/gtest.h>

#include "scene/model/camera.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace {

Camera Mild() {
  return {CameraModel::kPlumbBob, 640, 480, {612.3, 620.3, 331.7, 232.1, 2.4, -0.21, 0.06, 1e-3, -7e-4, 0.01}};
}
// A wide lens as real boards gave it: its polynomial folds inside the photo, and grows again, mirrored, far outside.
Camera Wide() {
  return {CameraModel::kPlumbBob,
          1280,
          960,
          {562.63, 563.59, 650.14, 500.3, 0.68, -0.24465, 0.07502, -1.6e-4, 4.7e-4, -0.01163}};
}

Eigen::Vector2d PixelOf(const Camera& camera, const Eigen::Vector2d& x) { return *camera.Project(x.homogeneous()); }

TEST(PlumbBob, UnprojectUndoesProject) {
  for (const Camera& camera : {Mild(), Wide()})
    for (double x = -0.6; x <= 0.6; x += 0.1)
      for (double y = -0.5; y <= 0.5; y += 0.1) {
        const auto back = camera.Normalized(PixelOf(camera, {x, y}));
        ASSERT_TRUE(back);
        // Newton's last step is below 1e-12.
        EXPECT_LT((*back - Eigen::Vector2d(x, y)).norm(), 1e-11);
      }
}

TEST(PlumbBob, SkewMovesAPixelByItsHeightOnly) {
  Camera camera = Mild(), straight = Mild();
  straight.params[4] = 0;
  const Eigen::Vector2d x(0.3, -0.2), shift = PixelOf(camera, x) - PixelOf(straight, x);
  EXPECT_EQ(shift.y(), 0);
  EXPECT_NEAR(
      shift.x(),
      camera.Get(CameraTerm::kSkew) * (PixelOf(camera, x).y() - camera.PrincipalPointPx().y()) / camera.FocalPx().y(),
      1e-12);
}

TEST(PlumbBob, ScaledItSeesTheSameRays) {
  const Camera half = Mild().Scaled(320, 240);
  EXPECT_LT((PixelOf(half, {0.2, 0.1}) - 0.5 * PixelOf(Mild(), {0.2, 0.1})).norm(), 1e-12);
}

// The same of COLMAP's models: 1 - 0.25 r^2 folds at r = 1.15 and is negative, the image mirrored, from r = 2 on.
TEST(PlumbBob, BeyondTheFoldAPhotosCameraHasNoRayEither) {
  const Camera camera{CameraModel::kRadial, 1280, 960, {500, 640, 480, -0.25, 0}};
  for (int y = 0; y <= camera.height_px; y += 4)
    for (int x = 0; x <= camera.width_px; x += 4)
      if (const auto ray = camera.Normalized({x + 0.0, y + 0.0})) {
        ASSERT_LT(ray->norm(), 1.16) << x << " " << y;
        ASSERT_GE(ray->dot(Eigen::Vector2d(x, y) - camera.PrincipalPointPx()), 0) << x << " " << y;
      }
}

// Every answer lies on the pixel's own side, within the fold (r = 1.72 here); beyond the fold there is none.
TEST(PlumbBob, BeyondTheFoldThereIsNoRay) {
  const Camera camera = Wide();
  const Eigen::Vector2d c = camera.PrincipalPointPx();
  int without = 0;
  for (int y = 0; y <= camera.height_px; y += 8)
    for (int x = 0; x <= camera.width_px; x += 8) {
      const auto ray = camera.Normalized({x + 0.0, y + 0.0});
      if (!ray) {
        ++without;
        continue;
      }
      EXPECT_LT(ray->norm(), 1.8) << x << " " << y;
      EXPECT_GT(ray->dot(Eigen::Vector2d(x, y) - c), -1) << x << " " << y;
    }
  EXPECT_GT(without, 100);
  const Camera pinhole = PinholeInside(camera);
  EXPECT_NEAR(pinhole.FocalPx().x() / camera.FocalPx().x(), 0.9, 0.1);
}

}  // namespace
}  // namespace lumi
