#include "render/radiance/weights.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "capture.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/kernel.h"
#include "scene/geometry/angle.h"

namespace lumi {
namespace {

// The same formulas in double, written down from the paper: the oracle of the float kernel.
struct Oracle {
  std::vector<double> h, f;
  std::vector<double> weight;
};

Oracle Evaluate(const Sources& sources, const RenderView& desired, const Eigen::Vector3d& point,
                const RadianceSettings& s) {
  Oracle o;
  for (const RenderView& v : sources.views) {
    const double theta = AngleBetween(Eigen::Vector3d(desired.centre - point), Eigen::Vector3d(v.centre - point));
    const auto px = Project(v.P, point);
    double f = 0;
    if (px) {
      const double edge =
          std::min(std::min(px->x(), v.size_px.x() - px->x()), std::min(px->y(), v.size_px.y() - px->y()));
      const double x = std::clamp(edge / (s.fov_feather * v.size_px.minCoeff()), 0.0, 1.0);
      f = 0.5 - 0.5 * std::cos(3.14159265358979323846 * x);
    }
    o.f.push_back(f);
    o.h.push_back(f > 0 ? theta * (1 + s.gamma * (1 / f - 1)) : std::numeric_limits<double>::infinity());
  }
  std::vector<std::size_t> order(o.h.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return o.h[a] < o.h[b]; });
  o.weight.assign(o.h.size(), 0.0);
  const auto k = static_cast<std::size_t>(s.k);
  const double edge = k < order.size() ? o.h[order[k]] : std::numeric_limits<double>::infinity();
  double sum = 0;
  for (std::size_t i = 0; i < std::min(k, order.size()); ++i) {
    const double hi = o.h[order[i]];
    if (!std::isfinite(hi)) break;
    o.weight[order[i]] = 1 / hi - 1 / edge;
    sum += o.weight[order[i]];
  }
  for (double& w : o.weight) w = sum > 0 ? w / sum : 0;
  return o;
}

std::vector<double> Dense(const RayWeights& r, std::size_t n) {
  std::vector<double> w(n, 0.0);
  for (int i = 0; i < r.count; ++i)
    w[static_cast<std::size_t>(r.camera[static_cast<std::size_t>(i)])] = r.weight[static_cast<std::size_t>(i)];
  return w;
}

TEST(Kernel, AtanAndRaisedCosineAreAccurateToFloat) {
  std::mt19937 engine(1);
  std::uniform_real_distribution<float> u(-4, 4);
  for (int i = 0; i < 200000; ++i) {
    const float y = std::abs(u(engine)), x = u(engine);
    const double truth = std::atan2(static_cast<double>(y), static_cast<double>(x));
    ASSERT_NEAR(AtanPositive(y, x), truth, 4e-7) << y << " " << x;  // pi in float alone is off by 9e-8
    const float s = 0.125F * std::abs(x) * 2;
    ASSERT_NEAR(RaisedCosine(s), 0.5 - 0.5 * std::cos(3.14159265358979 * std::min(1.0F, s)), 3e-7);
  }
  for (float a = 1e-1F; a > 1e-30F; a *= 0.1F) EXPECT_NEAR(AtanPositive(a, 1.0F) / std::atan(a), 1.0F, 3e-7F);
  EXPECT_EQ(AtanPositive(0.0F, 1.0F), 0.0F);
  EXPECT_EQ(RaisedCosine(0.0F), 0.0F);
  EXPECT_NEAR(RaisedCosine(1.0F), 1.0F, 2e-7F);
  EXPECT_NEAR(RaisedCosine(1e-6F) / 2.4674011e-12F, 1, 1e-5);
}

TEST(Weights, AgreeWithTheFormulasInDouble) {
  const test::Capture c = test::MakeCapture(20, 48);
  const Sources sources = MakeSources(c.scene);
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> u(-1, 1);
  WeighScratch scratch;
  double worst = 0;
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Rigid3 pose = LookAt({3 * u(engine), u(engine), -4.5 + u(engine)}, {u(engine), u(engine), 1}, {0, -1, 0});
    const RenderView world = MakeRenderView(c.scene.cameras[0], pose);
    RadianceSettings settings;
    settings.k = 1 + i % 6;
    settings.gamma = i % 3;
    const ViewSetup setup = MakeViewSetup(sources, world, settings);
    const Eigen::Vector3d ray =
        (setup.ray_from_pixel * Eigen::Vector3d(24 + 20 * u(engine), 18 + 15 * u(engine), 1)).normalized();
    const Eigen::Vector3f d = ray.cast<float>();
    float t;
    tracer.Trace(setup.desired.centre.cast<float>(), {&d, 1}, {&t, 1});
    if (!std::isfinite(t)) continue;
    const Eigen::Vector3d point = setup.desired.centre + static_cast<double>(t) * d.cast<double>();
    const Oracle o = Evaluate(sources, setup.desired, point, settings);
    const RayWeights r = Weigh({setup.sources, nullptr, settings}, {d, t}, scratch);
    const std::vector<double> w = Dense(r, sources.views.size());
    for (std::size_t j = 0; j < w.size(); ++j) worst = std::max(worst, std::abs(w[j] - o.weight[j]));
    ++hits;
    EXPECT_NEAR(r.alpha, std::min(1.0, *std::max_element(o.f.begin(), o.f.end()) / kAlphaFullAt), 1e-3);
  }
  EXPECT_GT(hits, 2000);
  // Float: angles good to 2e-7, the window's difference of two nearly equal terms loses up to two digits more; f near a
  // photo's border enters as 1/f, with f's own float error.
  EXPECT_LT(worst, 2e-3);
}

TEST(Weights, SumToOneAndStayWithinZeroAndOne) {
  const test::Capture c = test::MakeCapture(9, 40);
  const Sources sources = MakeSources(c.scene);
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  WeighScratch scratch;
  FramePlan plan;
  for (const int k : {0, 1, 2, 4, 8, 16}) {
    RadianceSettings settings;
    settings.k = k;
    const ViewSetup setup = MakeViewSetup(
        sources, MakeRenderView(c.scene.cameras[0], LookAt({1, 0.4, -4}, {0, 0, 0}, {0, -1, 0})), settings);
    PlanPixels(setup, tracer, nullptr, {0, 0, 40, 30}, plan, scratch);
    for (std::size_t s = 0; s < plan.alpha.size(); ++s) {
      double sum = 0;
      for (std::size_t i = 0; i < static_cast<std::size_t>(plan.k); ++i) {
        const float w = plan.weight[s * static_cast<std::size_t>(plan.k) + i];
        ASSERT_GE(w, 0);
        ASSERT_LE(w, 1);
        sum += w;
      }
      ASSERT_NEAR(sum, plan.alpha[s] > 0 ? 1 : 0, 1e-5);
    }
  }
}

TEST(Weights, ALeftOutCameraCountsForNothing) {
  const test::Capture c = test::MakeCapture(6, 40);
  const Sources sources = MakeSources(c.scene);
  const ViewSetup setup =
      MakeViewSetup(sources, MakeRenderView(c.scene, c.scene.views[2]), {}, {true, true, false, true, true, true});
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  FramePlan plan;
  WeighScratch scratch;
  PlanPixels(setup, tracer, nullptr, {0, 0, 40, 30}, plan, scratch);
  for (const auto camera : plan.camera) ASSERT_NE(camera, 2);
}

TEST(Weights, WhereNoCameraSeesThePointThereIsAHole) {
  const test::Capture c = test::MakeCapture(3, 40);
  const Sources sources = MakeSources(c.scene);
  // The far corner of the wall lies outside every photo.
  const ViewSetup setup =
      MakeViewSetup(sources, MakeRenderView(c.scene.cameras[0], LookAt({7, 7, 1}, {7.5, 7.5, 3}, {0, -1, 0})), {});
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  FramePlan plan;
  WeighScratch scratch;
  PlanPixels(setup, tracer, nullptr, {0, 0, 40, 30}, plan, scratch);
  EXPECT_EQ(*std::max_element(plan.alpha.begin(), plan.alpha.end()), 0.0F);
}

TEST(Settings, BadOnesAreNamed) {
  RadianceSettings s;
  EXPECT_EQ(Validate(s), "");
  s.k = 17;
  EXPECT_NE(Validate(s).find("--k"), std::string::npos);
  s = {};
  s.gamma = -1;
  EXPECT_NE(Validate(s).find("--gamma"), std::string::npos);
  s = {};
  s.fov_feather = 0;
  EXPECT_NE(Validate(s).find("--fov-feather"), std::string::npos);
}

}  // namespace
}  // namespace lumi
