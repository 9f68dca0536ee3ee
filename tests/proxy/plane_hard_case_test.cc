#include <gtest/gtest.h>

#include "proxy/mesh_query.h"
#include "proxy/plane/plane_proxy.h"
#include "scene/program/error.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

MeshFit PlaneFit(const Mesh& mesh, const Scene& scene) { return MeasureFit(mesh, MakeProxyViews(scene), {}); }

TEST(PlaneHardCase, OnePointIsEnough) {
  SceneBuilder builder(4);
  builder.AddCamera({0, 0, 0}, {0, 0, 3});
  Scene scene = builder.Build();
  Point point;
  point.x_in_world = Eigen::Vector3d(0.1, 0, 3);
  point.track = {SeenBy(0)};
  scene.points = {point};
  PlaneSummary summary;
  const Mesh mesh = BuildPlaneProxy(scene, {}, &summary);
  EXPECT_NEAR(summary.depth, 3, 1e-12);
  EXPECT_EQ(PlaneFit(mesh, scene).coverage, 1.0);
}

TEST(PlaneHardCase, WithoutPointsTheCamerasSpacingSaysHowFar) {
  SceneBuilder builder(5);
  for (int i = 0; i < 4; ++i) builder.AddCamera({i * 0.2, 0, 0}, {i * 0.2, 0, 3});
  PlaneSummary summary;
  BuildPlaneProxy(builder.Build(), {}, &summary);
  EXPECT_NEAR(summary.depth, 1.0, 1e-12);  // five times 0.2
  EXPECT_EQ(summary.points_used, 0u);
}

TEST(PlaneHardCase, NoLengthAtAllIsRefused) {
  SceneBuilder builder(6);
  builder.AddCamera({0, 0, 0}, {0, 0, 3});
  EXPECT_THROW(BuildPlaneProxy(builder.Build(), {}), DataError);
  builder.AddCamera({0, 0, 0}, {1, 0, 3});
  EXPECT_THROW(BuildPlaneProxy(builder.Build(), {}), DataError);
  EXPECT_THROW(BuildPlaneProxy(Scene{}, {}), DataError);
}

TEST(PlaneHardCase, ViewsInOppositeDirectionsGiveAFiniteQuad) {
  for (double turn = 1e-2; turn > 1e-16; turn *= 0.1) {
    SceneBuilder builder(7);
    builder.AddCamera({0, 0, 0}, {0, 0, 3});
    builder.AddCamera({1, 0, 0}, {1 + turn, 0, -3});
    builder.AddPoint({0, 0, 3});
    Scene scene = builder.Build();
    Point point;
    point.x_in_world = Eigen::Vector3d(0, 0, 3);
    scene.points = {point};
    PlaneSummary summary;
    const Mesh mesh = BuildPlaneProxy(scene, {}, &summary);
    EXPECT_EQ(Validate(mesh), std::nullopt) << turn;
    EXPECT_NEAR(summary.normal.norm(), 1, 1e-12) << turn;
  }
}

TEST(PlaneHardCase, FarFromTheOriginItIsTheSamePlane) {
  SceneBuilder builder(8);
  for (int i = 0; i < 5; ++i) builder.AddCamera({i * 0.3, 0, 0}, {i * 0.3, 0, 4});
  builder.AddSurface({{0, 0, 4}, {2, 0, 0}, {0, 1, 0}}, 100);
  const Scene scene = builder.Build();
  PlaneSummary here, there;
  BuildPlaneProxy(scene, {}, &here);
  for (double offset = 1; offset <= 1e9; offset *= 10) {
    const Mesh mesh = BuildPlaneProxy(Moved(scene, 1, {offset, -offset, offset}), {}, &there);
    // Coordinates of size `offset` carry an error of epsilon * offset; a handful of them add up.
    EXPECT_NEAR(there.depth, here.depth, 100 * 2.3e-16 * offset + 1e-12) << offset;
    EXPECT_EQ(Validate(mesh), std::nullopt);
  }
}

}  // namespace
}  // namespace lumi::test
