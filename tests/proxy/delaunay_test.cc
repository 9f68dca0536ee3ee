#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/leave_out.h"
#include "proxy/mesh_query.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

MeshFit FitOf(const Mesh& mesh, const Scene& scene) {
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  return MeasureFit(mesh, views, SelectPoints(scene, views, {}).points);
}

TEST(Delaunay, RoomIsFoundWhereItsWallsAre) {
  const Scene scene = BoxRoom(300, 1);
  DelaunaySummary summary;
  const Mesh mesh = BuildDelaunayProxy(scene, {}, SilentProgress(), &summary);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_EQ(Validate(mesh), std::nullopt);

  // Points lie exactly on the walls, so rays may miss them only where a facet cuts a corner or bridges two samples:
  // the spacing of 300 points on a wall of 4 x 4 is 0.23.
  const double kTolerance = 0.12;
  const MeshQuery query(mesh);
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  int rays = 0, near_wall = 0;
  for (const ProxyView& view : views) {
    for (double x = 20; x < 640; x += 40) {
      for (double y = 20; y < 480; y += 40) {
        const Eigen::Vector3d direction = *RayDirection(view.render.P, {x, y});
        const auto hit = query.FirstHit(view.render.centre, direction);
        ASSERT_TRUE(hit.has_value());
        near_wall += DistanceToBoxRoom(view.render.centre + hit->distance * direction) < kTolerance;
        ++rays;
      }
    }
  }
  EXPECT_GE(near_wall, 0.99 * rays) << near_wall << " of " << rays;
}

TEST(Delaunay, EveryRayOfEveryViewMeetsAFrontFaceCornersIncluded) {
  for (const Scene& scene : {BoxRoom(60, 2), PlateBeforeWall(400, 60, 3)}) {
    const Mesh mesh = BuildDelaunayProxy(scene, {}, SilentProgress());
    const MeshFit fit = FitOf(mesh, scene);
    EXPECT_EQ(fit.coverage, 1.0);
    EXPECT_EQ(fit.coverage_min, 1.0);
    EXPECT_EQ(fit.front_fraction, 1.0);
  }
}

// How near a line of sight passes to the plate's outline (PlateBeforeWall), in the plate's plane.
double ClearanceOfPlate(const Eigen::Vector3d& eye, const Eigen::Vector3d& x) {
  const Eigen::Vector3d p = eye + (x - eye) * ((2 - eye.z()) / (x.z() - eye.z()));
  return std::max(std::abs(p.x()), std::abs(p.y())) - 0.5;
}

TEST(Delaunay, NoSheetAcrossSpaceThatACameraSawAPointThrough) {
  const Scene scene = PlateBeforeWall(1500, 200, 4);
  DelaunaySummary summary;
  const Mesh mesh = BuildDelaunayProxy(scene, {}, SilentProgress(), &summary);
  EXPECT_GT(summary.rays, 5000u);
  // Facets end at points, and the plate's outline runs between them: a few lines of sight that graze it are lost.
  // The ones that pass it clearly (by more than the spacing of its points, 0.07) must all be open.
  const double kGrazing = 0.15;
  EXPECT_LT(summary.blocked_ray_fraction, 0.02);
  const MeshQuery query(mesh);
  int clear = 0, blocked = 0;
  for (const Point& point : scene.points) {
    for (const Observation& o : point.track) {
      if (point.x_in_world.z() < 3) continue;  // on the plate itself
      const Eigen::Vector3d eye = scene.views[static_cast<std::size_t>(o.view.value)].CentreInWorld();
      if (ClearanceOfPlate(eye, point.x_in_world) < kGrazing) continue;
      const auto hit = query.FirstHit(eye, point.x_in_world - eye);
      ++clear;
      blocked += hit && hit->distance < 0.98;
    }
  }
  EXPECT_GT(clear, 3500);
  EXPECT_EQ(blocked, 0) << "of " << clear;
  const MeshFit fit = FitOf(mesh, scene);
  EXPECT_NEAR(fit.blocked_ray_fraction, summary.blocked_ray_fraction, 0.005);  // two ways to count the same
  EXPECT_LT(fit.distance_median, 1e-9);                                        // the mesh passes through the points

  // And the plate is there: rays at its middle meet it, not the wall.
  const Eigen::Vector3d eye(0, 0, 0);
  for (const double x : {-0.3, 0.0, 0.3}) {
    for (const double y : {-0.3, 0.0, 0.3}) {
      const auto hit = query.FirstHit(eye, Eigen::Vector3d(x, y, 2));
      ASSERT_TRUE(hit.has_value());
      EXPECT_NEAR(hit->distance * 2, 2, 0.05);
    }
  }
  // Beside it, the wall: the middle between plate and the wall's border.
  for (const double x : {-2.5, 2.5}) {
    const auto hit = query.FirstHit(eye, Eigen::Vector3d(x, 0, 4));
    ASSERT_TRUE(hit.has_value());
    EXPECT_NEAR(hit->distance * 4, 4, 0.05);
  }
}

TEST(Delaunay, NoisyPointsBlockFewLinesOfSight) {
  const Scene exact = PlateBeforeWall(1500, 200, 5);
  Scene scene = exact;
  SceneBuilder noise(6);
  for (Point& p : scene.points) {
    p.x_in_world += 0.02 * Eigen::Vector3d(noise.Random() - 0.5, noise.Random() - 0.5, noise.Random() - 0.5);
  }
  const MeshFit fit = FitOf(BuildDelaunayProxy(scene, {}, SilentProgress()), scene);
  EXPECT_LT(fit.blocked_ray_fraction, 0.04);
  EXPECT_EQ(fit.coverage, 1.0);
}

// A row of cameras along an arc before a wall, with a wall to its right that only the pictures' borders show, as in a
// yard. The outermost camera is left out: it is not there at all, or as WithPhotos leaves it out.
TEST(Delaunay, NoWallBesideThePhotosWhereNoneLooks) {
  const Eigen::Vector3d target(0, 0, 4);
  const auto on_arc = [&](int i) {
    const double angle_rad = 0.13 * i;
    return Eigen::Vector3d(target + 5 * Eigen::Vector3d(std::sin(angle_rad), 0, -std::cos(angle_rad)));
  };
  const int kLeftOut = 5;
  for (const bool registered : {false, true}) {
    int seen = 0, blocked = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      SceneBuilder builder(seed);
      for (int i = -kLeftOut; i < kLeftOut + registered; ++i) builder.AddCamera(on_arc(i), target);
      builder.AddSurface({{0, 0, 4}, {4, 0, 0}, {0, 2, 0}}, 1500);
      builder.AddSurface({{4, 0, 2}, {0, 0, 2}, {0, 2, 0}}, 1500);
      builder.AddSurface({{0, 1.2, 2}, {4, 0, 0}, {0, 0, 2}}, 1500);
      Scene scene = builder.Build();
      if (registered) {
        std::vector<bool> keep(scene.views.size(), true);
        keep.back() = false;
        scene = WithPhotos(scene, keep);
      }
      const Mesh mesh = BuildDelaunayProxy(scene, {}, SilentProgress());
      const MeshQuery query(mesh);
      const Eigen::Vector3d eye = on_arc(kLeftOut);
      for (const Point& point : scene.points) {
        if (point.x_in_world.z() < 3.999 || std::abs(point.x_in_world.x()) > 2) continue;
        const auto hit = query.FirstHit(eye, point.x_in_world - eye);
        ++seen;
        blocked += !hit || !hit->front || hit->distance < 0.98;
      }
    }
    EXPECT_GT(seen, 4000);
    // Some lines of sight graze a facet between two points. Where unseen space was full, most were blocked.
    EXPECT_LT(blocked, 0.01 * seen) << "of " << seen << (registered ? ", left out" : ", not there");
  }
}

TEST(Delaunay, StrayPointDoesNotPullTheSurface) {
  Scene scene = PlateBeforeWall(1500, 200, 7);
  // A mismatch in mid-air, claimed by two views only, before a wall that all views see.
  Point stray;
  stray.x_in_world = Eigen::Vector3d(1.2, 0.4, 1.0);
  stray.error_px = 0.5;
  stray.track = {SeenBy(3), SeenBy(6)};
  scene.points.push_back(stray);
  DelaunayOptions options;
  options.points.min_track = 2;  // so that it is not refused for its short track
  options.points.max_neighbour_ratio = 1e9;
  const Mesh mesh = BuildDelaunayProxy(scene, options, SilentProgress());
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& v : mesh.vertices) nearest = std::min(nearest, (v - stray.x_in_world).norm());
  EXPECT_GT(nearest, 0.5);
}

TEST(Delaunay, SameInputGivesTheSameMeshWithAnyNumberOfThreads) {
  const Scene scene = PlateBeforeWall(800, 100, 8);
  const Mesh first = BuildDelaunayProxy(scene, {}, SilentProgress());
  for (const int threads : {1, 3}) {
    SetThreadCount(threads);
    const Mesh again = BuildDelaunayProxy(scene, {}, SilentProgress());
    EXPECT_TRUE(again.vertices == first.vertices);
    EXPECT_TRUE(again.faces == first.faces);
  }
  SetThreadCount(0);
}

TEST(Delaunay, RefusesOptionsOutOfRange) {
  const Scene scene = PlateBeforeWall(50, 10, 9);
  DelaunayOptions options;
  options.dome_factor = 1;
  EXPECT_THROW(BuildDelaunayProxy(scene, options, SilentProgress()), UsageError);
  options = {};
  options.merge_px = std::nan("");
  EXPECT_THROW(BuildDelaunayProxy(scene, options, SilentProgress()), UsageError);
}

TEST(Points, ThoseThatCannotBeTrustedAreLeftOutAndCounted) {
  Scene scene = PlateBeforeWall(600, 100, 10);
  const std::size_t good = scene.points.size();
  Point bad = scene.points.front();
  bad.x_in_world.x() = std::nan("");
  scene.points.push_back(bad);
  bad = scene.points.front();
  bad.track.resize(1);
  scene.points.push_back(bad);
  bad = scene.points.front();
  bad.x_in_world = Eigen::Vector3d(0, 0, -5);  // behind every camera
  scene.points.push_back(bad);
  bad = scene.points.front();
  bad.error_px = 20;
  scene.points.push_back(bad);
  bad = scene.points.front();
  bad.x_in_world *= 1000;  // rays all but parallel
  scene.points.push_back(bad);
  const PointSelection selection = SelectPoints(scene, MakeProxyViews(scene), {});
  EXPECT_EQ(selection.total, good + 5);
  EXPECT_EQ(selection.unusable, 3u);
  EXPECT_EQ(selection.inaccurate, 2u);
  EXPECT_EQ(selection.points.size(), good - selection.isolated);
}

TEST(Points, CoincidentOnesBecomeOneWithAllTheirViews) {
  ProxyPoint p;
  p.x_in_world = Eigen::Vector3d(1, 2, 3);
  p.footprint = 0.01;
  p.sigma = 0.01;
  p.views = {0, 1, 2};
  ProxyPoint q = p;
  q.x_in_world.x() += 0.015;
  q.views = {1, 4};
  ProxyPoint far = p;
  far.x_in_world.x() += 0.05;
  const auto merged = MergePoints({q, p, far}, 2);
  ASSERT_EQ(merged.size(), 2u);
  EXPECT_EQ(merged[0].x_in_world, p.x_in_world);
  EXPECT_THAT(merged[0].views, testing::ElementsAre(0, 1, 2, 4));
  EXPECT_EQ(MergePoints({p, p, p}, 0).size(), 1u);
}

TEST(Points, NeighbourDistanceAgreesWithBruteForce) {
  SceneBuilder random(11);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 300; ++i) points.emplace_back(random.Random(), random.Random(), 0.1 * random.Random());
  points.push_back(points.front());
  const std::vector<double> mean = MeanNeighbourDistance(points, 5);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::vector<double> d;
    for (std::size_t j = 0; j < points.size(); ++j) {
      if (j != i) d.push_back((points[i] - points[j]).norm());
    }
    std::sort(d.begin(), d.end());
    EXPECT_NEAR(mean[i], (d[0] + d[1] + d[2] + d[3] + d[4]) / 5, 1e-12);
  }
}

}  // namespace
}  // namespace lumi::test
