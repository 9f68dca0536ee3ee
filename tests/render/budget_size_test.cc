// A budget and a front that was measured at another size: it says less than a frame of this one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "render/tradeoff/budget.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"

namespace lumi {
namespace {

// Takes no time at all, whatever the pixels say.
class QuickRenderer : public Renderer {
 public:
  ImageF Render(const RenderRequest&) override {
    ++frames;
    return ImageF(4, 3, 4);
  }
  std::string Device() const override { return "quick"; }
  int frames = 0;
};

TEST(BudgetAtAnotherSize, RendersWhatTheFrontWouldChoose) {
  const TemporaryFolder scene;
  Mesh wall;
  wall.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  wall.faces = {{0, 1, 2}};
  WriteMesh(ProxyPath(scene.path(), "mesh"), wall);
  QuickRenderer renderer;
  StoredFront front;
  front.key = {"mesh", "cpu", renderer.Device(), 640, 480};
  front.proxy_fingerprint = Fingerprint(ProxyPath(scene.path(), "mesh"));
  for (const int k : {1, 2}) {
    FrontPoint point;
    point.name = "k " + std::to_string(k);
    point.settings.k = k;
    point.ms = k == 1 ? 5 : 20;
    point.psnr_holdout_db = 20 + k;
    front.points.push_back(point);
  }
  WriteFront(scene.path(), front);
  RenderRequest request;
  request.view.size_px = {1280, 960};
  // By the pixels they would take 20 and 80 ms.
  const BudgetChoice choice = ChooseForBudget(scene.path(), "cpu", "mesh", renderer, request, {}, 25);
  EXPECT_EQ(choice.settings.k, 2) << "the better one, which fits";
  EXPECT_TRUE(choice.fits);
  EXPECT_LT(choice.ms, 20);
  EXPECT_THAT(choice.why, testing::HasSubstr("2 of its settings rendered at this size"));
  EXPECT_EQ(renderer.frames, 4);
  // At the size that it was measured at the front is believed.
  request.view.size_px = {640, 480};
  EXPECT_EQ(ChooseForBudget(scene.path(), "cpu", "mesh", renderer, request, {}, 10).settings.k, 1);
  EXPECT_EQ(renderer.frames, 4);
}

}  // namespace
}  // namespace lumi
