// Properties of Table 3.2 that the weights promise, per pixel: epipole consistency, radiance consistency, continuity across
// occlusion edges.
#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "capture.h"
#include "render/radiance/frame_plan.h"
#include "render/visibility_maps.h"

namespace lumi {
namespace {

std::vector<double> Dense(const RayWeights& r, std::size_t n) {
  std::vector<double> w(n, 0.0);
  for (int i = 0; i < r.count; ++i) w[static_cast<std::size_t>(r.camera[static_cast<std::size_t>(i)])] = r.weight[static_cast<std::size_t>(i)];
  return w;
}

TEST(EpipoleConsistency, APhotosOwnViewGivesItAtLeast99PercentWhereverItSeesTheProxy) {
  const test::Capture c = test::MakeCapture(12, 64);
  const Sources sources = MakeSources(c.scene);
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  const VisibilityMaps maps = MakeVisibilityMaps(sources, tracer);
  double least = 1;
  for (const int k : {1, 4, 16}) {
    RadianceSettings settings;
    settings.k = k;
    for (std::size_t v = 0; v < c.scene.views.size(); ++v) {
      FramePlan plan;
      WeighScratch scratch;
      PlanPixels(MakeViewSetup(sources, MakeRenderView(c.scene, c.scene.views[v]), settings), tracer, &maps, {0, 0, 64, 48}, plan, scratch);
      for (std::size_t s = 0; s < plan.alpha.size(); ++s) {
        if (!(plan.alpha[s] > 0)) continue;
        double own = 0;
        for (std::size_t i = 0; i < static_cast<std::size_t>(plan.k); ++i)
          if (plan.camera[s * static_cast<std::size_t>(plan.k) + i] == static_cast<int>(v)) own = plan.weight[s * static_cast<std::size_t>(plan.k) + i];
        least = std::min(least, own);
      }
    }
  }
  RecordProperty("least_own_weight", std::to_string(least));
  EXPECT_GE(least, 0.99);
}

TEST(RadianceConsistency, OneRayFromTwoViewpointsOnItHasTheSameWeights) {
  const test::Capture c = test::MakeCapture(30, 48);
  const Sources sources = MakeSources(c.scene);
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  const VisibilityMaps maps = MakeVisibilityMaps(sources, tracer);
  std::mt19937 engine(9);
  std::uniform_real_distribution<double> u(-1, 1);
  WeighScratch scratch;
  RadianceSettings settings;
  double worst = 0;
  int rays = 0;
  const Similarity3 world = c.scene.normalized_from_world.Inverse();
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d eye(3 * u(engine), u(engine), -4.5 + u(engine)), target(0.6 * u(engine), 0.6 * u(engine), 1 + u(engine));
    const ViewSetup one = MakeViewSetup(sources, MakeRenderView(c.scene.cameras[0], LookAt(eye, target, {0, -1, 0})), settings);
    // The ray and its lengths are such that float holds them exactly: one ray, not two that differ by a rounding.
    const Eigen::Vector3f ray = (c.scene.normalized_from_world * target - one.desired.centre).normalized().cast<float>();
    float t = 0;
    tracer.Trace(one.desired.centre.cast<float>(), {&ray, 1}, {&t, 1});
    if (!std::isfinite(t)) continue;
    const double grid = std::exp2(-18), far = std::floor(static_cast<double>(t) / grid) * grid, apart = std::floor(0.5 * far / grid) * grid;
    // Half way to the scene, and turned by something.
    const Eigen::Vector3d nearer = world * (one.desired.centre + apart * ray.cast<double>().normalized());
    const ViewSetup two = MakeViewSetup(sources, MakeRenderView(c.scene.cameras[0], LookAt(nearer, target + Eigen::Vector3d(0.2, 0.1, 0), {0.1, -1, 0})), settings);
    const auto a = Dense(Weigh(one.sources, &maps, ray, static_cast<float>(far), settings, scratch), 30);
    const auto b = Dense(Weigh(two.sources, &maps, ray, static_cast<float>(far - apart), settings, scratch), 30);
    for (std::size_t j = 0; j < 30; ++j) worst = std::max(worst, std::abs(a[j] - b[j]));
    ++rays;
  }
  EXPECT_GT(rays, 1500);
  RecordProperty("largest_difference", std::to_string(worst));
  EXPECT_LT(worst, 1e-6);
}

// Along tiny steps on the proxy, across the edges of what stands before it in the photos.
TEST(Continuity, HoldsAcrossOcclusionEdgesWithEveryMeasureOn) {
  test::Capture c = test::MakeCapture(24, 64);
  for (std::size_t i = 0; i < c.scene.views.size(); ++i) {
    c.scene.views[i].time_s = 0.05 * static_cast<double>(i % 7);
    if (i % 3 == 0) c.scene.views[i].cam_from_world = LookAt(1.8 * c.scene.views[i].CentreInWorld(), {0, 0, 0.5}, {0, -1, 0});
  }
  const Sources sources = MakeSources(c.scene);
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  const VisibilityMaps maps = MakeVisibilityMaps(sources, tracer);
  RadianceSettings settings;
  settings.resolution = Resolution::kJacobian;
  settings.time = true;
  settings.time_s = 0.11;
  settings.time_window_s = 0.3;
  const Eigen::Vector3d eye(0.31, 0.17, -4.2);
  const ViewSetup setup = MakeViewSetup(sources, MakeRenderView(c.scene.cameras[0], LookAt(eye, {0, 0, 0}, {0, -1, 0})), settings);
  WeighScratch scratch;
  std::vector<double> largest;
  for (const double step : {1e-2, 1e-3, 1e-4}) {
    double change = 0, least_visible = 1;
    std::vector<double> before;
    Measures m;
    for (int i = 0; i < 1000; ++i) {
      // On the wall, from behind the box's silhouette outwards; steps in units of the scene's size.
      const double s = std::min(1.0, i * step) - 0.5;
      const Eigen::Vector3d p = c.scene.normalized_from_world * Eigen::Vector3d(1.4 + 1.6 * s, 0.4 * s, 3);
      const Eigen::Vector3d ray = p - setup.desired.centre;
      const Eigen::Vector3f d = ray.normalized().cast<float>();
      const auto t = static_cast<float>(ray.norm());
      const RayWeights w = Weigh(setup.sources, &maps, d, t, settings, scratch, {0, 0, 1});
      std::vector<double> now = Dense(w, 24);
      for (double& x : now) x *= w.alpha;
      if (!before.empty())
        for (std::size_t j = 0; j < now.size(); ++j) change = std::max(change, std::abs(now[j] - before[j]));
      before = now;
      EvaluateMeasures(setup.sources, settings, d, t, {0, 0, 1}, m);
      EvaluateVisibility(setup.sources, &maps, d, t, m);
      for (std::size_t j = 0; j < 24; ++j) least_visible = std::min(least_visible, static_cast<double>(m.v[j]));
    }
    if (step == 1e-2) {
      EXPECT_LT(least_visible, 0.01) << "no occlusion edge was crossed";
    }
    largest.push_back(change);
    RecordProperty("largest_change_at_step_" + std::to_string(step), std::to_string(change));
  }
  EXPECT_LT(largest[1], 0.3 * largest[0]);
  EXPECT_LT(largest[2], 0.3 * largest[1]);
  std::cout << "largest change of a weight at steps 1e-2, 1e-3, 1e-4: " << largest[0] << " " << largest[1] << " " << largest[2] << "; ratios "
            << largest[0] / largest[1] << " " << largest[1] / largest[2] << "\n";
}

}  // namespace
}  // namespace lumi
