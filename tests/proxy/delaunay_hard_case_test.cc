#include <gtest/gtest.h>

#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/hull/soundness.h"
#include "proxy/mesh_query.h"
#include "scene/program/error.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

// What holds for every scene that is not refused.
void ExpectUsable(const Scene& scene, const DelaunayOptions& options = {}, const std::string& what = "") {
  DelaunaySummary summary;
  const Mesh mesh = BuildDelaunayProxy(scene, options, SilentProgress(), &summary);
  EXPECT_EQ(Validate(mesh), std::nullopt) << what;
  EXPECT_TRUE(IsClosed(mesh)) << what;
  const Soundness sound = CheckSoundness(mesh);
  EXPECT_TRUE(sound.manifold) << what;
  EXPECT_EQ(sound.degenerate_faces, 0u) << what;
  const std::vector<ProxyView> views = MakeProxyViews(scene);
  const MeshFit fit = MeasureFit(mesh, views, SelectPoints(scene, views, options.points).points);
  EXPECT_EQ(fit.coverage, 1.0) << what;
  EXPECT_EQ(fit.front_fraction, 1.0) << what;
}

SceneBuilder Row(std::uint64_t seed) {
  SceneBuilder builder(seed);
  for (int i = 0; i < 5; ++i) builder.AddCamera({i * 0.4 - 0.8, 0.05 * (i % 2), 0}, {0, 0, 4});
  return builder;
}

TEST(DelaunayHardCase, CoplanarPointsApproachedStepByStep) {
  for (double depth = 1e-2; depth > 1e-16; depth *= 0.1) {
    SceneBuilder builder = Row(1);
    for (int i = 0; i < 200; ++i)
      builder.AddPoint({2 * builder.Random() - 1, 2 * builder.Random() - 1, 4 + depth * builder.Random()});
    ExpectUsable(builder.Build(), {}, "depth " + std::to_string(depth));
  }
}

TEST(DelaunayHardCase, ExactlyCoplanarGridOfCocircularPoints) {
  SceneBuilder builder = Row(2);
  for (int i = -8; i <= 8; ++i) {
    for (int j = -8; j <= 8; ++j) builder.AddPoint({i * 0.125, j * 0.125, 4});
  }
  ExpectUsable(builder.Build());
}

TEST(DelaunayHardCase, CollinearPoints) {
  SceneBuilder builder = Row(3);
  for (int i = -20; i <= 20; ++i) builder.AddPoint({i * 0.05, 0, 4});
  ExpectUsable(builder.Build());
}

TEST(DelaunayHardCase, CoincidentPointsAreOneAndRefused) {
  SceneBuilder builder = Row(4);
  for (int i = 0; i < 50; ++i) builder.AddPoint({0, 0, 4});
  EXPECT_THROW(BuildDelaunayProxy(builder.Build(), {}, SilentProgress()), DataError);
}

TEST(DelaunayHardCase, ManyPairsThatAllButCoincide) {
  for (double gap = 1e-2; gap > 1e-16; gap *= 0.1) {
    SceneBuilder builder = Row(5);
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector3d x(2 * builder.Random() - 1, builder.Random(), 4 + 0.1 * builder.Random());
      builder.AddPoint(x);
      builder.AddPoint(x + gap * Eigen::Vector3d(1, 1, 1));
    }
    DelaunayOptions options;
    options.merge_px = 0;  // so that the triangulation sees the pairs
    ExpectUsable(builder.Build(), options, "gap " + std::to_string(gap));
  }
}

TEST(DelaunayHardCase, FourPointsAreEnoughThreeAreNot) {
  SceneBuilder builder = Row(6);
  builder.AddPoint({0, 0, 4});
  builder.AddPoint({0.5, 0, 4});
  builder.AddPoint({0, 0.5, 4});
  try {
    BuildDelaunayProxy(builder.Build(), {}, SilentProgress());
    FAIL() << "three points were taken";
  } catch (const DataError& e) {
    EXPECT_NE(e.hint().find("plane"), std::string::npos) << e.hint();
  }
  builder.AddPoint({0, 0, 4.5});
  ExpectUsable(builder.Build());
}

TEST(DelaunayHardCase, OneCameraIsRefused) {
  SceneBuilder builder(7);
  builder.AddCamera({0, 0, 0}, {0, 0, 4});
  Scene scene = builder.Build();
  for (int i = 0; i < 30; ++i) {
    Point p;
    p.x_in_world = Eigen::Vector3d(0.05 * i, 0.01 * i * i, 4);
    p.track = {SeenBy(0)};
    scene.points.push_back(p);
  }
  EXPECT_THROW(BuildDelaunayProxy(scene, {}, SilentProgress()), DataError);
}

TEST(DelaunayHardCase, CamerasAtOnePlaceAreRefused) {
  SceneBuilder builder(8);
  for (int i = 0; i < 4; ++i) builder.AddCamera({0, 0, 0}, {0.1 * i, 0, 4});
  builder.AddSurface({{0, 0, 4}, {1, 0, 0}, {0, 1, 0}}, 100);
  EXPECT_THROW(BuildDelaunayProxy(builder.Build(), {}, SilentProgress()), DataError);
}

TEST(DelaunayHardCase, CamerasAmongThePoints) {
  Scene scene = BoxRoom(40, 9);
  ExpectUsable(scene);
  // A point in the very place of a camera, seen by two others.
  Point p;
  p.x_in_world = scene.views[0].CentreInWorld();
  p.error_px = 0.5;
  for (const std::int32_t v : {10, 12, 14}) p.track.push_back(SeenBy(v));
  scene.points.push_back(p);
  const Mesh mesh = BuildDelaunayProxy(scene, {}, SilentProgress());
  EXPECT_TRUE(IsClosed(mesh));
}

TEST(DelaunayHardCase, NotANumberNeverReachesTheMesh) {
  Scene scene = PlateBeforeWall(200, 30, 10);
  for (std::size_t i = 0; i < scene.points.size(); i += 7) {
    scene.points[i].x_in_world[static_cast<int>(i % 3)] =
        i % 2 ? std::nan("") : std::numeric_limits<double>::infinity();
  }
  ExpectUsable(scene);
}

TEST(DelaunayHardCase, FarFromTheOriginItIsTheSameMesh) {
  const Scene scene = PlateBeforeWall(300, 50, 11);
  const Mesh here = BuildDelaunayProxy(scene, {}, SilentProgress());
  for (double offset = 1; offset <= 1e6; offset *= 10) {
    const Scene far = Moved(scene, 1, {offset, offset, -offset});
    ExpectUsable(far, {}, "offset " + std::to_string(offset));
    const Mesh there = BuildDelaunayProxy(far, {}, SilentProgress());
    // The wall is coplanar to rounding only, so slivers may differ; the amount of surface may not.
    EXPECT_NEAR(static_cast<double>(there.faces.size()), static_cast<double>(here.faces.size()),
                0.02 * static_cast<double>(here.faces.size()))
        << offset;
  }
}

TEST(DelaunayHardCase, AnySizeOfTheWorld) {
  const Scene scene = PlateBeforeWall(300, 50, 12);
  for (const double scale : {1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9})
    ExpectUsable(Moved(scene, scale, {0, 0, 0}), {}, "scale " + std::to_string(scale));
}

TEST(DelaunayHardCase, APointVeryFarAway) {
  for (double far = 1e1; far <= 1e8; far *= 10) {
    Scene scene = PlateBeforeWall(300, 50, 13);
    Point p = scene.points.front();
    p.x_in_world = Eigen::Vector3d(0.5, 2, 4).normalized() * far;
    scene.points.push_back(p);
    DelaunayOptions options;
    options.points.min_angle_deg = 0;
    options.points.max_neighbour_ratio = 1e18;
    ExpectUsable(scene, options, "far " + std::to_string(far));
  }
}

}  // namespace
}  // namespace lumi::test
