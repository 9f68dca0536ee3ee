// The blend shader is the one other place where weights are computed: rays hold it to the radiance core.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "render/picture/convert.h"
#include "render/radiance/weights.h"
#include "render/world/visibility_maps.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

// Floats on both sides, other orders of summation; normalising the windowed weights near a tie amplifies.
constexpr float kWeightTolerance = 1e-4F;
// At a photo's very border f grows with the square of the distance to it, and h with 1/f: a float's rounding of that
// distance is amplified beyond the tolerance. Rays where such a camera counts are left to the tests of the pictures.
constexpr float kBorderF = 2e-3F;
constexpr float kBorderWeight = 1e-4F;

// Where a map's texels change from blocked to seen, v runs from 1/50 to 1 over a texel: pixel coordinates that differ
// by 1e-4 texels change 1/v by 5 %, and a weight by that times w (1 - w) <= 1/4.
constexpr float kBlockedTolerance = 1.25e-2F;

// Drivers' logarithms are good to 1e-5.
constexpr float kMeasureTolerance = 2e-4F;
// Where a photo sees the proxy nearly edge-on, its Jacobian is a small difference of large numbers.
constexpr float kJacobianTolerance = 5e-3F;

using GlWeights = test::GlTest;

TEST_F(GlWeights, EqualTheCoresAtRandomRays) {
  Load(test::MakeWorld(11, 100));
  std::mt19937_64 random(20020501);
  std::uniform_real_distribution<double> uniform(0, 1);
  const Sources& sources = lumigraph_->sources();
  const VisibilityMaps maps = MakeVisibilityMaps(sources, ProxyTracer(world_.proxy, sources.normalized_from_world));
  WeighScratch scratch;
  int rays = 0, blended = 0, left_out = 0;
  float worst = 0;
  for (int frame = 0; frame < 24; ++frame) {
    RenderRequest request;
    request.view = test::ArcView(3.2 * uniform(random) - 0.4, 40, 30, 15 + 60 * uniform(random), 0.5 + uniform(random));
    request.settings.k = std::array{1, 2, 4, 7, 0}[static_cast<std::size_t>(frame % 5)];
    request.settings.gamma = std::array{1.0, 0.0, 3.0}[static_cast<std::size_t>(frame % 3)];
    request.settings.visibility = frame % 2 == 0;
    const VisibilityMaps* visibility = request.settings.visibility ? &maps : nullptr;
    request.settings.fov_feather = 0.02 + 0.3 * uniform(random);
    if (frame % 4 == 3) request.use = {true, true, false, true, false, true, true, true, true, false, true};
    const ViewSetup setup = MakeViewSetup(sources, request.view, request.settings, request.use);
    const std::vector<ImageF> pictures = WeightPictures(request);
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 40; ++x) {
        const float depth = lumigraph_->ReadDepth(*target_, x, y);
        const float alpha = pictures[0].At(x, y, 3);
        if (depth == 0) {
          ASSERT_EQ(alpha, 0);
          continue;
        }
        const Eigen::Vector3d ray = setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
        const Eigen::Vector3f direction = ray.normalized().cast<float>();
        const auto t = static_cast<float>(static_cast<double>(depth) * ray.norm());
        std::vector<float> wanted(world_.scene.views.size(), 0.0F);
        float wanted_alpha = 0;
        if (request.settings.k == 0) {
          wanted_alpha = WeighAll({setup.sources, visibility, request.settings}, {direction, t}, scratch, wanted);
        } else {
          const RayWeights w = Weigh({setup.sources, visibility, request.settings}, {direction, t}, scratch);
          wanted_alpha = w.alpha;
          for (std::size_t i = 0; i < static_cast<std::size_t>(w.count); ++i)
            wanted[static_cast<std::size_t>(w.camera[i])] = w.weight[i];
          blended += w.count > 1;
        }
        ++rays;
        ASSERT_NEAR(alpha, wanted_alpha, kWeightTolerance) << "frame " << frame << " pixel " << x << " " << y;
        if (alpha < 0.01F) continue;  // the division below would amplify alpha's own rounding
        bool border = false;
        for (std::size_t j = 0; j < wanted.size(); ++j)
          border |= scratch.f[j] < kBorderF &&
                    std::max(wanted[j], pictures[j / 3].At(x, y, static_cast<int>(j % 3))) > kBorderWeight;
        left_out += border;
        for (std::size_t j = 0; j < wanted.size(); ++j) {
          const float weight = pictures[j / 3].At(x, y, static_cast<int>(j % 3)) / alpha;
          if (border) break;
          worst = std::max(worst, std::abs(weight - wanted[j]));
          ASSERT_NEAR(weight, wanted[j], visibility ? kBlockedTolerance : kWeightTolerance)
              << "frame " << frame << " pixel " << x << " " << y << " camera " << j << " k " << request.settings.k;
        }
      }
  }
  EXPECT_GT(rays, 10000);
  EXPECT_GT(blended, 4000);
  EXPECT_LT(left_out, rays / 50);
  std::printf("  %d rays, %d blended, %d at borders left out, worst weight error %.1e\n", rays, blended, left_out,
              static_cast<double>(worst));
}

// Resolution, time, single terms of h, no field of view: each and together, at random settings.
TEST_F(GlWeights, EveryMeasureEqualsTheCores) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  test::World world = test::MakeWorld(11, 250);  // feathers of some pixels: coordinates are rounded
  for (std::size_t i = 0; i < world.scene.views.size(); ++i)
    if (i != 4) world.scene.views[i].time_s = 3600.0 + 0.11 * static_cast<double>(i * i);
  Load(std::move(world));
  const Sources& sources = lumigraph_->sources();
  const ProxyTracer tracer(world_.proxy, sources.normalized_from_world);
  const VisibilityMaps maps = MakeVisibilityMaps(sources, tracer);
  WeighScratch scratch;
  int rays = 0, left_out = 0;
  std::array<float, 3> worst{};
  for (int frame = 0; frame < 48; ++frame) {
    RenderRequest request;
    request.view = test::ArcView(3.2 * uniform(random) - 0.4, 40, 30, 15 + 60 * uniform(random), 0.5 + uniform(random));
    RadianceSettings& s = request.settings;
    s.k = std::array{2, 4, 7, 0}[static_cast<std::size_t>(frame % 4)];
    s.resolution =
        std::array{Resolution::kOff, Resolution::kDistance, Resolution::kJacobian}[static_cast<std::size_t>(frame % 3)];
    s.resolution_low = frame % 2 == 0 ? 0.0 : 0.1 + 0.5 * uniform(random);
    s.resolution_high = 1.2 + 3 * uniform(random);
    s.alpha = frame % 7 == 6 ? 0.0 : 0.2 + 2 * uniform(random);
    s.beta = 3 * uniform(random);
    s.epsilon = 3 * uniform(random);
    s.gamma = frame % 5 == 4 ? 0.0 : 2 * uniform(random);
    s.time = frame % 2 == 1;
    s.time_s = 3600 + 8 * uniform(random);
    s.time_window_s = 0.1 + 6 * uniform(random);
    s.period_s = frame % 4 == 1 ? 1 + 3 * uniform(random) : 0.0;
    s.field_of_view = frame % 5 != 2;
    s.visibility = frame % 6 < 2;
    if (frame % 8 >= 6) s.correlation = Correlation::kFallingLeaves;
    s.r_max_rad = (1 + 20 * uniform(random)) * kRadPerDeg;
    const VisibilityMaps* visibility = s.visibility ? &maps : nullptr;
    const ViewSetup setup = MakeViewSetup(sources, request.view, s, request.use);
    const std::vector<ImageF> pictures = WeightPictures(request);
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 40; ++x) {
        const float depth = lumigraph_->ReadDepth(*target_, x, y);
        if (depth == 0) continue;
        const Eigen::Vector3d ray = setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1);
        const Eigen::Vector3f direction = ray.normalized().cast<float>();
        const auto t = static_cast<float>(static_cast<double>(depth) * ray.norm());
        float hit = 0;
        Eigen::Vector3f normal;
        tracer.Trace(setup.desired.centre.cast<float>(), {&direction, 1}, {&hit, 1}, {&normal, 1});
        if (!(std::abs(hit - t) < 1e-4F * t)) continue;  // at an edge the two may see another face
        std::vector<float> wanted(world_.scene.views.size(), 0.0F);
        float wanted_alpha = 0;
        if (s.k == 0) {
          wanted_alpha = WeighAll({setup.sources, visibility, s}, {direction, t, normal}, scratch, wanted);
        } else {
          const RayWeights w = Weigh({setup.sources, visibility, s}, {direction, t, normal}, scratch);
          wanted_alpha = w.alpha;
          for (std::size_t i = 0; i < static_cast<std::size_t>(w.count); ++i)
            wanted[static_cast<std::size_t>(w.camera[i])] = w.weight[i];
        }
        const float alpha = pictures[0].At(x, y, 3);
        if (!s.field_of_view) {
          // What photos that end would have had is missing.
          wanted_alpha = 0;
          for (std::size_t j = 0; j < wanted.size(); ++j) {
            const Eigen::Vector3f p =
                t * direction - Eigen::Vector3f(setup.sources.dx[j], setup.sources.dy[j], setup.sources.dz[j]);
            Eigen::Matrix3f M;
            for (int i = 0; i < 9; ++i) M(i / 3, i % 3) = setup.sources.m[i][j];
            const Eigen::Vector3f q = M * p;
            const bool in = q.z() > 0 && q.x() >= 0 && q.y() >= 0 && q.x() <= q.z() * setup.sources.width_px[j] &&
                            q.y() <= q.z() * setup.sources.height_px[j];
            wanted[j] = in ? wanted[j] : 0.0F;
            wanted_alpha += wanted[j];
          }
        }
        ++rays;
        bool border = false;
        for (std::size_t j = 0; j < wanted.size(); ++j)
          border |= s.field_of_view && scratch.f[j] > 0 && scratch.f[j] < kBorderF &&
                    std::max(wanted[j], pictures[j / 3].At(x, y, static_cast<int>(j % 3))) > kBorderWeight;
        left_out += border;
        if (border) continue;
        const float tolerance = s.visibility                            ? kBlockedTolerance
                                : s.resolution == Resolution::kJacobian ? kJacobianTolerance
                                                                        : kMeasureTolerance;
        ASSERT_NEAR(alpha, wanted_alpha, tolerance) << "frame " << frame << " pixel " << x << " " << y;
        if (alpha < 0.01F) continue;
        for (std::size_t j = 0; j < wanted.size(); ++j) {
          const float weight = pictures[j / 3].At(x, y, static_cast<int>(j % 3)) / (s.field_of_view ? alpha : 1.0F);
          if (!s.visibility)
            worst[static_cast<std::size_t>(s.resolution)] =
                std::max(worst[static_cast<std::size_t>(s.resolution)], std::abs(weight - wanted[j]));
          ASSERT_NEAR(weight, wanted[j], tolerance) << "frame " << frame << " pixel " << x << " " << y << " camera "
                                                    << j << " k " << s.k << " resolution " << Name(s.resolution);
        }
      }
  }
  EXPECT_GT(rays, 15000);
  EXPECT_LT(left_out, rays / 50);
  std::printf("  %d rays, %d at borders left out, worst weight error %.1e, %.1e by distance, %.1e by Jacobian\n", rays,
              left_out, static_cast<double>(worst[0]), static_cast<double>(worst[1]), static_cast<double>(worst[2]));
}

// Lists of cameras a tile leave out only what cannot matter: not a bit of the picture changes.
TEST_F(GlWeights, TilesLeaveOutNoCameraThatMatters) {
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const auto& [views, arc] : {std::pair{40, 5.5}, {300, 3.0}, {5, 1.0}}) {
    Load(test::MakeWorld(views, 100, arc));
    for (int frame = 0; frame < 12; ++frame) {
      RenderRequest request;
      request.show = Show::kFalseColor;
      request.view = frame == 0 ? MakeRenderView(world_.scene, world_.scene.views[2])
                                : test::ArcView(6 * uniform(random), 131, 83, 20 + 200 * uniform(random),
                                                0.3 + 1.2 * uniform(random));
      request.settings.k = std::array{1, 4, 9, 16, 0}[static_cast<std::size_t>(frame % 5)];
      request.settings.gamma = std::array{1.0, 0.0, 4.0}[static_cast<std::size_t>(frame % 3)];
      const auto draw = [&](bool culling) {
        lumigraph_->SetCulling(culling);
        return Draw(request);
      };
      ASSERT_EQ(draw(true).data, draw(false).data) << views << " views, frame " << frame;
    }
  }
}

// A compute shader draws on graphics processors, a fragment shader elsewhere: in every way of weighing, in pictures
// that fill no group of its pixels, and strip by strip.
TEST_F(GlWeights, ComputedPicturesAreThoseThatAreDrawn) {
  constexpr float kRounding = 2e-5F;
  Load(test::Photographed(10, 160));
  struct Case {
    const char* name;
    void (*change)(RenderRequest&);
  };
  for (const Case& c :
       {Case{"as by default", [](RenderRequest&) {}}, Case{"k 1", [](RenderRequest& r) { r.settings.k = 1; }},
        Case{"all", [](RenderRequest& r) { r.settings.k = 0; }},
        Case{"false colours", [](RenderRequest& r) { r.show = Show::kFalseColor; }},
        Case{"no field of view", [](RenderRequest& r) { r.settings.field_of_view = false; }},
        Case{"resolution by Jacobian", [](RenderRequest& r) { r.settings.resolution = Resolution::kJacobian; }},
        Case{"falling leaves", [](RenderRequest& r) { r.settings.correlation = Correlation::kFallingLeaves; }},
        Case{"exposure", [](RenderRequest& r) { r.settings.exposure = true; }},
        Case{"no prefilter, no visibility",
             [](RenderRequest& r) { r.settings.prefilter = r.settings.visibility = false; }},
        Case{"tessellation",
             [](RenderRequest& r) {
               r.settings.grid_columns = r.settings.grid_rows = 9;
               r.settings.sampling = Sampling::kCandidates;
               r.show = Show::kTessellation;
             }},
        Case{"candidates", [](RenderRequest& r) {
               r.settings.grid_columns = r.settings.grid_rows = 9;
               r.settings.sampling = Sampling::kCandidates;
             }}}) {
    SCOPED_TRACE(c.name);
    RenderRequest request;
    request.view = test::ArcView(0.93, 203, 149, 210);
    c.change(request);
    lumigraph_->SetComputing(false);
    const ImageF drawn = Draw(request);
    lumigraph_->SetComputing(true);
    const ImageF computed = Draw(request);
    EXPECT_GT(Coverage(drawn), 0.2);
    lumigraph_->Begin(request, *target_);
    for (const auto& [first, last] : {std::pair{0, 37}, {37, 40}, {40, 149}}) lumigraph_->Blend(*target_, first, last);
    const ImageF strips = lumigraph_->ReadColor(*target_, request.view.size_px);
    for (std::size_t i = 0; i < drawn.data.size(); ++i) ASSERT_NEAR(drawn.data[i], computed.data[i], kRounding) << i;
    EXPECT_EQ(strips.data, computed.data);
    // Only the rows asked for: what was there before stays in the others.
    request.view = test::ArcView(0.5, 203, 149, 210);
    lumigraph_->Begin(request, *target_);
    lumigraph_->Blend(*target_, 50, 60);
    const ImageF part = lumigraph_->ReadColor(*target_, request.view.size_px);
    const auto row = [&](const ImageF& image, int y) {
      return std::vector(image.data.begin() + 4 * 203 * y, image.data.begin() + 4 * 203 * (y + 1));
    };
    EXPECT_EQ(row(part, 49), row(computed, 49));
    EXPECT_NE(row(part, 55), row(computed, 55));
    EXPECT_EQ(row(part, 60), row(computed, 60));
  }
}

// Two photos from one place share at their common epipole, and nobody else has a part.
TEST_F(GlWeights, CamerasAtOnePlaceShare) {
  test::World world = test::MakeWorld(11, 100);
  world.scene.views[4].cam_from_world = world.scene.views[3].cam_from_world;
  world.scene.views[4].camera = world.scene.views[3].camera;
  Load(std::move(world));
  RenderRequest request;
  request.view = MakeRenderView(world_.scene, world_.scene.views[3]);
  const std::vector<ImageF> pictures = WeightPictures(request);
  int seen = 0;
  for (int y = 0; y < request.view.size_px.y(); ++y)
    for (int x = 0; x < request.view.size_px.x(); ++x) {
      if (pictures[0].At(x, y, 3) == 0) continue;
      ++seen;
      ASSERT_NEAR(pictures[1].At(x, y, 0), 0.5F, kWeightTolerance) << x << " " << y;
      ASSERT_NEAR(pictures[1].At(x, y, 1), 0.5F, kWeightTolerance) << x << " " << y;
    }
  EXPECT_GT(seen, 1000);
}

}  // namespace
}  // namespace lumi
