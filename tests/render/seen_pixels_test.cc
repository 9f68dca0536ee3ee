#include "render/holdout/seen_pixels.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "scene/geometry/mesh.h"

namespace lumi {
namespace {

// Cameras side by side on the x axis look along z at a wall in the plane z = 4. The picture's width is its focal
// length, so that each sees a strip of the wall that is 4 wide, and the view in the middle sees x from -2 to 2: every
// edge in these tests lies on a pixel's border of it, or its pixel is worked out.
constexpr double kWall = 4;

Mesh Strip(double left, double right, double z) {
  Mesh m;
  m.vertices = {{left, -9, z}, {right, -9, z}, {right, 9, z}, {left, 9, z}};
  m.faces = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

Scene CamerasAt(const std::vector<double>& x, int width, int height) {
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(width, height, width, width, 0.5 * width, 0.5 * height));
  for (const double c : x) {
    View v;
    v.camera = {0};
    v.name = "photo" + std::to_string(scene.views.size());
    v.cam_from_world.translation = {-c, 0, 0};
    scene.views.push_back(v);
  }
  // Some frame: the pixels do not depend on it.
  scene.normalized_from_world = {0.3, Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5), {0.1, -0.7, 0.2}};
  return scene;
}

// The columns from..to-1 that are set in every row of the middle view's mask, as text: "16-48 56-64".
std::string Columns(const Scene& scene, const Mesh& proxy, const std::vector<bool>& use = {}, bool occlusion = true) {
  PictureWorld world = *WorldOf(scene, proxy);
  world.occlusion = occlusion;
  const RenderView middle = MakeRenderView(scene.cameras[0], Rigid3());
  const Image8 mask = SeenPixels(world).Mask(middle, use);
  std::string text;
  for (int x = 0, from = -1; x <= mask.width; ++x) {
    const bool set = x < mask.width && mask.At(x, 0, 0) == 255;
    for (int y = 0; x < mask.width && y < mask.height; ++y)
      EXPECT_EQ(mask.At(x, y, 0), set ? 255 : 0) << "column " << x << ", row " << y;
    if (set && from < 0) from = x;
    if (!set && from >= 0) {
      text += (text.empty() ? "" : " ") + std::to_string(from) + "-" + std::to_string(x);
      from = -1;
    }
  }
  return text;
}

TEST(SeenPixels, AreThoseInTheFieldsOfViewOfTwoPhotos) {
  const Mesh wall = Strip(-20, 20, kWall);
  EXPECT_EQ(Columns(CamerasAt({1}, 64, 48), wall), "") << "one photo sees half of them, and one is not enough";
  EXPECT_EQ(Columns(CamerasAt({-1, 1}, 64, 48), wall), "16-48");
  EXPECT_EQ(Columns(CamerasAt({1, 1}, 64, 48), wall), "16-64");
  EXPECT_EQ(Columns(CamerasAt({-1, 1, 2}, 64, 48), wall), "16-64") << "-1 and 1 see the middle, 1 and 2 the right";
  EXPECT_EQ(Columns(CamerasAt({-3, 3}, 64, 48), wall), "") << "they share no point of the wall";
  EXPECT_EQ(Columns(CamerasAt({}, 64, 48), wall), "");
}

TEST(SeenPixels, CountThePhotosInUseAndTheProxyAlone) {
  const Mesh wall = Strip(-20, 1, kWall);  // its right end at column 48
  const Scene scene = CamerasAt({-1, 0, 1, 2}, 64, 48);
  EXPECT_EQ(Columns(scene, wall), "0-48");
  EXPECT_EQ(Columns(scene, wall, {true, false, true, false}), "16-48");
  EXPECT_EQ(Columns(scene, wall, {false, false, true, true}), "32-48");
  EXPECT_EQ(Columns(scene, Strip(30, 40, kWall)), "") << "no ray meets the proxy";
}

// A post from x = 0.5 to 1 at half the wall's distance: columns 48 to 64 of the middle view. A camera at c does not see
// the wall from 1 - c to 2 - c.
TEST(SeenPixels, AreNotHiddenFromTwoPhotos) {
  Mesh proxy = Strip(-20, 20, kWall);
  Append(proxy, Strip(0.5, 1, kWall / 2));
  // From 1 the wall's columns 32 to 48 are hidden; the camera at -1 does not see the post.
  EXPECT_EQ(Columns(CamerasAt({-1, 1}, 64, 48), proxy), "16-32");
  EXPECT_EQ(Columns(CamerasAt({-1, 1}, 64, 48), proxy, {}, false), "16-48") << "in a world where nothing hides";
  // From 0.5 the columns 40 to 56 are hidden, and the post is seen from 0.5 and 1.
  EXPECT_EQ(Columns(CamerasAt({-1, 0.5, 1}, 64, 48), proxy), "8-40 48-64");
}

// A surface before the wall, from x = 0.5 on. It hides the wall's x >= 0.5 (column 400) from the camera at 0.5, and the
// view passes its edge a little farther right: within the feather of visibility's depth that is no occlusion, beyond it
// is. On the surface the camera at -0.5 sees as far as column 640 - 320 / z.
TEST(SeenPixels, AreHiddenByWhatStandsFartherBeforeThemThanVisibilitysFeather) {
  const auto behind = [](double z) {
    Mesh proxy = Strip(-20, 20, kWall);
    Append(proxy, Strip(0.5, 20, z));
    return Columns(CamerasAt({-0.5, 0.5}, 640, 2), proxy);
  };
  EXPECT_EQ(behind(kWall / 1.039), "80-557");
  EXPECT_EQ(behind(kWall / 1.0526), "80-400 404-556");
}

TEST(SeenPixels, AShareIsOfAllPixels) {
  Image8 mask(8, 4, 1);
  EXPECT_EQ(ShareOf(mask), 0);
  for (int x = 0; x < 8; ++x) mask.At(x, 1, 0) = 255;
  EXPECT_EQ(ShareOf(mask), 0.25);
  EXPECT_EQ(ShareOf({}), 0);
}

}  // namespace
}  // namespace lumi
