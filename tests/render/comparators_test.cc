// Published methods by what their papers say defines them: weights in closed form at single rays, and whole pictures
// whose answer is known.
#include "render/comparators/comparators.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "capture.h"
#include "render/comparators/sphere_grid.h"
#include "render/radiance/reconstruct.h"
#include "render/world/renderer.h"
#include "scene/geometry/rigid3.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

// Weights are floats, made of float angles: a millionth, and what a division by a small angle makes of it.
constexpr double kWeightTolerance = 2e-5;
constexpr int kPictureSide = 640;
constexpr double kFocalPx = 400;

RenderView CameraAt(const Eigen::Vector3d& centre, const Eigen::Vector3d& target) {
  const Camera camera =
      Camera::Pinhole(kPictureSide, kPictureSide, kFocalPx, kFocalPx, 0.5 * kPictureSide, 0.5 * kPictureSide);
  return MakeRenderView(camera, LookAt(centre, target, {0, -1, 0}));
}
RenderView CameraAhead(const Eigen::Vector3d& centre) { return CameraAt(centre, centre + Eigen::Vector3d(0, 0, 1)); }

Mesh WallAt(double z, double side = 50) {
  Mesh m;
  m.vertices = {{-side, -side, z}, {side, -side, z}, {side, side, z}, {-side, side, z}};
  m.faces = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

struct World {
  World(const std::vector<RenderView>& views, const Mesh& mesh) : proxy(mesh, Similarity3()) { sources.views = views; }
  Sources sources;
  ProxyTracer proxy;
};

RadianceSettings Of(Algorithm method) {
  RadianceSettings s;
  s.method = method;
  return s;
}

// The weights of all photos where the view's ray in this direction meets the proxy; empty: a hole.
std::vector<double> WeightsTowards(const World& w, const RenderView& desired, const Eigen::Vector3d& direction,
                                   const RadianceSettings& s, const std::vector<bool>& use = {}) {
  ViewSetup setup = MakeViewSetup(w.sources, desired, s, use);
  setup.method = MakeComparator(w.sources, w.proxy, setup);
  RaySamples rays;
  rays.exact_direction = {direction.normalized()};
  rays.direction = {rays.exact_direction[0].cast<float>()};
  rays.t.resize(1);
  rays.normal.resize(1);
  rays.face.resize(1);
  w.proxy.Trace(desired.centre.cast<float>(), rays.direction, rays.t, rays.normal, rays.face);
  rays.exact_t = {rays.face[0] < 0 ? 0.0
                                   : w.proxy.Refined(rays.face[0], desired.centre, rays.exact_direction[0], rays.t[0])};
  setup.method->Meet(rays);
  WeightTable table;
  OptimumCounts counts;
  WeighScratch scratch;
  Reconstruct(setup, nullptr, rays, table, counts, scratch);
  if (!(table.alpha[0] > 0)) return {};
  std::vector<double> weights(w.sources.views.size(), 0.0);
  for (std::size_t i = 0; i < table.camera.size(); ++i)
    weights[static_cast<std::size_t>(table.camera[i])] += static_cast<double>(table.weight[i]);
  return weights;
}
std::vector<double> WeightsAt(const World& w, const RenderView& desired, const Eigen::Vector3d& point,
                              const RadianceSettings& s, const std::vector<bool>& use = {}) {
  return WeightsTowards(w, desired, point - desired.centre, s, use);
}

void ExpectWeights(const std::vector<double>& found, const std::vector<double>& expected, double tolerance) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_NEAR(found[i], expected[i], tolerance) << "photo " << i;
}

double AngleAt(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d u = (a - p).normalized(), v = (b - p).normalized();
  return 2 * std::atan2((u - v).norm(), (u + v).norm());
}

const Eigen::Vector3d kPoint(0.2, 0.1, 5);

TEST(ChenWilliams, DissolvesTheTwoNearestPhotosByTheInverseOfTheirDistances) {
  const World w({CameraAhead({-0.3, 0, 0}), CameraAhead({0.1, 0, 0}), CameraAhead({2, 0, 0})}, WallAt(5));
  const RenderView view = CameraAhead({0, 0, 0});
  // Distance: the angle of the baseline at the proxy's median distance, which both share; small angles are their sines.
  const double near = 1 / std::atan(0.1 / 5), far = 1 / std::atan(0.3 / 5);
  const auto weights = WeightsAt(w, view, kPoint, Of(Algorithm::kChenWilliams1993));
  ExpectWeights(weights, {far / (near + far), near / (near + far), 0}, kWeightTolerance);
  EXPECT_EQ(WeightsAt(w, view, {3, 0.5, 5}, Of(Algorithm::kChenWilliams1993)),
            WeightsAt(w, view, {3.2, -0.5, 5}, Of(Algorithm::kChenWilliams1993)))
      << "once a picture, not once a pixel";
}

TEST(ChenWilliams, FillsWhatTheNearestDoNotSeeFromTheNextPhoto) {
  const World w({CameraAhead({-0.1, 0, 0}), CameraAhead({0.1, 0, 0}), CameraAhead({4, 0, 0})}, WallAt(5));
  ExpectWeights(WeightsAt(w, CameraAhead({0, 0, 0}), {4.5, 0, 5}, Of(Algorithm::kChenWilliams1993)), {0, 0, 1}, 0);
}

// Cameras at whole numbers, columns 4 and rows 3.
std::vector<RenderView> GridOfCameras() {
  std::vector<RenderView> views;
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 4; ++x) views.push_back(CameraAhead({x - 1.5, y - 1.0, 0}));
  return views;
}

TEST(LightField, InterpolatesTheFourCamerasAroundTheRayAtTheFocalPlane) {
  const World w(GridOfCameras(), WallAt(5));
  const RenderView view = CameraAhead({0.2, 0.3, -1});
  // The ray crosses the cameras' plane, z = 0, here:
  const Eigen::Vector3d p(0.5, 0.4, 5);
  const Eigen::Vector2d u = view.centre.head<2>() + (p - view.centre).head<2>() / 6;
  const double x = u.x() + 1.5 - 1, y = u.y() + 1 - 1;  // in the cell whose upper left camera is (1, 1)
  ASSERT_TRUE(x > 0 && x < 1 && y > 0 && y < 1);
  std::vector<double> expected(12, 0.0);
  expected[5] = (1 - x) * (1 - y);
  expected[6] = x * (1 - y);
  expected[9] = (1 - x) * y;
  expected[10] = x * y;
  ExpectWeights(WeightsAt(w, view, p, Of(Algorithm::kLevoyHanrahan1996)), expected, 1e-4);
  ExpectWeights(WeightsAt(w, view, p, Of(Algorithm::kGortler1996)), expected, 1e-4);
}

TEST(LightField, KnowsNoSurfaceTheLumigraphDoes) {
  // A near board before the wall: rays to it meet the focal plane behind it, and cross the same place of the cameras.
  Mesh mesh = WallAt(5);
  Append(mesh, WallAt(3, 0.05));
  const World w(GridOfCameras(), mesh);
  ViewSetup setup = MakeViewSetup(w.sources, CameraAhead({0, 0, -1}), Of(Algorithm::kLevoyHanrahan1996));
  RaySamples rays;
  rays.exact_direction = {Eigen::Vector3d(0, 0, 1)};
  rays.direction = {Eigen::Vector3f(0, 0, 1)};
  rays.t = {4.0F};
  rays.normal.resize(1);
  rays.face = {2};
  MakeComparator(w.sources, w.proxy, setup)->Meet(rays);
  EXPECT_NEAR(rays.exact_t[0], 6, 1e-6);  // the mean of what the cameras see: of each the wall, in the median
  EXPECT_EQ(rays.face[0], -1);
  rays.t = {4.0F};
  rays.face = {2};
  setup.settings.method = Algorithm::kGortler1996;
  MakeComparator(w.sources, w.proxy, setup)->Meet(rays);
  EXPECT_EQ(rays.t[0], 4.0F);
}

TEST(Lumigraph, FillsAMissingCameraFromACoarserGrid) {
  const World w(GridOfCameras(), WallAt(5));
  std::vector<bool> use(12, true);
  use[5] = false;
  const auto weights = WeightsAt(w, CameraAhead({-0.5, 0, 0}), {-0.5, 0.01, 5}, Of(Algorithm::kGortler1996), use);
  ASSERT_EQ(weights.size(), 12u);
  EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1, 1e-6);
  EXPECT_EQ(weights[5], 0);
  for (const int neighbour : {1, 4, 6, 9}) EXPECT_GT(weights[static_cast<std::size_t>(neighbour)], 0.02) << neighbour;
}

TEST(LightField, RefusesCamerasThatOneSlabDoesNotHold) {
  std::vector<RenderView> ring;
  for (int i = 0; i < 8; ++i) {
    const double a = i * std::numbers::pi / 4;
    ring.push_back(CameraAt({3 * std::cos(a), 0, 3 * std::sin(a)}, {0, 0, 0}));
  }
  const World w(ring, WallAt(0.01));
  for (const Algorithm a : {Algorithm::kLevoyHanrahan1996, Algorithm::kGortler1996})
    EXPECT_THROW(WeightsTowards(w, ring[0], {-1, 0, 0.1}, Of(a)), DataError);
}

TEST(Debevec1996, WeighsByTheInverseOfTheAngle) {
  const std::vector<Eigen::Vector3d> centres = {{-0.5, 0, 0}, {0.3, 0.1, 0.2}, {1.2, -0.4, 0}};
  const World w({CameraAhead(centres[0]), CameraAhead(centres[1]), CameraAhead(centres[2])}, WallAt(5));
  const RenderView view = CameraAhead({0, 0, 0});
  for (const double power : {1.0, 3.0}) {
    std::vector<double> expected;
    double sum = 0;
    for (const auto& c : centres) sum += expected.emplace_back(std::pow(AngleAt(kPoint, {0, 0, 0}, c), -power));
    for (double& e : expected) e /= sum;
    RadianceSettings s = Of(Algorithm::kDebevec1996);
    s.method_parameter = power;
    ExpectWeights(WeightsAt(w, view, kPoint, s), expected, kWeightTolerance);
  }
}

TEST(Debevec1996, CountsAPhotoLessTowardsItsBorder) {
  const World w({CameraAhead({-0.5, 0, 0}), CameraAhead({0.5, 0, 0})}, WallAt(5));
  // The same angle to both, and 4 px inside the left photo's right border.
  const double edge = -0.5 + (0.5 * kPictureSide - 4) / kFocalPx * 5;
  const auto weights = WeightsAt(w, CameraAhead({0, 0, 0}), {edge, 0, 5}, Of(Algorithm::kDebevec1996));
  EXPECT_LT(weights[0], 0.3 * weights[1]);
}

TEST(SeitzDyer, DissolvesLinearlyAlongTheWayBetweenTwoPhotos) {
  const World w({CameraAhead({-1, 0, 0}), CameraAhead({1, 0, 0})}, WallAt(5));
  for (const Algorithm a : {Algorithm::kSeitzDyer1996, Algorithm::kLhuillierQuan1999})
    for (const double x : {-0.8, -0.3, 0.0, 0.6})
      ExpectWeights(WeightsAt(w, CameraAhead({x, 0, 0}), kPoint, Of(a)), {0.5 * (1 - x), 0.5 * (1 + x)},
                    kWeightTolerance);
}

TEST(SeitzDyer, RefusesPhotosThatCannotBeRectifiedAndItsSuccessorDoesNot) {
  // One behind the other: the epipoles lie in the middle of both.
  const World w({CameraAhead({0, 0, 0}), CameraAhead({0, 0, 1})}, WallAt(5));
  const RenderView between = CameraAhead({0, 0, 0.25});
  EXPECT_THROW(WeightsAt(w, between, kPoint, Of(Algorithm::kSeitzDyer1996)), DataError);
  ExpectWeights(WeightsAt(w, between, kPoint, Of(Algorithm::kLhuillierQuan1999)), {0.75, 0.25}, kWeightTolerance);
}

TEST(LhuillierQuan, ShowsWhatOnlyOnePhotoSeesFromThatOne) {
  const World w({CameraAhead({-1, 0, 0}), CameraAhead({1, 0, 0})}, WallAt(5));
  ExpectWeights(WeightsAt(w, CameraAhead({0, 0, 0}), {-4.5, 0, 5}, Of(Algorithm::kLhuillierQuan1999)), {1, 0}, 0);
}

TEST(Pulli, ThreeViewsAroundTheWantedOneCountByItsPlaceInTheirTriangle) {
  // Corners of an equilateral triangle around the view, all at one distance from the object.
  std::vector<RenderView> views;
  for (int i = 0; i < 3; ++i) {
    const double a = 2 * std::numbers::pi * i / 3;
    views.push_back(CameraAt({std::cos(a), std::sin(a), 0}, {0, 0, 5}));
  }
  views.push_back(CameraAt({3, 0, 0}, {0, 0, 5}));
  const World w(views, WallAt(5, 40));
  const double third = 1.0 / 3;
  ExpectWeights(WeightsAt(w, CameraAt({0, 0, 0}, {0, 0, 5}), {0, 0, 5}, Of(Algorithm::kPulli1997)),
                {third, third, third, 0}, 1e-4);
  // At a view of the three the others count nothing.
  ExpectWeights(WeightsAt(w, views[1], {0, 0, 5}, Of(Algorithm::kPulli1997)), {0, 1, 0, 0}, 1e-4);
}

TEST(Pulli, CountsAViewByHowSquarelyItSawTheSurface) {
  std::vector<RenderView> views = {CameraAt({-2, 0, 0}, {0, 0, 5}), CameraAt({2, 0, 2}, {0, 0, 5}),
                                   CameraAt({0, 1, 0}, {0, 0, 5})};
  const World w(views, WallAt(5, 40));
  const Eigen::Vector3d p(0, 0, 5);
  RadianceSettings with = Of(Algorithm::kPulli1997), without = with;
  without.method_parameter = 0;
  const RenderView view = CameraAt({0, 0, 0}, p);
  const auto a = WeightsAt(w, view, p, with), b = WeightsAt(w, view, p, without);
  const auto cosine = [&](std::size_t j) { return (views[j].centre - p).normalized().dot(Eigen::Vector3d(0, 0, -1)); };
  EXPECT_NEAR(a[0] / a[1], b[0] / b[1] * cosine(0) / cosine(1), 1e-3);
}

TEST(Debevec1998, WeighsOnceAFaceByTheViewMapOfItsDirection) {
  std::vector<RenderView> views;
  for (const double x : {-1.0, -0.4, 0.3, 1.1}) views.push_back(CameraAhead({x, 0, 0}));
  Mesh mesh = WallAt(5, 0.06);  // a face smaller than a cell
  Append(mesh, WallAt(5.5));
  const World w(views, mesh);
  const RenderView view = CameraAhead({0, 0.05, 0});
  const auto first = WeightsAt(w, view, {0.04, -0.03, 5}, Of(Algorithm::kDebevec1998));
  EXPECT_EQ(first, WeightsAt(w, view, {0.05, -0.05, 5}, Of(Algorithm::kDebevec1998)));
  // From the direction of a node of the map the photo that is nearest to it, alone: straight ahead of the face.
  const Eigen::Vector3d middle = (w.proxy.Corners(0)[0] + w.proxy.Corners(0)[1] + w.proxy.Corners(0)[2]) / 3;
  ExpectWeights(WeightsAt(w, CameraAhead({middle.x(), middle.y(), 0}), {0.04, -0.03, 5}, Of(Algorithm::kDebevec1998)),
                {0, 0, 1, 0}, 1e-6);
}

TEST(Pighin, TheTwoPhotosToEitherSideCountByTheAnglesToThem) {
  std::vector<RenderView> views;
  for (const double a : {-0.6, -0.1, 0.3, 0.8})
    views.push_back(CameraAt({5 * std::sin(a), 0, 5 - 5 * std::cos(a)}, {0, 0, 5}));
  const World w(views, WallAt(5));
  RadianceSettings s = Of(Algorithm::kPighin1998);
  s.method_parameter = 0;
  ExpectWeights(WeightsAt(w, CameraAt({0, 0, 0}, {0, 0, 5}), {0, 0, 5}, s), {0, 0.75, 0.25, 0}, 2e-3);
}

TEST(Heigl, APixelBlendsTheCamerasOfItsTriangleByBarycentricCoordinates) {
  const std::vector<Eigen::Vector3d> centres = {{-1, -1, 1}, {1, -0.8, 1.2}, {0.1, 1, 0.9}, {3, 3, 1}};
  std::vector<RenderView> views;
  for (const auto& c : centres) views.push_back(CameraAhead(c));
  const World w(views, WallAt(6));
  const RenderView view = CameraAhead({0, 0, 0});
  const Eigen::Vector3d d(0.05, 0.02, 1);
  // The ray's pixel in the plane z = 1, and the centres' images there.
  Eigen::Matrix3d corners;
  for (int i = 0; i < 3; ++i)
    corners.col(i) = (centres[static_cast<std::size_t>(i)] / centres[static_cast<std::size_t>(i)].z());
  const Eigen::Vector3d b = corners.inverse() * d;
  ASSERT_GT(b.minCoeff(), 0);
  ExpectWeights(WeightsTowards(w, view, d, Of(Algorithm::kHeigl1999)), {b[0], b[1], b[2], 0}, kWeightTolerance);
}

TEST(Heigl, CamerasOnALineAreInterpolatedAlongIt) {
  const World w({CameraAhead({-1, 0, 1}), CameraAhead({0, 0, 1}), CameraAhead({1, 0, 1})}, WallAt(6));
  ExpectWeights(WeightsTowards(w, CameraAhead({0, 0, 0}), {0.25, 0.1, 1}, Of(Algorithm::kHeigl1999)), {0, 0.75, 0.25},
                kWeightTolerance);
}

TEST(Wood, ALumisphereWithAPhotoAtEachNodeIsPiecewiseLinear) {
  // Photos all around a small face, at the nodes of the octahedron's subdivision that lie before it.
  const SphereGrid grid(2);
  const Eigen::Vector3d p(0, 0, 0);
  std::vector<RenderView> views;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const Eigen::Vector3d d = grid.Direction(i);
    if (d.z() < -1e-9)
      views.push_back(MakeRenderView(
          Camera::Pinhole(kPictureSide, kPictureSide, kFocalPx, kFocalPx, 0.5 * kPictureSide, 0.5 * kPictureSide),
          LookAt(4 * d, p, std::abs(d.y()) > 0.9 ? Eigen::Vector3d(1, 0, 0) : Eigen::Vector3d(0, -1, 0))));
  }
  const World w(views, WallAt(0, 0.5));
  RadianceSettings s = Of(Algorithm::kWood2000);
  s.method_parameter = 1e-7;
  const Eigen::Vector3d direction(0.3, 0.15, -1);
  const auto around = grid.Around(direction);
  std::vector<double> expected(views.size(), 0.0);
  for (const auto& [node, weight] : around)
    for (std::size_t j = 0; j < views.size(); ++j)
      if ((views[j].centre.normalized() - grid.Direction(static_cast<std::size_t>(node))).norm() < 1e-9)
        expected[j] += weight;
  EXPECT_NEAR(std::accumulate(expected.begin(), expected.end(), 0.0), 1, 1e-12);
  ExpectWeights(WeightsAt(w, CameraAt(3 * direction, p), p, s), expected, 1e-4);
  // As smooth as can be it is one colour: the mean of all.
  s.method_parameter = 1e6;
  ExpectWeights(WeightsAt(w, CameraAt(3 * direction, p), p, s),
                std::vector<double>(views.size(), 1.0 / static_cast<double>(views.size())), 1e-3);
}

TEST(SphereGrid, EveryDirectionLiesInATriangleOfItsNodes) {
  for (const int parts : {1, 2, 3, 7}) {
    const SphereGrid grid(parts);
    EXPECT_EQ(grid.size(), static_cast<std::size_t>(4 * parts * parts + 2));
    EXPECT_EQ(grid.edges().size(), static_cast<std::size_t>(12 * parts * parts));
    for (int i = 0; i < 2000; ++i) {
      const double z = -1 + 2 * (i + 0.5) / 2000, a = 2.399963 * i, r = std::sqrt(1 - z * z);
      const Eigen::Vector3d d(r * std::cos(a), r * std::sin(a), z);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      double sum = 0;
      for (const auto& [node, weight] : grid.Around(d)) {
        ASSERT_GE(node, 0);
        ASSERT_GE(weight, 0);
        sum += weight;
        // The lattice point of the node, not its direction: that is what the weights are barycentric in.
        const Eigen::Vector3d& n = grid.Direction(static_cast<std::size_t>(node));
        mean += weight * n / n.lpNorm<1>();
      }
      ASSERT_NEAR(sum, 1, 1e-12);
      ASSERT_LT((mean - d / d.lpNorm<1>()).norm(), 1e-12);
    }
  }
}

TEST(SibrUlr, FourLeastPenaltiesCountByTheirDistanceToTheFourth) {
  std::vector<Eigen::Vector3d> centres = {{-0.5, 0, 0}, {0.3, 0.1, -2}, {1.2, -0.4, 0}, {-1.6, 0.3, 0.5}, {2.4, 0, 0}};
  std::vector<RenderView> views;
  for (const auto& c : centres) views.push_back(CameraAhead(c));
  const World w(views, WallAt(5));
  std::vector<std::pair<double, std::size_t>> penalties;
  for (std::size_t j = 0; j < centres.size(); ++j) {
    const double to_photo = (kPoint - centres[j]).norm(), to_view = kPoint.norm();
    penalties.emplace_back(
        std::max(1e-4, AngleAt(kPoint, {0, 0, 0}, centres[j])) + 0.1 * std::max(1e-4, (to_photo - to_view) / to_photo),
        j);
  }
  std::ranges::sort(penalties);
  std::vector<double> expected(centres.size(), 0.0);
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
    sum += expected[penalties[i].second] = 1 - penalties[i].first / (1.0000001 * penalties[3].first);
  for (double& e : expected) e /= sum;
  ExpectWeights(WeightsAt(w, CameraAhead({0, 0, 0}), kPoint, Of(Algorithm::kSibrUlr)), expected, kWeightTolerance);
}

TEST(SibrUlr, EvenAtAnEpipoleTheOthersCount) {
  const World w({CameraAhead({0, 0, 0}), CameraAhead({0.2, 0, 0}), CameraAhead({-0.2, 0, 0}), CameraAhead({0, 0.4, 0})},
                WallAt(5));
  EXPECT_LT(WeightsAt(w, CameraAhead({0, 0, 0}), kPoint, Of(Algorithm::kSibrUlr))[0], 0.8);
}

// Of a capture of nine, the middle one's view from the other eight.
ImageF WithoutPhoto4(const test::Capture& c, Algorithm method) {
  RenderRequest r;
  r.view = MakeRenderView(c.scene, c.scene.views[4]);
  r.settings = Of(method);
  r.use.assign(9, true);
  r.use[4] = false;
  return MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos)->Render(r);
}

class EveryComparator : public testing::TestWithParam<Algorithm> {};

TEST_P(EveryComparator, RendersAWorldOfOneColourInThatColour) {
  const ImageF image = WithoutPhoto4(test::MakeCapture(9, 48, std::array<std::uint8_t, 3>{200, 90, 40}), GetParam());
  const double expected[] = {200 / 255.0, 90 / 255.0, 40 / 255.0};
  long covered = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (!(image.At(x, y, 3) > 0)) continue;
      ++covered;
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(image.At(x, y, k), expected[k], 1e-5) << x << " " << y;
    }
  EXPECT_GT(covered, 0.95 * image.width * image.height);
}

TEST_P(EveryComparator, IsCloserToThePhotoThanToBlackWithoutIt) {
  const test::Capture c = test::MakeCapture(9, 48);
  const ImageF image = WithoutPhoto4(c, GetParam());
  double error = 0, energy = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int k = 0; k < 3; ++k) {
        const double truth = c.photos[4].levels[0].At(x, y, k) / 255.0;
        error += std::pow(static_cast<double>(image.At(x, y, k)) - truth, 2);
        energy += std::pow(truth, 2);
      }
  EXPECT_LT(error, 0.05 * energy);
}

TEST_P(EveryComparator, GivesTheSameBytesOnAnyNumberOfThreads) {
  const test::Capture c = test::MakeCapture(9, 48);
  const ImageF many = WithoutPhoto4(c, GetParam());
  SetThreadCount(1);
  const ImageF one = WithoutPhoto4(c, GetParam());
  SetThreadCount(0);
  EXPECT_EQ(many.data, one.data);
}

TEST_P(EveryComparator, SettingsToChooseFromAreItsOwnAndBeginAsPublished) {
  const std::vector<RadianceSettings> all = SettingsToChooseFrom(GetParam(), {});
  EXPECT_LE(all.size(), 12u);
  EXPECT_EQ(all.front(), Of(GetParam()));
  for (const RadianceSettings& s : all) {
    EXPECT_EQ(ProblemOf(s), "");
    EXPECT_EQ(Validate(s), "");
  }
}

INSTANTIATE_TEST_SUITE_P(Published, EveryComparator, testing::ValuesIn(Algorithms().begin() + 1, Algorithms().end()),
                         [](const auto& tested) {
                           std::string name(Name(tested.param));
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

TEST(Comparators, AnOptionThatTheMethodDoesNotReadIsRefused) {
  RadianceSettings s = Of(Algorithm::kHeigl1999);
  s.method_count = 3;
  EXPECT_THAT(ProblemOf(s), testing::HasSubstr("--method-count means nothing to --method heigl-1999"));
  s = Of(Algorithm::kWood2000);
  s.grid_columns = s.grid_rows = 25;
  EXPECT_THAT(Validate(s), testing::HasSubstr("--grid"));
}

}  // namespace
}  // namespace lumi
