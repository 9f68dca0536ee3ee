// The weights next to their degenerate neighbours: no NaN, weights in [0,1] with sum 1 or alpha 0, and the limits that
// the formulas promise.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include "capture.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/weights.h"

namespace lumi {
namespace {

// Cameras at given centres that all see the origin from the -z side, wide enough to see everything near it.
Sources CamerasAt(const std::vector<Eigen::Vector3d>& centres) {
  Sources s;
  const Camera camera = Camera::Pinhole(1000, 1000, 300, 300, 500, 500);
  for (const auto& c : centres) s.views.push_back(MakeRenderView(camera, LookAt(c, {0, 0, 0}, {0, -1, 0})));
  return s;
}

RenderView DesiredAt(const Eigen::Vector3d& centre) {
  return MakeRenderView(Camera::Pinhole(1000, 1000, 300, 300, 500, 500), LookAt(centre, {0, 0, 0}, {0, -1, 0}));
}

// `hole`: no camera may see the point, which then has alpha 0.
void ExpectConvex(const RayWeights& r, bool hole = false) {
  if (hole && r.alpha == 0) return;
  ASSERT_GT(r.alpha, 0);
  float sum = 0;
  ASSERT_GT(r.count, 0);
  for (int i = 0; i < r.count; ++i) {
    const float w = r.weight[static_cast<std::size_t>(i)];
    ASSERT_TRUE(std::isfinite(w));
    ASSERT_GE(w, 0);
    ASSERT_LE(w, 1.0F + 1e-6F);
    sum += w;
  }
  ASSERT_NEAR(sum, 1, 1e-5);
}

// The ray from `eye` to the origin.
RayWeights AtOrigin(const Sources& s, const Eigen::Vector3d& eye, int k) {
  RadianceSettings settings;
  settings.k = k;
  WeighScratch scratch;
  const RelativeSources r = MakeRelative(s, DesiredAt(eye), {}, settings.fov_feather);
  return Weigh(r, nullptr, (-eye.normalized()).cast<float>(), static_cast<float>(eye.norm()), settings, scratch);
}

double WeightOf(const RayWeights& r, int camera) {
  for (int i = 0; i < r.count; ++i)
    if (r.camera[static_cast<std::size_t>(i)] == camera) return r.weight[static_cast<std::size_t>(i)];
  return 0;
}

TEST(HardCase, RayThroughACameraCentreIsApproachedInProportion) {
  const Sources s = CamerasAt({{0, 0, -4}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}, {0, -1.3, -4}, {1, 1, -4}});
  for (double a = 1e-1; a >= 1e-15; a /= 10) {
    const RayWeights r = AtOrigin(s, {3 * std::sin(a), 0, -3 * std::cos(a)}, 4);
    ExpectConvex(r);
    // The others together weigh about 3 a / 0.25: they vanish in proportion to the angle.
    EXPECT_GT(WeightOf(r, 0), 1 - 15 * a) << a;
  }
  EXPECT_EQ(WeightOf(AtOrigin(s, {0, 0, -3}, 4), 0), 1);
}

TEST(HardCase, CamerasBehindTheDesiredOneCount) {
  // The ray extended backwards passes through camera 0: it sees the same radiance.
  const Sources s = CamerasAt({{0, 0, -9}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}});
  EXPECT_EQ(WeightOf(AtOrigin(s, {0, 0, -3}, 2), 0), 1);
}

TEST(HardCase, ACameraBeyondTheProxyPointDoesNot) {
  // p lies between the two cameras: the angle there is pi.
  const Sources s = CamerasAt({{0, 0, 5}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}});
  EXPECT_EQ(WeightOf(AtOrigin(s, {0, 0, -3}, 2), 0), 0);
}

TEST(HardCase, TiesShare) {
  std::vector<Eigen::Vector3d> ring;
  for (int i = 0; i < 8; ++i) ring.emplace_back(std::cos(i * 0.785398163397448), std::sin(i * 0.785398163397448), -4);
  const Sources s = CamerasAt(ring);
  for (int k = 1; k <= 8; ++k) {
    const RayWeights r = AtOrigin(s, {0, 0, -3}, k);
    ExpectConvex(r);
    EXPECT_EQ(r.alpha, 1);
  }
  for (double step = 1e-2; step >= 1e-15; step /= 10) ExpectConvex(AtOrigin(s, {step, 0.5 * step, -3}, 4));
}

TEST(HardCase, FewerThanKPlusOneCamerasAndOneCamera) {
  const Sources three = CamerasAt({{0.2, 0, -4}, {1, 0, -4}, {0, 1.2, -4}});
  for (int k = 3; k <= 16; ++k) {
    const RayWeights r = AtOrigin(three, {0, 0, -3}, k);
    ExpectConvex(r);
    EXPECT_EQ(r.count, 3);   // no k+1st: the window's edge is at infinity
  }
  EXPECT_EQ(WeightOf(AtOrigin(CamerasAt({{1, 0, -4}}), {0, 0, -3}, 4), 0), 1);
  EXPECT_EQ(AtOrigin(CamerasAt({}), {0, 0, -3}, 4).alpha, 0);
}

TEST(HardCase, DuplicatesShareEqually) {
  const Sources s = CamerasAt({{0, 0, -4}, {0, 0, -4}, {0, 0, -4}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}});
  const RayWeights r = AtOrigin(s, {0, 0, -3}, 4);
  for (int j = 0; j < 3; ++j) EXPECT_NEAR(WeightOf(r, j), 1.0 / 3, 1e-6);
  const RayWeights off = AtOrigin(s, {0.3, 0.2, -3}, 4);
  EXPECT_EQ(WeightOf(off, 0), WeightOf(off, 1));
  EXPECT_EQ(WeightOf(off, 1), WeightOf(off, 2));
}

TEST(HardCase, AThousandCamerasWithinAMillionth) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> u(-1e-6, 1e-6);
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < 1000; ++i) centres.emplace_back(u(engine), u(engine), -4 + u(engine));
  const Sources s = CamerasAt(centres);
  for (const double offset : {0.0, 1e-9, 1e-7, 1e-6, 1e-3, 0.5})
    for (const int k : {1, 4, 16}) ExpectConvex(AtOrigin(s, {offset, 0, -3}, k));
}

TEST(HardCase, ACameraOnTheProxyAndADesiredOneTouchingIt) {
  const Sources s = CamerasAt({{0, 0, -1e-12}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}, {0.4, 0.1, -4}});
  ExpectConvex(AtOrigin(s, {0, 0, -3}, 3));
  for (double d = 1e-1; d >= 1e-30; d /= 100) ExpectConvex(AtOrigin(s, {0, 0, -d}, 3));
}

TEST(HardCase, AVeryFarProxyPointMakesAllRaysAgree) {
  const Sources s = CamerasAt({{0, 0, -4}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}, {0, -1.3, -4}});
  RadianceSettings settings;
  WeighScratch scratch;
  const RelativeSources r = MakeRelative(s, DesiredAt({0.1, 0.1, -3}), {}, settings.fov_feather);
  for (float t = 1; t < 1e30F; t *= 100) ExpectConvex(Weigh(r, nullptr, Eigen::Vector3f(0, 0, 1), t, settings, scratch));
}

TEST(HardCase, TheWorldsScaleAndOffsetDoNotMatterAfterNormalisation) {
  test::Capture c = test::MakeCapture(9, 24);
  const RadianceSettings settings;
  const RenderView world = MakeRenderView(c.scene.cameras[0], LookAt({0.7, 0.3, -4}, {0, 0, 0}, {0, -1, 0}));
  const auto plan_of = [&](const test::Capture& capture, const RenderView& view) {
    FramePlan plan;
    WeighScratch scratch;
    PlanPixels(MakeViewSetup(MakeSources(capture.scene), view, settings), ProxyTracer(capture.proxy, capture.scene.normalized_from_world), nullptr,
               {0, 0, 24, 18}, plan, scratch);
    return plan;
  };
  const FramePlan reference = plan_of(c, world);
  struct Case { double scale, offset, tolerance; };
  // 1e7 scene sizes away double holds 1e-9 of the scene: angles move by that, times the window's amplification.
  for (const Case& k : {Case{1e-6, 0, 1e-4}, Case{1e6, 0, 1e-4}, Case{1, 1e4, 1e-3}, Case{1, 1e7, 2e-2}}) {
    test::Capture moved = c;
    const Similarity3 s{k.scale, Eigen::Quaterniond::Identity(), {k.offset, -k.offset, k.offset}};
    Transform(moved.scene, s);
    for (auto& v : moved.proxy.vertices) v = s * v;
    const FramePlan plan = plan_of(moved, MakeRenderView(c.scene.cameras[0], TransformPose(LookAt({0.7, 0.3, -4}, {0, 0, 0}, {0, -1, 0}), s)));
    int different = 0;
    for (std::size_t i = 0; i < plan.weight.size(); ++i) {
      ASSERT_TRUE(std::isfinite(plan.weight[i]));
      if (plan.camera[i] != reference.camera[i] || std::abs(plan.weight[i] - reference.weight[i]) > k.tolerance) ++different;
    }
    // Silhouette pixels may hit the other surface.
    EXPECT_LT(different, 0.01 * static_cast<double>(plan.weight.size())) << k.scale << " " << k.offset;
  }
}

// Along tiny steps the largest change of a weight falls in proportion to the step.
TEST(HardCase, WeightsAreContinuousAcrossKPlusOneSwitchesAndPhotoBorders) {
  std::mt19937 engine(8);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < 40; ++i) centres.emplace_back(2.5 * u(engine), 2.5 * u(engine), -4 + u(engine));
  Sources s = CamerasAt(centres);
  // Narrow photos: their borders lie across the path of the proxy point.
  const Camera narrow = Camera::Pinhole(200, 200, 300, 300, 100, 100);
  for (std::size_t i = 0; i < s.views.size(); i += 2)
    s.views[i] = MakeRenderView(narrow, LookAt(centres[i], {0.8 * u(engine), 0.8 * u(engine), 0}, {0, -1, 0}));
  RadianceSettings settings;
  settings.k = 4;
  WeighScratch scratch;
  const RelativeSources r = MakeRelative(s, DesiredAt({0.31, 0.17, -3}), {}, settings.fov_feather);
  std::vector<double> largest;
  for (const double step : {1e-2, 1e-3, 1e-4}) {
    double change = 0;
    std::vector<double> before;
    for (int i = 0; i < 1000; ++i) {
      const double at = -0.5 + (i * step < 1 ? i * step : 1);
      const Eigen::Vector3d p(at, 0.21 * at + 0.1, 0);
      const Eigen::Vector3d ray = p - Eigen::Vector3d(0.31, 0.17, -3);
      const RayWeights w = Weigh(r, nullptr, ray.normalized().cast<float>(), static_cast<float>(ray.norm()), settings, scratch);
      ExpectConvex(w);
      std::vector<double> now(s.views.size(), 0.0);
      for (int c = 0; c < w.count; ++c) now[static_cast<std::size_t>(w.camera[static_cast<std::size_t>(c)])] = w.weight[static_cast<std::size_t>(c)] * w.alpha;
      if (!before.empty())
        for (std::size_t j = 0; j < now.size(); ++j) change = std::max(change, std::abs(now[j] - before[j]));
      before = now;
    }
    largest.push_back(change);
    RecordProperty("largest_change_at_step_" + std::to_string(step), std::to_string(change));
  }
  std::cout << "largest change of a weight at steps 1e-2, 1e-3, 1e-4: " << largest[0] << " " << largest[1] << " " << largest[2] << "; ratios "
            << largest[0] / largest[1] << " " << largest[1] / largest[2] << "\n";
  EXPECT_LT(largest[1], 0.3 * largest[0]);
  EXPECT_LT(largest[2], 0.3 * largest[1]);
}

}  // namespace
}  // namespace lumi
