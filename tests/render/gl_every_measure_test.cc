// Every measure of the list in the blend shader, per pixel and over candidates, against its record evaluated in double.
#include <gtest/gtest.h>

#include "every_measure.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

// Drivers' logarithms are good to 1e-5; windowed weights amplify near a tie.
constexpr double kTolerance = 1e-3;
constexpr double kClearOfBorders = 0.02;
// Rasterisers place a mesh's corners to 1/256 of a pixel: over one pixel in 256 the depth of this floor, seen obliquely
// in a picture of 40x30, changes by up to so much of itself. Weights are compared at the depth that was drawn.
constexpr double kDepthTolerance = 1e-3;

using GlEveryMeasure = test::GlTest;

TEST_F(GlEveryMeasure, WeighsAsItIsDefined) {
  test::World world = test::MakeWorld(11, 100);
  for (std::size_t i = 0; i < world.scene.views.size(); ++i)
    if (i != 4) world.scene.views[i].time_s = 0.1 * static_cast<double>((i * 5) % 11);
  test::GiveGrids(world.scene, 4);
  Load(std::move(world));
  const Sources& sources = lumigraph_->sources();
  const ProxyTracer tracer(world_.proxy, sources.normalized_from_world);
  ForEachTerm([&]<typename M> {
    for (const bool cells : {false, true}) {
      int compared = 0, elsewhere = 0;
      for (const Resolution stretch : {Resolution::kDistance, Resolution::kJacobian}) {
        RenderRequest request;
        request.view = test::ArcView(0.9, 40, 30, 33, 0.8);
        request.settings = test::OnlyWith<M>(0.33);
        if (request.settings.resolution != Resolution::kOff) request.settings.resolution = stretch;
        if (cells) request.settings.grid_columns = request.settings.grid_rows = 9;
        const RadianceSettings& s = request.settings;
        const ViewSetup setup = MakeViewSetup(sources, request.view, s);
        const std::vector<ImageF> pictures = WeightPictures(request);
        for (int y = 0; y < 30; y += 2)
          for (int x = 0; x < 40; x += 2) {
            const float alpha = pictures[0].At(x, y, 3);
            const Eigen::Vector3d ray = (setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized();
            const std::vector<Eigen::Vector3f> direction{ray.cast<float>()};
            std::vector<Eigen::Vector3f> normal(1);
            std::vector<float> t(1);
            tracer.Trace(setup.desired.centre.cast<float>(), direction, t, normal);
            if (!(alpha > 0.99F) || !std::isfinite(t[0])) continue;
            const Eigen::Vector3d through = setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
            const double drawn = static_cast<double>(lumigraph_->ReadDepth(*target_, x, y)) * through.norm();
            // At the box's outline the rasteriser may be on its other side.
            if (std::abs(drawn - static_cast<double>(t[0])) > kDepthTolerance * drawn) {
              ++elsewhere;
              continue;
            }
            const auto photos =
                test::Define<M>(sources, setup, setup.desired.centre + drawn * ray, normal[0].cast<double>());
            const std::vector<double> wanted = test::DefinedWeights(photos, s.k);
            if (wanted.empty() || std::any_of(photos.begin(), photos.end(),
                                              [](const auto& p) { return p.f > 0 && p.f < kClearOfBorders; }))
              continue;
            double worst = 0;
            for (std::size_t j = 0; j < photos.size(); ++j)
              worst = std::max(
                  worst,
                  std::abs(static_cast<double>(pictures[j / 3].At(x, y, static_cast<int>(j % 3)) / alpha) - wanted[j]));
            // A cell's samples may have left out a photo.
            if (cells && worst > kTolerance) continue;
            ASSERT_LT(worst, kTolerance) << M::kName << " pixel " << x << " " << y;
            ++compared;
          }
      }
      EXPECT_LT(elsewhere, 10) << M::kName;
      EXPECT_GT(compared, 100) << M::kName << (cells ? " over candidates" : "");
    }
  });
}

}  // namespace
}  // namespace lumi
