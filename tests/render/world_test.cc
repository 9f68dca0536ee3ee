// Renderers blend worlds: what they entered last, and nothing of those before.
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>

#include "capture.h"
#include "render/world/renderer.h"

namespace lumi {
namespace {

Mesh DistantWall() {
  Mesh m;
  m.vertices = {{-8, -8, 2}, {8, -8, 2}, {8, 8, 2}, {-8, 8, 2}};
  m.faces = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

RenderRequest BesideView(const test::Capture& c, std::size_t view, bool visibility) {
  RenderRequest r;
  r.view = MakeRenderView(c.scene, c.scene.views[view]);
  r.view.P.col(3) += r.view.P.leftCols<3>() * Eigen::Vector3d(0.05, 0, 0);  // beside the photo's camera
  r.view.centre -= Eigen::Vector3d(0.05, 0, 0);
  r.settings.visibility = visibility;
  return r;
}

TEST(WorldRenderer, EntersAnotherWorldAsIfItWereMadeForIt) {
  const test::Capture c = test::MakeCapture(7, 48);
  for (const bool visibility : {false, true})
    for (const bool sparse : {false, true}) {
      RenderRequest request = BesideView(c, 3, visibility);
      if (sparse) request.settings.grid_columns = request.settings.grid_rows = 9;
      const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
      const ImageF first = renderer->Render(request);
      renderer->Enter(WorldOf(c.scene, DistantWall()));
      EXPECT_EQ(renderer->Render(request).data,
                MakeCpuRenderer(WorldOf(c.scene, DistantWall()), c.photos)->Render(request).data);
      renderer->Enter(WorldOf(c.scene, c.proxy));
      EXPECT_EQ(renderer->Render(request).data, first.data);
    }
}

TEST(WorldRenderer, FalseColoursAreThoseOfTheWorldsPhotos) {
  const test::Capture c = test::MakeCapture(5, 48);
  PictureWorld world = *WorldOf(c.scene, c.proxy);
  RenderRequest request;
  request.view = MakeRenderView(c.scene, c.scene.views[2]);
  request.show = Show::kFalseColor;
  request.settings.k = 1;
  for (std::int32_t& view : world.photos) view += 5;
  const auto renderer = MakeCpuRenderer(std::make_shared<const PictureWorld>(world), c.photos);
  const ImageF image = renderer->Render(request);
  const Eigen::Vector3f wanted = SourceColor(7);
  for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(image.At(24, 18, channel), wanted[channel], 1e-5);
}

TEST(WorldRenderer, AWorldThatLeavesPhotosOutIsThePictureWithoutThem) {
  const test::Capture c = test::MakeCapture(5, 48);
  PictureWorld world = *WorldOf(c.scene, c.proxy);
  world.use = {true, true, false, true, true};
  RenderRequest request = BesideView(c, 2, false);
  const ImageF image = MakeCpuRenderer(std::make_shared<const PictureWorld>(world), c.photos)->Render(request);
  request.use = world.use;
  EXPECT_EQ(image.data, MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos)->Render(request).data);
}

TEST(WorldRenderer, RefusesAWorldOfAnotherNumberOfCameras) {
  const test::Capture c = test::MakeCapture(5, 48), other = test::MakeCapture(4, 48);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  EXPECT_THROW(renderer->Enter(WorldOf(other.scene, other.proxy)), std::invalid_argument);
}

}  // namespace
}  // namespace lumi
