// Sparse samples that stand for a weight at every pixel along a path, as near as is asked.
#include "render/tradeoff/fidelity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "capture.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/sweep.h"
#include "render/world/renderer.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

FrontPoint SparsePoint(Method method, int grid, double ms, double db, int k = 4) {
  FrontPoint p;
  p.settings = WithMethod({}, method, grid);
  p.settings.k = k;
  p.name = PointName(p.settings, {});
  p.ms = ms;
  p.psnr_holdout_db = db;
  return p;
}

std::vector<std::string> Names(const std::vector<FrontPoint>& table) {
  std::vector<std::string> names;
  for (const FrontPoint& p : table) names.push_back(p.name);
  return names;
}

// A renderer whose sparse pictures are off by so many code values, and which counts.
class OffBy final : public Renderer {
 public:
  explicit OffBy(std::function<float(const RadianceSettings&)> code_values) : code_values_(std::move(code_values)) {}
  ImageF Render(const RenderRequest& request) override {
    ++rendered;
    ImageF image(8, 6, 4, 0.5F);
    if (!request.settings.Sparse()) return image;
    for (float& value : image.data) value += code_values_(request.settings) / 255;
    return image;
  }
  std::string Device() const override { return "none"; }
  int rendered = 0;

 private:
  std::function<float(const RadianceSettings&)> code_values_;
};

std::vector<RenderRequest> ThreeRequests() {
  std::vector<RenderRequest> requests(3);
  for (RenderRequest& r : requests) r.view.size_px = {8, 6};
  return requests;
}

TEST(Fidelity, AsksTheMiddlesOfThreeParts) {
  EXPECT_THAT(FidelityFrames(180), ElementsAre(30, 90, 150));
  EXPECT_THAT(FidelityFrames(2), ElementsAre(0, 1));
  EXPECT_THAT(FidelityFrames(1), ElementsAre(0));
}

TEST(Fidelity, TriesCandidatesOnFinerAndFinerGrids) {
  EXPECT_THAT(Names(FidelityTable({}, {}, {})),
              ElementsAre("candidates 25x25, k 4", "candidates 50x50, k 4", "candidates 100x100, k 4"));
  RadianceSettings all;
  all.k = 0;
  EXPECT_TRUE(FidelityTable(all, {}, {}).empty()) << "of all photos there is nothing to choose";
}

TEST(Fidelity, AsksTheFrontFirstFromTheFastestThatNobodyTellsFromItsBest) {
  const std::vector<FrontPoint> front = {
      SparsePoint(Method::kInterpolated, 8, 5, 24), SparsePoint(Method::kCandidates, 16, 20, 26.95, 3),
      SparsePoint(Method::kCandidates, 32, 30, 27, 5), SparsePoint(Method::kPixel, 0, 90, 27.1),
      SparsePoint(Method::kOptimumGrid, 64, 200, 28)};
  EXPECT_THAT(Names(FidelityTable({}, front, {})),
              ElementsAre("candidates 16x16, k 3", "candidates 32x32, k 5", "candidates 25x25, k 4",
                          "candidates 50x50, k 4", "candidates 100x100, k 4"));
  // What the user decided stays.
  RadianceSettings five;
  five.k = 5;
  EXPECT_EQ(Names(FidelityTable(five, front, {{"k", "5"}})).front(), "candidates 32x32, k 5");
}

TEST(Fidelity, TakesTheFirstThatIsNearEnoughAtEveryFrame) {
  // 1 code value: 48.1 dB; 4: 36.1 dB.
  OffBy renderer([](const RadianceSettings& s) { return s.grid_columns < 50 ? 4.0F : 1.0F; });
  const FidelityChoice c = ChooseFaithful(renderer, ThreeRequests(), {}, FidelityTable({}, {}, {}), 40);
  EXPECT_EQ(c.name, "candidates 50x50, k 4");
  EXPECT_EQ(c.settings.grid_columns, 50);
  ASSERT_TRUE(c.db);
  EXPECT_NEAR(*c.db, 48.13, 0.01);
  ASSERT_EQ(c.tried.size(), 2U);
  EXPECT_NEAR(c.tried[0].db.value_or(0), 36.09, 0.01);
  EXPECT_EQ(renderer.rendered, 9) << "a weight at every pixel once, then two settings";
  EXPECT_THAT(Describe(c), HasSubstr("48.1 dB from it at worst"));
}

TEST(Fidelity, KeepsAWeightAtEveryPixelWhereNothingSparseIsNearEnoughOrCanBeDrawn) {
  OffBy far([](const RadianceSettings&) { return 10.0F; });
  const FidelityChoice c = ChooseFaithful(far, ThreeRequests(), {}, FidelityTable({}, {}, {}), 40);
  EXPECT_FALSE(c.db);
  EXPECT_FALSE(c.settings.Sparse());
  EXPECT_THAT(c.why, HasSubstr("no sparse samples come within 40 dB of it (candidates 25x25, k 4: 28.1 dB)"));
  OffBy cannot([](const RadianceSettings&) -> float { throw UsageError("no such effect on sparse samples"); });
  const FidelityChoice refused = ChooseFaithful(cannot, ThreeRequests(), {}, FidelityTable({}, {}, {}), 40);
  EXPECT_FALSE(refused.settings.Sparse());
  EXPECT_THAT(refused.why, HasSubstr("no such effect on sparse samples"));
  EXPECT_EQ(refused.tried.size(), 3U);
}

TEST(Fidelity, HoldsForARealSceneAtOtherFrames) {
  const test::Capture capture = test::MakeCapture(9, 160);
  const auto renderer = MakeCpuRenderer(WorldOf(capture.scene, capture.proxy), capture.photos);
  const auto at = [&](double dx) {
    RenderRequest r;
    r.view = MakeRenderView(capture.scene.cameras[0], LookAt({0.4 + dx, -0.3, -3.2}, {0, 0, 0.5}, {0, -1, 0}));
    return r;
  };
  const FidelityChoice c = ChooseFaithful(*renderer, {at(-0.2), at(0), at(0.2)}, {}, FidelityTable({}, {}, {}), 40);
  ASSERT_TRUE(c.db) << c.why;
  for (const double dx : {-0.15, 0.1}) {
    RenderRequest sparse = at(dx), pixel = at(dx);
    sparse.settings = c.settings;
    EXPECT_GE(ErrorBetween(renderer->Render(sparse), renderer->Render(pixel)).psnr_db, 40);
  }
}

}  // namespace
}  // namespace lumi
