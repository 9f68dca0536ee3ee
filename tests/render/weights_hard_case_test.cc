// The weights next to their degenerate neighbours: no NaN, weights in [0,1] with sum 1 or alpha 0, and the limits that
// the formulas promise.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>
#include <string>

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
RayWeights AtOrigin(const Sources& s, const Eigen::Vector3d& eye, const RadianceSettings& settings) {
  WeighScratch scratch;
  const RelativeSources r = MakeRelative(s, DesiredAt(eye), {}, settings.fov_feather);
  return Weigh({r, nullptr, settings}, {(-eye.normalized()).cast<float>(), static_cast<float>(eye.norm())}, scratch);
}
RayWeights AtOrigin(const Sources& s, const Eigen::Vector3d& eye, int k) {
  RadianceSettings settings;
  settings.k = k;
  return AtOrigin(s, eye, settings);
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

// Twelve cameras on a circle whose points are whole numbers: one angle to the last bit. Four stand farther out.
TEST(HardCase, TheTiedShareAndNobodyElse) {
  std::vector<Eigen::Vector3d> centres;
  for (const auto& [x, y] : {std::pair(5, 0), {4, 3}, {3, 4}}) {
    for (int turn = 0; turn < 4; ++turn) {
      constexpr int kCos[] = {1, 0, -1, 0}, kSin[] = {0, 1, 0, -1};
      centres.emplace_back(kCos[turn] * x - kSin[turn] * y, kSin[turn] * x + kCos[turn] * y, -20);
    }
  }
  const std::size_t tied = centres.size();
  for (const auto& [x, y] : {std::pair(8, 0), {0, 8}, {-8, 0}, {0, -8}}) centres.emplace_back(x, y, -20);
  Sources s = CamerasAt(centres);
  for (std::size_t i = 0; i < centres.size(); ++i)
    s.views[i].centre = centres[i];  // as it was before it went through a pose
  for (const Correlation correlation : {Correlation::kInverse, Correlation::kFallingLeaves})
    for (int k = 1; k <= 16; ++k) {
      RadianceSettings settings;
      settings.k = k;
      settings.correlation = correlation;
      const auto of_tied = [&](const RayWeights& r) {
        double sum = 0;
        for (std::size_t j = 0; j < tied; ++j) sum += WeightOf(r, static_cast<int>(j));
        return sum;
      };
      const RayWeights r = AtOrigin(s, {0, 0, -10}, settings);
      ExpectConvex(r);
      EXPECT_EQ(r.alpha, 1);
      // Up to k = 12 none of the others is inside the window: k of the tied share equally, all of them where k allows.
      const int sharing = std::min<int>(k, static_cast<int>(tied));
      if (k <= static_cast<int>(tied)) {
        EXPECT_EQ(r.count, sharing);
        EXPECT_NEAR(of_tied(r), 1, 1e-6);
        for (int i = 0; i < r.count; ++i) EXPECT_NEAR(r.weight[static_cast<std::size_t>(i)], 1.0 / sharing, 1e-6) << k;
      } else {
        for (std::size_t j = 1; j < tied; ++j) EXPECT_EQ(WeightOf(r, static_cast<int>(j)), WeightOf(r, 0)) << k;
      }
      for (double step = 1e-2; step >= 1e-15; step /= 10)
        for (const Eigen::Vector3d& towards :
             {Eigen::Vector3d(1, 0.5, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, -1, 0)}) {
          const RayWeights near = AtOrigin(s, Eigen::Vector3d(0, 0, -10) + step * towards, settings);
          ExpectConvex(near);
          if (k < static_cast<int>(tied)) {
            EXPECT_NEAR(of_tied(near), 1, 1e-6) << k << " " << step;
          }
        }
    }
}

TEST(HardCase, FewerThanKPlusOneCamerasAndOneCamera) {
  const Sources three = CamerasAt({{0.2, 0, -4}, {1, 0, -4}, {0, 1.2, -4}});
  for (int k = 3; k <= 16; ++k) {
    const RayWeights r = AtOrigin(three, {0, 0, -3}, k);
    ExpectConvex(r);
    EXPECT_EQ(r.count, 3);  // no k+1st: the window's edge is at infinity
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

// Angles vanish, their ratios do not: the weights are the same at any distance.
TEST(HardCase, AVeryFarProxyPointMakesAllRaysAgree) {
  const Sources s = CamerasAt({{0, 0, -4}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}, {0, -1.3, -4}});
  for (const Resolution resolution : {Resolution::kOff, Resolution::kDistance, Resolution::kJacobian}) {
    RadianceSettings settings;
    settings.resolution = resolution;
    settings.k = resolution == Resolution::kOff
                     ? 4
                     : 5;  // angles are nothing beside the least difference of resolution: no window
    WeighScratch scratch;
    const RelativeSources r = MakeRelative(s, DesiredAt({0.1, 0.1, -3}), {}, settings.fov_feather);
    std::vector<double> limit;
    for (float t = 1; t < 1e30F; t *= 100) {
      // 1e19: the squares of a distance.
      if (resolution == Resolution::kDistance && t > 1e18F) break;
      const RayWeights w =
          Weigh({r, nullptr, settings}, {Eigen::Vector3f(0, 0, 1), t, Eigen::Vector3f(0, 0.6F, 0.8F)}, scratch);
      ExpectConvex(w);
      if (t < (resolution == Resolution::kOff ? 1e7F : 1e13F)) continue;  // there the last digits of r outweigh angles
      if (limit.empty())
        for (int j = 0; j < 5; ++j) limit.push_back(WeightOf(w, j));
      for (int j = 0; j < 5; ++j)
        EXPECT_NEAR(WeightOf(w, j), limit[static_cast<std::size_t>(j)], 1e-4) << Name(resolution) << " " << t;
    }
  }
}

TEST(HardCase, LeavesDownToNoSizeAndUpToOneSize) {
  const Sources s =
      CamerasAt({{0.05, 0, -4}, {0.1, 0.05, -4}, {0, 0.12, -4}, {-0.2, 0, -4}, {0, -0.3, -4}, {0.25, 0.25, -4}});
  for (const int k : {1, 4, 16})
    for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.03, 0.02, -3), Eigen::Vector3d(0.05 * 0.75, 0, -3)}) {
      RadianceSettings settings;
      settings.k = k;
      settings.correlation = Correlation::kFallingLeaves;
      // The nearest leads whatever the leaves are like.
      const auto expect_sound = [&](const std::string& what) {
        const RayWeights r = AtOrigin(s, eye, settings);
        ExpectConvex(r);
        for (int j = 1; j < 6; ++j) EXPECT_LE(WeightOf(r, j), WeightOf(r, 0) + 1e-6) << what << " camera " << j;
      };
      for (const double r_max_deg : {1e-6, 5.0, 90.0}) {
        settings.r_max_rad = r_max_deg * kRadPerDeg;
        for (double share = 1e-1; share > 1e-18; share /= 10) {
          settings.r_min_rad = share * settings.r_max_rad;
          expect_sound("towards 0: " + std::to_string(share));
          settings.r_min_rad = settings.r_max_rad / (1 + share);
          expect_sound("towards r_max: " + std::to_string(share));
        }
        settings.r_min_rad = 0;
        expect_sound("0");
        settings.r_min_rad = settings.r_max_rad;
        expect_sound("r_max");
      }
    }
}

// A window shorter than any difference of times, down to the smallest number there is, and one longer than all: the
// photos of the view's own time lead, or all do.
TEST(HardCase, TimeWindowsAndPeriodsOfNoLength) {
  Sources s = CamerasAt({{0, 0, -4}, {1, 0, -4}, {0, 1.2, -4}, {-1.1, 0, -4}, {0, -1.3, -4}});
  for (std::size_t j = 0; j < 4; ++j) s.views[j].time_s = 3600 + 0.25 * static_cast<double>(j);  // the fifth has none
  for (double length = 1e3; length > 0; length *= 1e-3)
    for (const bool periodic : {false, true}) {
      RadianceSettings settings;
      settings.time = true;
      settings.time_s = 3600.25;
      settings.time_window_s = length;
      settings.period_s = periodic ? length : 0;
      for (const int k : {2, 4, 16}) {
        settings.k = k;
        const RayWeights r = AtOrigin(s, {0.1, 0.1, -3}, settings);
        ExpectConvex(r);
        if (length < 1e-6 && !periodic) {
          EXPECT_NEAR(WeightOf(r, 1) + WeightOf(r, 4), 1, 1e-4) << length;
        }
      }
    }
}

// Times at the end of a period, a hair before it and a hair after, from zero and from clocks that began long ago: the
// weights are those of one and the same moment.
TEST(HardCase, TheEndOfAPeriodIsItsBeginningAtAnyTime) {
  constexpr double kPeriod = 0.5121, kWindow = 0.1;
  constexpr int kCount = 40;
  std::vector<Eigen::Vector3d> centres;
  for (int j = 0; j < kCount; ++j) centres.emplace_back(std::sin(2.1 * j), 0.4 * std::cos(1.3 * j), -4);
  Sources s = CamerasAt(centres);
  for (const double from : {0.0, 1e3, 1e6, 1e9}) {
    // Doubles hold a time to half an ulp of it, a period's multiple to as much again; the weight changes by at most the
    // slope of the window.
    const double turns = std::ceil(from / kPeriod), end = turns * kPeriod,
                 rounding = 2 * std::nextafter(end, 1e18) - 2 * end;
    for (int j = 0; j < kCount; ++j)
      s.views[static_cast<std::size_t>(j)].time_s = end + kPeriod * ((j % 8) - 3.5) / 40 + (j % 3) * 7 * kPeriod;
    RadianceSettings settings;
    settings.time = true;
    settings.period_s = kPeriod;
    settings.time_window_s = kWindow;
    const auto at = [&](double time_s) {
      settings.time_s = time_s;
      return AtOrigin(s, {0.1, 0.1, -3}, settings);
    };
    const RayWeights exact = at(end);
    ExpectConvex(exact);
    for (double beside = 1e-2; beside > 1e-16; beside *= 1e-2)
      for (const double side : {-1.0, 1.0}) {
        const RayWeights r = at(end + side * beside);
        ExpectConvex(r);
        for (int j = 0; j < kCount; ++j)
          EXPECT_NEAR(WeightOf(r, j), WeightOf(exact, j), 40 * (beside + rounding) / kWindow + 1e-5)
              << from << ' ' << side * beside;
      }
    for (const double time_s : {std::nextafter(end, 0), std::nextafter(end, 1e18), end + kPeriod, end - 3 * kPeriod,
                                0.0})  // the last: a phase, which knows of no clock
      for (int j = 0; j < kCount; ++j)
        EXPECT_NEAR(WeightOf(at(time_s), j), WeightOf(exact, j), 40 * rounding / kWindow + 1e-5) << from;
  }
}

// All photos in one half of the period: in the other half the nearest in time lead, those before the gap in its first
// half, those after it in its second, and nothing jumps between.
TEST(HardCase, WhereNoPhotoWasTakenInHalfOfThePeriodTheNearestInTimeLead) {
  constexpr double kPeriod = 2, kWindow = 0.1;
  constexpr int kCount = 21;
  std::vector<Eigen::Vector3d> centres;
  for (int j = 0; j < kCount; ++j) centres.emplace_back(0.02 * std::sin(2.1 * j), 0.02 * std::cos(1.3 * j), -4);
  Sources s = CamerasAt(centres);
  for (int j = 0; j < kCount; ++j)
    s.views[static_cast<std::size_t>(j)].time_s = 1e6 + 0.5 * kPeriod * j / (kCount - 1);  // phases 0 to a half
  RadianceSettings settings;
  settings.time = true;
  settings.period_s = kPeriod;
  settings.time_window_s = kWindow;
  settings.k = 2;
  RayWeights before{};
  for (double phase = 0.52; phase < 0.98; phase += 5e-4) {
    settings.time_s = 1e6 + phase * kPeriod;
    const RayWeights r = AtOrigin(s, {0.001, 0.001, -3}, settings);
    ExpectConvex(r);
    double off = 0;  // mean over the weights, to the nearest end
    for (int j = 0; j < kCount; ++j) off += WeightOf(r, j) * std::min(std::abs(j - (kCount - 1.0)), std::abs(j - 0.0));
    EXPECT_LT(off, 1.01) << phase;
    if (phase < 0.74) {
      EXPECT_GT(WeightOf(r, kCount - 1), 0.5) << phase;
    }
    if (phase > 0.76) {
      EXPECT_GT(WeightOf(r, 0), 0.5) << phase;
    }
    for (int j = 0; phase > 0.5205 && j < kCount; ++j) EXPECT_NEAR(WeightOf(r, j), WeightOf(before, j), 0.05) << phase;
    before = r;
  }
}

// No photo's leaves reach the ray: R is 0 for all of them, and their sum.
TEST(HardCase, FarFromAllCamerasTheNearestLead) {
  const Sources s = CamerasAt({{0, 0, -4}, {0.3, 0.1, -4}, {0.1, 0.4, -4}, {-0.5, 0, -4}, {-0.2, -0.4, -4}});
  for (const int k : {2, 4, 16}) {
    RadianceSettings settings;
    settings.k = k;
    settings.correlation = Correlation::kFallingLeaves;
    WeighScratch scratch;
    double before = 0;
    for (double a = 0; a < 1.5; a += 1e-3) {
      const RayWeights r = AtOrigin(s, {3 * std::sin(a), 0, -3 * std::cos(a)}, settings);
      ExpectConvex(r);
      if (a > 0.3) {
        for (const int j : {0, 2, 3, 4}) EXPECT_LT(WeightOf(r, j), WeightOf(r, 1)) << a;
        EXPECT_NEAR(WeightOf(r, 1), before, 0.02) << a;
      }
      before = WeightOf(r, 1);
    }
  }
}

TEST(HardCase, TheWorldsScaleAndOffsetDoNotMatterAfterNormalisation) {
  test::Capture c = test::MakeCapture(9, 24);
  const RadianceSettings settings;
  const RenderView world = MakeRenderView(c.scene.cameras[0], LookAt({0.7, 0.3, -4}, {0, 0, 0}, {0, -1, 0}));
  const auto plan_of = [&](const test::Capture& capture, const RenderView& view) {
    FramePlan plan;
    WeighScratch scratch;
    PlanPixels(MakeViewSetup(MakeSources(capture.scene), view, settings),
               ProxyTracer(capture.proxy, capture.scene.normalized_from_world), nullptr, {0, 0, 24, 18}, plan, scratch);
    return plan;
  };
  const FramePlan reference = plan_of(c, world);
  struct Case {
    double scale, offset, tolerance;
  };
  // 1e7 scene sizes away double holds 1e-9 of the scene: angles move by that, times the window's amplification.
  for (const Case& k : {Case{1e-6, 0, 1e-4}, Case{1e6, 0, 1e-4}, Case{1, 1e4, 1e-3}, Case{1, 1e7, 2e-2}}) {
    test::Capture moved = c;
    const Similarity3 s{k.scale, Eigen::Quaterniond::Identity(), {k.offset, -k.offset, k.offset}};
    Transform(moved.scene, s);
    for (auto& v : moved.proxy.vertices) v = s * v;
    const FramePlan plan = plan_of(
        moved, MakeRenderView(c.scene.cameras[0], TransformPose(LookAt({0.7, 0.3, -4}, {0, 0, 0}, {0, -1, 0}), s)));
    int different = 0;
    for (std::size_t i = 0; i < plan.weight.size(); ++i) {
      ASSERT_TRUE(std::isfinite(plan.weight[i]));
      if (plan.camera[i] != reference.camera[i] || std::abs(plan.weight[i] - reference.weight[i]) > k.tolerance)
        ++different;
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
      const RayWeights w =
          Weigh({r, nullptr, settings}, {ray.normalized().cast<float>(), static_cast<float>(ray.norm())}, scratch);
      ExpectConvex(w);
      std::vector<double> now(s.views.size(), 0.0);
      for (int c = 0; c < w.count; ++c)
        now[static_cast<std::size_t>(w.camera[static_cast<std::size_t>(c)])] =
            w.weight[static_cast<std::size_t>(c)] * w.alpha;
      if (!before.empty())
        for (std::size_t j = 0; j < now.size(); ++j) change = std::max(change, std::abs(now[j] - before[j]));
      before = now;
    }
    largest.push_back(change);
    RecordProperty("largest_change_at_step_" + std::to_string(step), std::to_string(change));
  }
  std::cout << "largest change of a weight at steps 1e-2, 1e-3, 1e-4: " << largest[0] << " " << largest[1] << " "
            << largest[2] << "; ratios " << largest[0] / largest[1] << " " << largest[1] / largest[2] << "\n";
  EXPECT_LT(largest[1], 0.3 * largest[0]);
  EXPECT_LT(largest[2], 0.3 * largest[1]);
}

}  // namespace
}  // namespace lumi
