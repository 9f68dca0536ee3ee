#include "scene/model/camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "random_scene.h"

namespace lumi {
namespace {

std::vector<Camera> Cameras() {
  return {{CameraModel::kSimplePinhole, 640, 480, {500, 320, 240}},
          {CameraModel::kPinhole, 640, 480, {500, 510, 320, 240}},
          {CameraModel::kSimpleRadial, 640, 480, {500, 320, 240, -0.15}},
          {CameraModel::kRadial, 640, 480, {500, 320, 240, -0.2, 0.05}},
          {CameraModel::kOpenCV, 640, 480, {500, 510, 320, 240, -0.25, 0.08, 0.001, -0.002}},
          {CameraModel::kOpenCVFisheye, 640, 480, {300, 300, 320, 240, 0.02, -0.01, 0.003, -0.001}},
          {CameraModel::kPlumbBob, 640, 480, {500, 510, 320, 240, 2.4, -0.25, 0.08, 0.001, -0.002, 0.01}}};
}

TEST(Camera, EveryModelHasACameraHere) {
  std::vector<bool> seen(kCameraModels.size(), false);
  for (const Camera& camera : Cameras()) {
    EXPECT_FALSE(Validate(camera)) << Name(camera.model);
    seen[static_cast<std::size_t>(&InfoOf(camera.model) - kCameraModels.data())] = true;
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), true), static_cast<long>(seen.size()));
}

TEST(Camera, NormalizedUndoesProjectOverTheWholeImage) {
  for (const Camera& camera : Cameras())
    for (double y = 0.5; y < 480; y += 47)
      for (double x = 0.5; x < 640; x += 53) {
        const auto u = camera.Normalized({x, y});
        ASSERT_TRUE(u) << Name(camera.model) << " at " << x << " " << y;
        const auto back = camera.Project(u->homogeneous());
        ASSERT_TRUE(back);
        EXPECT_LT((*back - Eigen::Vector2d(x, y)).norm(), 1e-7) << Name(camera.model);
      }
}

TEST(Camera, OpenCvDistortionFollowsItsFormula) {
  // Hand-computed: u = (0.3, -0.2), r2 = 0.13, radial = 1 - 0.25*0.13 + 0.08*0.0169 = 0.968852.
  const Camera camera = Cameras()[4];
  const auto x = camera.Project(Eigen::Vector3d(0.3, -0.2, 1));
  const double dx = 0.3 * 0.968852 + 2 * 0.001 * 0.3 * -0.2 + -0.002 * (0.13 + 2 * 0.09);
  const double dy = -0.2 * 0.968852 + 2 * -0.002 * 0.3 * -0.2 + 0.001 * (0.13 + 2 * 0.04);
  EXPECT_NEAR(x->x(), 500 * dx + 320, 1e-9);
  EXPECT_NEAR(x->y(), 510 * dy + 240, 1e-9);
}

TEST(Camera, BeyondTheFoldOfThePolynomialThereIsNoInverse) {
  // r (1 - 0.5 r^2) has its maximum 0.544 at r = 0.816: no ray has its image at 0.6.
  const Camera camera{CameraModel::kSimpleRadial, 1000, 1000, {500, 500, 500, -0.5}};
  EXPECT_TRUE(camera.Normalized({500 + 500 * 0.54, 500}));
  EXPECT_FALSE(camera.Normalized({500 + 500 * 0.6, 500}));
}

TEST(Camera, ScalingScalesPixels) {
  for (const Camera& camera : Cameras()) {
    const Camera half = camera.Scaled(320, 240);
    const Eigen::Vector3d x(0.2, 0.1, 1);
    EXPECT_LT((*half.Project(x) - 0.5 * *camera.Project(x)).norm(), 1e-9) << Name(camera.model);
  }
  // Another aspect: one focal length no longer serves.
  const Camera squeezed = Cameras()[2].Scaled(320, 480);
  EXPECT_EQ(squeezed.model, CameraModel::kOpenCV);
  const Eigen::Vector2d full = *Cameras()[2].Project(Eigen::Vector3d(0.2, 0.1, 1));
  EXPECT_LT((*squeezed.Project(Eigen::Vector3d(0.2, 0.1, 1)) - Eigen::Vector2d(0.5 * full.x(), full.y())).norm(), 1e-9);
}

TEST(Camera, ValidationRefusesWhatCannotBeACamera) {
  Camera c = Cameras()[1];
  EXPECT_FALSE(Validate(c));
  c.params[0] = -5;
  EXPECT_TRUE(Validate(c));
  c = Cameras()[1];
  c.params.pop_back();
  EXPECT_TRUE(Validate(c));
  c = Cameras()[1];
  c.width_px = 0;
  EXPECT_TRUE(Validate(c));
}

TEST(Camera, ModelNamesAreColmaps) {
  for (const Camera& camera : Cameras()) {
    // The one that is not COLMAP's is in none of its files.
    const auto known = camera.model == CameraModel::kPlumbBob ? std::nullopt : std::optional(camera.model);
    EXPECT_EQ(CameraModelFromName(Name(camera.model)), known);
    EXPECT_EQ(CameraModelFromId(static_cast<int>(camera.model)), known);
    EXPECT_EQ(ParameterCount(camera.model), static_cast<int>(camera.params.size()));
  }
  EXPECT_FALSE(CameraModelFromName("THIN_PRISM_FISHEYE"));
  EXPECT_FALSE(CameraModelFromId(10));
}

}  // namespace
}  // namespace lumi
