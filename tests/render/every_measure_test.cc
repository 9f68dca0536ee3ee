// Every measure of the list, in every path of the CPU, against its record evaluated in double: a new one that a path
// forgot fails here.
#include "every_measure.h"

#include <gtest/gtest.h>

#include "capture.h"
#include "optimum_oracle.h"
#include "render/cpu/candidate_blend.h"
#include "render/radiance/optimum/optimum.h"
#include "render/radiance/setting_options.h"
#include "render/radiance/sparse/candidate_plan.h"
#include "render/show/measure_map.h"
#include "render/world/visibility_maps.h"
#include "sparse_test_scene.h"

namespace lumi {
namespace {

// Floats on the one side, and windowed weights amplify near a tie.
constexpr double kWeightTolerance = 3e-4;
// Where a photo ends, h grows with 1/f, and f with the square of the distance to the border.
constexpr double kClearOfBorders = 0.02;

class EveryMeasure : public testing::Test {
 protected:
  // Photos from distances, with focal lengths and at times of their own.
  EveryMeasure() : capture_(test::MakeCapture(9, 64)) {
    const Camera first = capture_.scene.cameras[0];
    for (const double focal : {0.6, 1.5})
      capture_.scene.cameras.push_back(Camera::Pinhole(64, 48, focal * 64, focal * 64, 32, 24));
    for (int i = 0; i < 9; ++i) {
      lumi::View& v = capture_.scene.views[static_cast<std::size_t>(i)];
      v.camera = {i % 3};
      const Eigen::Vector3d at(0, 0, 0.5), eye = at + (0.6 + 0.2 * ((i * 4) % 5)) * (v.CentreInWorld() - at);
      v.cam_from_world = LookAt(eye, at, {0, -1, 0});
      if (i != 4) v.time_s = 0.1 * ((i * 5) % 9);
    }
    UpdateFrameOfReference(capture_.scene);
    test::GiveGrids(capture_.scene, 3);
    sources_ = MakeSources(capture_.scene);
    tracer_.emplace(capture_.proxy, capture_.scene.normalized_from_world);
  }

  RenderView Seen(double dx) const {
    return MakeRenderView(capture_.scene.cameras[0], LookAt({0.4 + dx, -0.3, -3.2}, {0, 0, 0.5}, {0, -1, 0}));
  }

  // check(setup, ray, photos as they are defined), at rays that are clear of borders.
  template <Term M, typename Check>
  void ForRays(RadianceSettings s, Check check) {
    for (const Resolution stretch : {Resolution::kDistance, Resolution::kJacobian}) {
      if (M::On(s) && s.resolution != Resolution::kOff) s.resolution = stretch;
      const ViewSetup setup = MakeViewSetup(sources_, Seen(0), s);
      RaySamples rays;
      for (int y = 2; y < 48; y += 5)
        for (int x = 2; x < 64; x += 5)
          rays.direction.push_back(
              (setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>());
      rays.t.resize(rays.size());
      rays.normal.resize(rays.size());
      tracer_->Trace(setup.desired.centre.cast<float>(), rays.direction, rays.t, rays.normal);
      check(setup, rays);
    }
  }
  template <Term M>
  std::vector<test::DefinedPhoto> DefineAt(const ViewSetup& setup, const RaySamples& rays, std::size_t i) const {
    const Eigen::Vector3d p = setup.desired.centre + static_cast<double>(rays.t[i]) * rays.direction[i].cast<double>();
    return test::Define<M>(sources_, setup, p, rays.normal[i].cast<double>());
  }
  static bool Clear(const std::vector<test::DefinedPhoto>& photos) {
    return std::all_of(photos.begin(), photos.end(), [](const auto& p) { return p.f == 0 || p.f > kClearOfBorders; });
  }

  test::Capture capture_;
  Sources sources_;
  std::optional<ProxyTracer> tracer_;
};

TEST_F(EveryMeasure, HasItsDefinedValueAndWeightsAtAPixel) {
  ForEachTerm([&]<typename M> {
    int compared = 0;
    ForRays<M>(test::OnlyWith<M>(0.33), [&](const ViewSetup& setup, const RaySamples& rays) {
      WeighScratch scratch;
      Measures m;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!std::isfinite(rays.t[i])) continue;
        const auto photos = DefineAt<M>(setup, rays, i);
        const std::vector<double> wanted = test::DefinedWeights(photos, setup.settings.k);
        if (wanted.empty() || !Clear(photos)) continue;
        EvaluateMeasures(setup.sources, setup.settings, rays.direction[i], rays.t[i], rays.normal[i], m);
        for (std::size_t j = 0; j < photos.size(); ++j)
          if (photos[j].f > 0) {
            ASSERT_NEAR(static_cast<double>(m.Of<M>()[j]), photos[j].value, 2e-4 * std::max(1.0, photos[j].value))
                << M::kName << " photo " << j;
          }
        const RayWeights w =
            Weigh({setup.sources, nullptr, setup.settings}, {rays.direction[i], rays.t[i], rays.normal[i]}, scratch);
        std::vector<double> got(photos.size(), 0.0);
        for (std::size_t e = 0; e < static_cast<std::size_t>(w.count); ++e)
          got[static_cast<std::size_t>(w.camera[e])] = static_cast<double>(w.weight[e]);
        for (std::size_t j = 0; j < photos.size(); ++j)
          ASSERT_NEAR(got[j], wanted[j], kWeightTolerance) << M::kName << " photo " << j;
        ++compared;
      }
    });
    EXPECT_GT(compared, 60) << M::kName;
  });
}

TEST_F(EveryMeasure, WeighsCandidatesAsItIsDefined) {
  ForEachTerm([&]<typename M> {
    RadianceSettings s = test::OnlyWith<M>(0.33);
    s.grid_columns = s.grid_rows = 5;
    int compared = 0;
    for (const Resolution stretch : {Resolution::kDistance, Resolution::kJacobian}) {
      if (s.resolution != Resolution::kOff) s.resolution = stretch;
      const RenderView view = Seen(0);
      const ViewSetup setup = MakeViewSetup(sources_, view, s);
      const SparseProxy sparse(capture_.proxy, capture_.scene.normalized_from_world);
      CandidatePlan plan;
      PlanCandidates(setup, sparse, *tracer_, nullptr, test::InTurn, plan);
      // Every photo a candidate: what a cell's samples leave out is no part of this.
      plan.camera.clear();
      for (std::size_t cell = 0; cell + 1 < plan.first.size(); ++cell) {
        plan.first[cell] = static_cast<std::int32_t>(plan.camera.size());
        for (std::int32_t j = 0; j < 9; ++j) plan.camera.push_back(j);
      }
      plan.first.back() = static_cast<std::int32_t>(plan.camera.size());
      std::vector<ImageF> pictures;
      for (int first = 0; first < 9; first += 3) {
        std::vector<Eigen::Vector3f> colors(9, Eigen::Vector3f::Zero());
        for (int i = 0; i < 3; ++i) colors[static_cast<std::size_t>(first + i)][i] = 1;
        BlendSources blend;
        blend.colors = &colors;
        pictures.emplace_back(view.size_px.x(), view.size_px.y(), 4);
        BlendCandidates(plan, setup, *tracer_, nullptr, blend, pictures.back());
      }
      for (int y = 2; y < 48; y += 5)
        for (int x = 2; x < 64; x += 5) {
          const float alpha = pictures[0].At(x, y, 3);
          RaySamples ray;
          ray.direction = {(setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>()};
          ray.t.resize(1);
          ray.normal.resize(1);
          tracer_->Trace(setup.desired.centre.cast<float>(), ray.direction, ray.t, ray.normal);
          if (!(alpha > 0.99F) || !std::isfinite(ray.t[0])) continue;
          const auto photos = DefineAt<M>(setup, ray, 0);
          const std::vector<double> wanted = test::DefinedWeights(photos, s.k);
          if (wanted.empty() || !Clear(photos)) continue;
          for (std::size_t j = 0; j < 9; ++j)
            ASSERT_NEAR(static_cast<double>(pictures[j / 3].At(x, y, static_cast<int>(j % 3)) / alpha), wanted[j], 2e-3)
                << M::kName << " photo " << j << " pixel " << x << " " << y;
          ++compared;
        }
    }
    EXPECT_GT(compared, 60) << M::kName;
  });
}

TEST_F(EveryMeasure, EntersTheOptimumAsItIsDefined) {
  ForEachTerm([&]<typename M> {
    RadianceSettings s = test::OnlyWith<M>(0.33);
    s.similarity = Similarity::kFull;
    s.correlation = Correlation::kFallingLeaves;
    s.cutoff_rad = std::numbers::pi;
    const test::OracleLeaves<double> leaves(s.r_min_rad, s.r_max_rad);
    int compared = 0;
    double with = 0;
    ForRays<M>(s, [&](const ViewSetup& setup, const RaySamples& rays) {
      WeightTable table, without;
      OptimumCounts counts;
      WeighOptimal(setup, nullptr, rays, table, counts);
      ViewSetup off = setup;
      M::Switch(off.settings, false);
      WeighOptimal(off, nullptr, rays, without, counts);
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!std::isfinite(rays.t[i]) || !(table.alpha[i] > 0)) continue;
        const auto oracle = test::OracleOptimum<double>(setup, nullptr, rays.direction[i], rays.t[i], leaves, 0,
                                                        nullptr, rays.normal[i]);
        ASSERT_LT(test::LargestError(table, i, oracle), 2e-3) << M::kName;
        with = std::max(with, test::LargestError(without, i, oracle));
        ++compared;
      }
    });
    EXPECT_GT(compared, 60) << M::kName;
    EXPECT_GT(with, 0.02) << M::kName << " changes nothing";
  });
}

TEST_F(EveryMeasure, HasAHeatMapOfItsValue) {
  ForEachTerm([&]<typename M> {
    RenderRequest request;
    request.view = Seen(0);
    request.settings = test::OnlyWith<M>(0.33);
    const auto measure = MeasureFromName(M::kName);
    ASSERT_TRUE(measure) << M::kName;
    const MeasureMap map = RenderMeasureMap(capture_.scene, capture_.proxy, request, *measure, 0);
    EXPECT_EQ(map.unit, M::kHeatMapUnit);
    // The colour scale's green rises all the way: pixels are in the order of their values.
    const ViewSetup setup = MakeViewSetup(sources_, request.view, request.settings);
    std::vector<std::pair<double, float>> value_and_green;
    for (int y = 2; y < 48; y += 5)
      for (int x = 2; x < 64; x += 5) {
        RaySamples ray;
        ray.direction = {(setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>()};
        ray.t.resize(1);
        ray.normal.resize(1);
        tracer_->Trace(setup.desired.centre.cast<float>(), ray.direction, ray.t, ray.normal);
        if (!(map.image.At(x, y, 3) > 0) || !std::isfinite(ray.t[0])) continue;
        const test::DefinedPhoto photo = DefineAt<M>(setup, ray, 0)[0];
        if (photo.f > kClearOfBorders) value_and_green.emplace_back(photo.value, map.image.At(x, y, 1));
      }
    EXPECT_GT(value_and_green.size(), 20U) << M::kName;
    for (const auto& [value, green] : value_and_green)
      for (const auto& [other, other_green] : value_and_green)
        if (value > other + 0.05) {
          ASSERT_GE(green, other_green) << M::kName << " " << value << " " << other;
        }
  });
}

TEST(EveryEffect, IsSwitchedByItsOptionAlone) {
  ForEachEffect([&]<typename M> {
    const SettingOption* option = FindSettingOption(M::kName);
    ASSERT_TRUE(option) << M::kName;
    EXPECT_TRUE(option->is_switch);
    for (const bool on : {true, false}) {
      RadianceSettings s;
      M::Switch(s, on);
      EXPECT_EQ(M::On(s), on) << M::kName;
      RadianceSettings by_option;
      option->set(by_option, option->get(s));
      EXPECT_EQ(by_option, s) << M::kName;
      int others = 0;
      ForEachEffect([&]<typename Other> {
        if (Other::kName != M::kName && Other::On(s) != Other::On(RadianceSettings())) ++others;
      });
      EXPECT_EQ(others, 0) << M::kName;
    }
  });
}

}  // namespace
}  // namespace lumi
