// The optimal weights: that they are the ones of the full system, in the rays' order, and sum to 1.
#include "render/radiance/optimum/optimum.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>
#include <set>

#include "capture.h"
#include "optimum_oracle.h"
#include "render/radiance/optimum/coherent_order.h"
#include "render/radiance/optimum/duplicates.h"
#include "render/radiance/optimum/keep_largest.h"
#include "render/radiance/optimum/leaves_by_place.h"
#include "render/radiance/reconstruct.h"
#include "render/world/visibility_maps.h"

namespace lumi {
namespace {

RadianceSettings Full(double accuracy = 1e-3, double cutoff_deg = 180) {
  RadianceSettings s;
  s.similarity = Similarity::kFull;
  s.correlation = Correlation::kFallingLeaves;
  s.accuracy = accuracy;
  s.cutoff_rad = cutoff_deg * kRadPerDeg;
  return s;
}

std::vector<Eigen::Vector2d> RandomPixels(int count, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> x(0, 640), y(0, 480);
  std::vector<Eigen::Vector2d> pixels;
  for (int i = 0; i < count; ++i) {
    const double u = x(engine);
    pixels.emplace_back(u, y(engine));
  }
  return pixels;
}

double RowSum(const WeightTable& t, std::size_t i) {
  double sum = 0;
  for (std::int32_t k = t.first[i]; k < t.first[i + 1]; ++k)
    sum += static_cast<double>(t.weight[static_cast<std::size_t>(k)]);
  return sum;
}

double WeightOf(const WeightTable& t, std::size_t i, int camera) {
  for (std::int32_t k = t.first[i]; k < t.first[i + 1]; ++k)
    if (t.camera[static_cast<std::size_t>(k)] == camera)
      return static_cast<double>(t.weight[static_cast<std::size_t>(k)]);
  return 0;
}

// Largest error over `count` samples of a desk-like scene, random ones or blocks of 4x4 pixels; times where `times` is
// set.
double WorstError(const RadianceSettings& s, int photos, int count, bool times = false, bool neighbours = false,
                  LaneWidth width = LaneWidths().front()) {
  test::DeskLike desk = test::MakeDeskLike(photos);
  if (times)
    for (std::size_t j = 0; j < desk.sources.views.size(); ++j)
      desk.sources.views[j].time_s = 0.05 * static_cast<double>(j % 7);
  const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s);
  std::vector<Eigen::Vector2d> pixels = RandomPixels(count, 3);
  if (neighbours)
    for (std::size_t i = 0; i < pixels.size(); ++i)
      pixels[i] = pixels[i / 16] + Eigen::Vector2d(static_cast<double>(i % 4), static_cast<double>(i / 4 % 4));
  const RaySamples rays = test::RaysThrough(desk, setup, pixels);
  WeightTable table;
  OptimumCounts counts;
  WeighOptimal(setup, nullptr, rays, table, counts, width);
  EXPECT_EQ(counts.dense, 0);
  const test::OracleLeaves<long double> leaves(s.r_min_rad, s.r_max_rad);
  double worst = 0;
  long correlated = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto truth = test::OracleOptimum<long double>(setup, nullptr, rays.direction[i], rays.t[i], leaves);
    worst = std::max(worst, test::LargestError(table, i, truth));
    correlated += truth.correlated;
    if (table.alpha[i] > 0) {
      EXPECT_NEAR(RowSum(table, i), 1, 1e-5);
    }
  }
  // A photo at the very edge of reach may fall on either side in float.
  EXPECT_NEAR(static_cast<double>(counts.cameras), static_cast<double>(correlated),
              0.002 * static_cast<double>(correlated) + 1);
  return worst;
}

TEST(Optimum, SolvesTheFullSystemToTheWantedAccuracy) {
  for (const WeightSum sum : {WeightSum::kLocalMean, WeightSum::kRenormalise, WeightSum::kConstrained}) {
    RadianceSettings s = Full();
    s.sum = sum;
    EXPECT_LT(WorstError(s, 150, 40), 1e-3) << Name(sum);
    s.accuracy = 1e-6;
    EXPECT_LT(WorstError(s, 150, 40), 1e-6) << Name(sum);
    s.accuracy = 1e-9;  // Cholesky; weights are stored in float
    EXPECT_LT(WorstError(s, 100, 10), 1.2e-7) << Name(sum);
  }
}

// Field of view (sec. 4.2.1, by the nearest border) and the real-time weights (R(h) windowed at the k+1st, R the
// falling leaves') of all photos at a point, from their matrices alone.
test::OwnInputs<long double> FromMatrices(const std::vector<RenderView>& views, const Eigen::Vector3d& eye,
                                          const Eigen::Vector3d& p, const RadianceSettings& s,
                                          const test::OracleLeaves<long double>& leaves) {
  using Real = long double;
  using Vector = Eigen::Matrix<Real, 3, 1>;
  test::OwnInputs<Real> own;
  std::vector<std::pair<Real, std::size_t>> near;
  const Real pi = std::acos(Real(-1));
  const Vector back = (eye - p).cast<Real>();
  for (std::size_t j = 0; j < views.size(); ++j) {
    const Vector q = views[j].P.leftCols<3>().cast<Real>() * (p - views[j].centre).cast<Real>();
    Real f = 0;
    if (q.z() > 0) {
      const Real u = q.x() / q.z(), v = q.y() / q.z(), w = views[j].size_px.x(), h = views[j].size_px.y();
      const Real edge = std::min(std::min(u, w - u), std::min(v, h - v));
      const Real x = std::clamp(edge / (Real(s.fov_feather) * std::min(w, h)), Real(0), Real(1));
      f = (1 - std::cos(pi * x)) / 2;
    }
    own.f.push_back(f);
    if (f == 0) continue;
    const Vector to = (views[j].centre - p).cast<Real>();
    const Real angle = std::atan2(back.cross(to).norm(), back.dot(to));
    near.emplace_back(angle * (1 + Real(s.gamma) * (1 / f - 1)), j);
  }
  std::ranges::sort(near);
  own.mean.assign(views.size(), Real(0));
  const auto k = static_cast<std::size_t>(s.k);
  const Real edge = near.size() > k ? 1 / near[k].first : Real(0);  // without a k+1st the window ends nowhere
  Real sum = 0;
  for (std::size_t i = 0; i < std::min(k, near.size()); ++i)
    sum += own.mean[near[i].second] = leaves(near[i].first) * (1 - near[i].first * edge);
  for (Real& w : own.mean) w /= sum;
  return own;
}

TEST(Optimum, AgreesWithAnOracleThatCallsNoneOfItsCode) {
  // The local mean's R(h) comes from a table that is right to 1e-5 (leaves_table.h), of which weights that sum to 1
  // make up to three times as much; floats of centres, rays and measures leave a hundredth of that.
  constexpr double kTableOfLeaves = 3e-5;
  const test::DeskLike desk = test::MakeDeskLike(150);
  RadianceSettings s = Full(1e-6);
  s.resolution = Resolution::kOff;
  s.cutoff_rad = 180 * kRadPerDeg;
  const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s);
  const std::vector<Eigen::Vector2d> pixels = RandomPixels(40, 9);
  const RaySamples rays = test::RaysThrough(desk, setup, pixels);
  WeightTable table;
  OptimumCounts counts;
  WeighOptimal(setup, nullptr, rays, table, counts);
  std::vector<Eigen::Vector3d> centres;
  for (const RenderView& v : desk.sources.views) centres.push_back(v.centre - desk.view.centre);
  const test::OracleLeaves<long double> leaves(s.r_min_rad, s.r_max_rad);
  double worst = 0;
  int compared = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!(table.alpha[i] > 0)) continue;
    const Eigen::Vector3d d = (desk.view.P.leftCols<3>().inverse() * pixels[i].homogeneous()).normalized();
    const double t = desk.Distance(d);
    const test::OwnInputs<long double> own =
        FromMatrices(desk.sources.views, desk.view.centre, desk.view.centre + t * d, s, leaves);
    const test::ExactRay exact{&centres, d, t};
    worst = std::max(
        worst, test::LargestError(table, i,
                                  test::OracleOptimum<long double>(setup, nullptr, rays.direction[i], rays.t[i], leaves,
                                                                   0, &exact, Eigen::Vector3f::Zero(), &own)));
    ++compared;
  }
  EXPECT_GT(compared, 30);
  EXPECT_LT(worst, kTableOfLeaves);
}

TEST(Optimum, SolvesItWithNoiseOnTheDiagonal) {
  for (const double noise : {0.1, 2.0}) {
    RadianceSettings s = Full();
    s.noise = noise;
    EXPECT_LT(WorstError(s, 150, 40), 1e-3) << noise;
    s.accuracy = 1e-9;
    EXPECT_LT(WorstError(s, 100, 10), 1.2e-7) << noise;
  }
}

TEST(Optimum, SolvesItForNeighbouringPixels) {
  EXPECT_LT(WorstError(Full(1e-3), 200, 64, false, true), 1e-3);
  EXPECT_LT(WorstError(Full(1e-6), 200, 64, false, true), 1e-6);
}

TEST(Optimum, SolvesItAtEveryWidthOfRegister) {
  EXPECT_EQ(LaneWidths().back(), LaneWidth::k16);
  RadianceSettings every = Full(1e-3);
  every.resolution = Resolution::kDistance;
  every.time = true;
  every.epsilon = 0.4;
  for (const LaneWidth width : LaneWidths()) {
    SCOPED_TRACE(static_cast<int>(width));
    // 37 rays fill no whole number of registers.
    for (const bool neighbours : {false, true}) {
      EXPECT_LT(WorstError(Full(1e-3), 150, 37, false, neighbours, width), 1e-3);
      EXPECT_LT(WorstError(Full(1e-6), 150, 37, false, neighbours, width), 1e-6);
    }
    RadianceSettings s = Full(1e-3);
    s.sum = WeightSum::kConstrained;
    EXPECT_LT(WorstError(s, 150, 37, false, false, width), 1e-3);
    for (const double accuracy : {1e-3, 1e-6}) {
      every.accuracy = accuracy;
      EXPECT_LT(WorstError(every, 100, 24, true, false, width), accuracy);
    }
  }
}

TEST(Optimum, SolvesItWithEveryMeasure) {
  RadianceSettings s = Full(1e-6);
  s.resolution = Resolution::kDistance;
  s.beta = 0.7;
  EXPECT_LT(WorstError(s, 100, 24), 1e-6);
  s.time = true;
  s.time_s = 0.1;
  s.epsilon = 0.4;
  EXPECT_LT(WorstError(s, 100, 24, true), 1e-6);
  s.combine = Combine::kAdditive;
  s.gamma = 0.8;
  EXPECT_LT(WorstError(s, 100, 24, true), 1e-6);
  s.accuracy = 1e-3;
  EXPECT_LT(WorstError(s, 100, 24, true), 1e-3);
  s = Full(1e-3);
  s.field_of_view = false;
  s.k = 0;
  EXPECT_LT(WorstError(s, 100, 24), 1e-3);
  s.alpha = 0.5;
  EXPECT_LT(WorstError(s, 100, 24), 1e-3);
}

TEST(Optimum, TheCutoffsErrorFallsWithIt) {
  double before = 1;
  for (const double cutoff : {10.0, 14.0, 18.0, 24.0}) {
    const double error = WorstError(Full(1e-7, cutoff), 150, 40);
    EXPECT_LT(error, before);
    before = error;
  }
  EXPECT_LT(before, 1e-6);
  EXPECT_LT(WorstError(Full(1e-7, RadianceSettings{}.cutoff_rad / kRadPerDeg), 150, 40), 1e-4);
}

// Two kinds of leaves along one axis, left and right of the middle of what is seen.
std::shared_ptr<LeavesByPlace> TwoKinds(const ViewSetup& setup, const RaySamples& rays) {
  auto places = std::make_shared<LeavesByPlace>();
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (std::isfinite(rays.t[i]) && rays.t[i] > 0)
      places->grid.box.extend(setup.desired.centre + static_cast<double>(rays.t[i]) * rays.direction[i].cast<double>());
  places->grid.count = {4, 1, 1};
  places->kind = {0, 0, 1, 1};
  places->kinds = {{0.001 * kRadPerDeg, 5 * kRadPerDeg, 0}, {0.3 * kRadPerDeg, 12 * kRadPerDeg, 0.5}};
  return places;
}

TEST(LeavesByPlace, WeightsAreTheKindsOwnWhereOneIsAloneAndTheirMixBetween) {
  const test::DeskLike desk = test::MakeDeskLike(80);
  RadianceSettings s = Full(1e-6);
  const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s);
  const RaySamples rays = test::RaysThrough(desk, setup, RandomPixels(200, 4));
  const auto places = TwoKinds(setup, rays);
  OptimumCounts counts;
  WeightTable mixed, of[2];
  s.by_place = places;
  WeighScratch scratch;
  Reconstruct(MakeViewSetup(desk.sources, desk.view, s), nullptr, rays, mixed, counts, scratch);
  for (std::size_t k = 0; k < 2; ++k) {
    RadianceSettings own = Full(1e-6);
    own.r_min_rad = places->kinds[k].r_min_rad;
    own.r_max_rad = places->kinds[k].r_max_rad;
    own.noise = places->kinds[k].noise;
    WeighOptimal(MakeViewSetup(desk.sources, desk.view, own), nullptr, rays, of[k], counts);
  }
  int alone = 0, between = 0;
  double apart = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(mixed.alpha[i], of[0].alpha[i]);
    if (!(mixed.alpha[i] > 0)) continue;
    double share[2];
    places->Shares(setup.desired.centre + static_cast<double>(rays.t[i]) * rays.direction[i].cast<double>(), share);
    EXPECT_NEAR(share[0] + share[1], 1, 1e-12);
    ++(share[0] == 0 || share[1] == 0 ? alone : between);
    EXPECT_NEAR(RowSum(mixed, i), 1, 1e-5);
    std::set<std::int32_t> once;
    for (std::int32_t e = mixed.first[i]; e < mixed.first[i + 1]; ++e)
      EXPECT_TRUE(once.insert(mixed.camera[static_cast<std::size_t>(e)]).second);
    for (int j = 0; j < 80; ++j) {
      // Rays are grouped otherwise here than there: to the accuracy asked for.
      EXPECT_NEAR(WeightOf(mixed, i, j), share[0] * WeightOf(of[0], i, j) + share[1] * WeightOf(of[1], i, j), 2e-6);
      apart = std::max(apart, std::abs(WeightOf(of[0], i, j) - WeightOf(of[1], i, j)));
    }
  }
  EXPECT_GT(alone, 20);
  EXPECT_GT(between, 20);
  EXPECT_GT(apart, 0.05);
}

TEST(LeavesByPlace, SharesAreContinuousAndHoldOutsideTheBox) {
  LeavesByPlace places;
  places.grid.box = Eigen::AlignedBox3d(Eigen::Vector3d(-1, 0, 2), Eigen::Vector3d(1, 0, 3));  // flat along y
  places.grid.count = {3, 1, 2};
  places.kind = {0, 1, 2, 1, 1, 0};
  places.kinds.resize(3);
  double a[3], b[3];
  places.Shares({-5, 7, -9}, a);
  EXPECT_EQ(a[0], 1);
  places.Shares({0.5, 0, 2}, a);
  EXPECT_EQ(a[1], 0.5);
  EXPECT_EQ(a[2], 0.5);
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> at(-2, 4);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d p(at(engine), at(engine), at(engine));
    places.Shares(p, a);
    places.Shares(p + Eigen::Vector3d::Constant(1e-6), b);
    EXPECT_NEAR(a[0] + a[1] + a[2], 1, 1e-12);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 5e-6);
  }
}

TEST(Optimum, RowsFollowTheRaysWhateverTheirOrder) {
  const test::DeskLike desk = test::MakeDeskLike(80);
  const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, Full());
  const RaySamples rays = test::RaysThrough(desk, setup, RandomPixels(70, 9));
  RaySamples backwards{{rays.direction.rbegin(), rays.direction.rend()}, {rays.t.rbegin(), rays.t.rend()}, {}};
  backwards.t[5] = -1;
  backwards.t[6] = std::numeric_limits<float>::infinity();
  WeightTable a, b;
  OptimumCounts counts;
  WeighOptimal(setup, nullptr, rays, a, counts);
  WeighOptimal(setup, nullptr, backwards, b, counts);
  for (std::size_t i = 0; i < 70; ++i) {
    const std::size_t j = 69 - i;
    if (j == 5 || j == 6) {
      EXPECT_EQ(b.alpha[j], 0);
      EXPECT_EQ(b.first[j], b.first[j + 1]);
      continue;
    }
    EXPECT_EQ(a.alpha[i], b.alpha[j]);
    for (int c = 0; c < 80; ++c) EXPECT_NEAR(WeightOf(a, i, c), WeightOf(b, j, c), 1e-3);
  }
}

TEST(Optimum, ABlindPhotoWeighsExactlyNothing) {
  const test::DeskLike desk = test::MakeDeskLike(262);
  for (const double accuracy : {1e-3, 1e-6, 1e-9})
    for (const WeightSum sum : {WeightSum::kLocalMean, WeightSum::kRenormalise, WeightSum::kConstrained}) {
      RadianceSettings s = Full(accuracy);
      s.sum = sum;
      const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s);
      const RaySamples rays = test::RaysThrough(desk, setup, RandomPixels(accuracy < 1e-7 ? 6 : 64, 4));
      WeightTable table;
      OptimumCounts counts;
      WeighOptimal(setup, nullptr, rays, table, counts);
      Measures m;
      int blind = 0;
      for (std::size_t i = 0; i < rays.size(); ++i) {
        EvaluateMeasures(setup.sources, s, rays.direction[i], rays.t[i], Eigen::Vector3f::Zero(), m);
        for (int c = 0; c < 262; ++c)
          if (m.f[static_cast<std::size_t>(c)] == 0) {
            ASSERT_EQ(WeightOf(table, i, c), 0);
            ++blind;
          }
      }
      EXPECT_GT(blind, 20);
    }
}

TEST(Optimum, LeftOutPhotosAreLeftOut) {
  const test::DeskLike desk = test::MakeDeskLike(60);
  std::vector<bool> use(60, true);
  for (std::size_t j = 0; j < 60; j += 3) use[j] = false;
  for (const Combine combine : {Combine::kSmooth, Combine::kAdditive}) {
    RadianceSettings s = Full();
    s.combine = combine;
    const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s, use);
    const RaySamples rays = test::RaysThrough(desk, setup, RandomPixels(32, 4));
    WeightTable table;
    OptimumCounts counts;
    WeighOptimal(setup, nullptr, rays, table, counts);
    EXPECT_GT(table.camera.size(), 0u);
    for (const std::int32_t c : table.camera) EXPECT_TRUE(use[static_cast<std::size_t>(c)]);
  }
}

TEST(Optimum, BlockedPhotosCountLess) {
  const test::Capture c = test::MakeCapture(14, 40);
  const RenderView view = MakeRenderView(c.scene.cameras[0], LookAt({0.7, 0.3, -4}, {0, 0, 0.5}, {0, -1, 0}));
  const Sources sources = MakeSources(c.scene);
  RadianceSettings s = Full(1e-6);
  s.r_max_rad = 12 * kRadPerDeg;
  const ViewSetup setup = MakeViewSetup(sources, view, s);
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  const VisibilityMaps maps = MakeVisibilityMaps(sources, tracer);
  RaySamples rays;
  for (double y = 0.5; y < 30; y += 3)
    for (double x = 0.5; x < 40; x += 3)
      rays.direction.push_back((setup.ray_from_pixel * Eigen::Vector3d(x, y, 1)).normalized().cast<float>());
  rays.t.resize(rays.size());
  tracer.Trace(setup.desired.centre.cast<float>(), rays.direction, rays.t);
  WeightTable seen, all;
  OptimumCounts counts;
  WeighOptimal(setup, &maps, rays, seen, counts);
  WeighOptimal(setup, nullptr, rays, all, counts);
  const test::OracleLeaves<long double> leaves(s.r_min_rad, s.r_max_rad);
  int different = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!std::isfinite(rays.t[i])) continue;
    EXPECT_LT(test::LargestError(seen, i,
                                 test::OracleOptimum<long double>(setup, &maps, rays.direction[i], rays.t[i], leaves)),
              1e-6);
    bool differs = false;
    for (int j = 0; j < 14; ++j) differs |= std::abs(WeightOf(seen, i, j) - WeightOf(all, i, j)) > 0.01;
    different += differs;
  }
  EXPECT_GT(different, 3);
}

TEST(Optimum, PixelsArePlannedWithIt) {
  // As WeighOptimal gives them, but for weights that do not show.
  const test::Capture c = test::MakeCapture(12, 40);
  const RenderView view = MakeRenderView(c.scene.cameras[0], LookAt({0.7, 0.3, -4}, {0, 0, 0.5}, {0, -1, 0}));
  const ViewSetup setup = MakeViewSetup(MakeSources(c.scene), view, Full());
  const ProxyTracer tracer(c.proxy, c.scene.normalized_from_world);
  FramePlan plan;
  WeighScratch scratch;
  PlanPixels(setup, tracer, nullptr, {3, 5, 20, 12}, plan, scratch);
  ASSERT_EQ(plan.alpha.size(), 240u);
  const auto k = static_cast<std::size_t>(plan.k);
  RaySamples rays;
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 20; ++x)
      rays.direction.push_back(
          (setup.ray_from_pixel * Eigen::Vector3d(3.5 + x, 5.5 + y, 1)).normalized().cast<float>());
  rays.t.resize(240);
  tracer.Trace(setup.desired.centre.cast<float>(), rays.direction, rays.t);
  WeightTable table;
  OptimumCounts counts;
  WeighOptimal(setup, nullptr, rays, table, counts);
  for (std::size_t s = 0; s < plan.alpha.size(); ++s) {
    if (!(plan.alpha[s] > 0)) continue;
    double sum = 0;
    for (std::size_t i = 0; i < k; ++i)
      if (plan.camera[s * k + i] >= 0) {
        sum += static_cast<double>(plan.weight[s * k + i]);
        EXPECT_NEAR(static_cast<double>(plan.weight[s * k + i]), WeightOf(table, s, plan.camera[s * k + i]), 1e-4);
      }
    EXPECT_EQ(plan.alpha[s], table.alpha[s]);
    EXPECT_NEAR((plan.offset[s] - rays.t[s] * rays.direction[s]).norm(), 0, 1e-6);
    EXPECT_NEAR(sum, 1, 1e-5);
    EXPECT_GT(plan.offset[s].norm(), 1e-3F);
  }
  EXPECT_GT(plan.optimum.samples, 200);
}

TEST(Reconstruct, IdentityIsTheRealTimeWeight) {
  const test::DeskLike desk = test::MakeDeskLike(50);
  for (const int k : {0, 4}) {
    RadianceSettings s;
    s.k = k;
    const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, s);
    const RaySamples rays = test::RaysThrough(desk, setup, RandomPixels(20, 4));
    WeightTable table;
    OptimumCounts counts;
    WeighScratch scratch;
    Reconstruct(setup, nullptr, rays, table, counts, scratch);
    EXPECT_EQ(counts.samples, 0);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (k == 0) {
        std::vector<float> all;
        EXPECT_EQ(table.alpha[i], WeighAll({setup.sources, nullptr, s}, {rays.direction[i], rays.t[i]}, scratch, all));
        for (int c = 0; c < 50; ++c)
          EXPECT_EQ(WeightOf(table, i, c), static_cast<double>(all[static_cast<std::size_t>(c)]));
      } else {
        const RayWeights r = Weigh({setup.sources, nullptr, s}, {rays.direction[i], rays.t[i]}, scratch);
        EXPECT_EQ(table.first[i + 1] - table.first[i], r.count);
        for (std::size_t c = 0; c < static_cast<std::size_t>(r.count); ++c)
          EXPECT_EQ(WeightOf(table, i, r.camera[c]), static_cast<double>(r.weight[c]));
      }
    }
  }
}

TEST(CoherentOrder, IsAPermutationOfTheRaysThatHitAndKeepsNeighboursTogether) {
  const test::DeskLike desk = test::MakeDeskLike(5);
  const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, Full());
  RaySamples rays = test::RaysThrough(desk, setup, RandomPixels(1000, 6));
  rays.t[17] = -1;
  const auto order = CoherentOrder(rays, 16);
  EXPECT_EQ(order.size(), 999u);
  EXPECT_EQ(std::set<std::uint32_t>(order.begin(), order.end()).size(), 999u);
  // 62 cells tile the view: each about an eighth of it across, whatever the numbering.
  double mean = 0;
  for (std::size_t at = 0; at + 16 <= order.size(); at += 16) {
    double across = 0;
    for (std::size_t i = at; i < at + 16; ++i)
      across = std::max(across, static_cast<double>((rays.direction[order[i]] - rays.direction[order[at]]).norm()));
    mean += across / 62;
  }
  EXPECT_LT(mean, 0.25);
  EXPECT_TRUE(CoherentOrder({}, 16).empty());
}

TEST(KeepLargest, FallsToTheNextWeightAndSumsToOne) {
  WeightTable t;
  t.first = {0, 4, 6, 9};
  t.camera = {1, 4, 6, 9, 0, 2, 3, 5, 7};
  t.weight = {0.5F, -0.2F, 0.6F, 0.1F, 0.3F, 0.7F, 1.0F / 3, 1.0F / 3, 1.0F / 3};
  t.alpha = {1, 1, 1};
  KeepLargest(t, 2);
  EXPECT_EQ(t.first, (std::vector<std::int32_t>{0, 2, 4, 6}));
  EXPECT_EQ(t.camera, (std::vector<std::int32_t>{1, 6, 0, 2, 3, 5}));
  // 0.5 - 0.2 and 0.6 - 0.2 make 0.7; what is missing goes in proportion.
  EXPECT_NEAR(t.weight[0], 0.3 / 0.7, 1e-6);
  EXPECT_NEAR(t.weight[1], 0.4 / 0.7, 1e-6);
  EXPECT_EQ(t.weight[2], 0.3F);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(RowSum(t, i), 1, 1e-6);
  EXPECT_THROW(KeepLargest(t, 0), std::invalid_argument);
}

TEST(KeepLargest, DoesNotJumpWhereTheKthChanges) {
  double before = 0;
  for (int i = 0; i <= 200; ++i) {
    const float a = 0.2F + 0.001F * static_cast<float>(i - 100);
    WeightTable t{{0, 3}, {0, 1, 2}, {0.6F, a, 0.2F}, {1}};
    KeepLargest(t, 2);
    const double now = WeightOf(t, 0, 1);
    if (i > 0) {
      EXPECT_LT(std::abs(now - before), 0.004);
    }
    before = now;
  }
}

TEST(DropSmall, ChangesNoWeightByMuchAndKeepsTheSum) {
  WeightTable t{{0, 4, 4, 6}, {0, 1, 2, 3, 4, 5}, {0.7F, -0.2F, 0.5F - 0.001F, 0.001F, 0.002F, 0.998F}, {1, 0, 1}};
  const WeightTable before = t;
  DropSmall(t, 0.0015F);
  EXPECT_EQ(t.first, (std::vector<std::int32_t>{0, 3, 3, 5}));
  EXPECT_NEAR(RowSum(t, 0), 1, 1e-6);
  EXPECT_NEAR(RowSum(t, 2), 1, 1e-6);
  for (int c = 0; c < 6; ++c)
    for (const std::size_t i : {0u, 2u}) EXPECT_NEAR(WeightOf(t, i, c), WeightOf(before, i, c), 0.004);
  // Just above the threshold is hardly there.
  EXPECT_NEAR(WeightOf(t, 2, 4), 0.0005, 1e-5);
}

TEST(Duplicates, ActAsOnePhotoOfTheirCombinedFactor) {
  const float f[3] = {0.6F, 0.9F, 0.0F};
  double share[3];
  MemberShares(f, 3, share);
  EXPECT_EQ(share[2], 0);
  // Against the system itself: y = 1 along the photos' own direction.
  Eigen::Matrix2d S;
  S << 1, 0.54, 0.54, 1;
  const Eigen::Vector2d w = S.inverse() * Eigen::Vector2d(0.6, 0.9);
  const double g = GroupFactor(f, 3);
  EXPECT_NEAR(share[0] * g, w[0], 1e-6);
  EXPECT_NEAR(share[1] * g, w[1], 1e-6);
}

}  // namespace
}  // namespace lumi
