#include <gtest/gtest.h>

#include "proxy/mesh_query.h"
#include "proxy/plane/plane_proxy.h"
#include "scene/geometry/angle.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

MeshFit PlaneFit(const Mesh& mesh, const Scene& scene) { return MeasureFit(mesh, MakeProxyViews(scene), {}); }

TEST(Plane, FacesTheViewsAtTheMedianDepth) {
  SceneBuilder builder(1);
  for (int i = 0; i < 5; ++i) builder.AddCamera({i * 0.3 - 0.6, 0, 0}, {i * 0.3 - 0.6, 0, 4});
  builder.AddSurface({{0, 0, 4}, {2, 0, 0}, {0, 1, 0}}, 400);
  const Scene scene = builder.Build();
  PlaneSummary summary;
  const Mesh mesh = BuildPlaneProxy(scene, {}, &summary);
  EXPECT_NEAR(summary.depth, 4, 1e-9);
  EXPECT_NEAR(AngleBetween(summary.normal, Eigen::Vector3d(0, 0, -1)), 0, 1e-9);
  ASSERT_EQ(mesh.faces.size(), 2u);
  EXPECT_GT(mesh.FaceNormal(0).dot(summary.normal), 0.999);
  EXPECT_GT(mesh.FaceNormal(1).dot(summary.normal), 0.999);
  const MeshFit fit = PlaneFit(mesh, scene);
  EXPECT_EQ(fit.coverage_min, 1.0);
  EXPECT_EQ(fit.front_fraction, 1.0);
}

TEST(Plane, CoversObliqueViewsToTheirCorners) {
  SceneBuilder builder(2);
  for (int i = 0; i < 7; ++i) builder.AddCamera({i - 3.0, 0, 0}, {0.5 * (i - 3.0), 0, 3});
  builder.AddSurface({{0, 0, 3}, {3, 0, 0}, {0, 2, 0}}, 500);
  const Scene scene = builder.Build();
  EXPECT_EQ(PlaneFit(BuildPlaneProxy(scene, {}), scene).coverage_min, 1.0);
}

TEST(Plane, OneMadDepthDoesNotMoveIt) {
  SceneBuilder builder(3);
  for (int i = 0; i < 3; ++i) builder.AddCamera({i * 0.5, 0, 0}, {i * 0.5, 0, 5});
  builder.AddSurface({{0, 0, 5}, {1, 0, 0}, {0, 1, 0}}, 100);
  builder.AddPoint({0.5, 0, 0.9});
  PlaneSummary summary;
  BuildPlaneProxy(builder.Build(), {}, &summary);
  EXPECT_NEAR(summary.depth, 5, 1e-9);
}

TEST(MeshQuery, MeetsATriangleWhereGeometrySays) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 2}, {1, 0, 2}, {0, 1, 2}};
  mesh.faces = {{0, 2, 1}};  // looks towards -z
  const MeshQuery query(mesh);
  const auto hit = query.FirstHit({0.25, 0.25, 0}, {0, 0, 4});
  ASSERT_TRUE(hit.has_value());
  EXPECT_NEAR(hit->distance, 0.5, 1e-12);
  EXPECT_TRUE(hit->front);
  const auto back = query.FirstHit({0.25, 0.25, 4}, {0, 0, -1});
  ASSERT_TRUE(back.has_value());
  EXPECT_FALSE(back->front);
  EXPECT_FALSE(query.FirstHit({0.75, 0.75, 0}, {0, 0, 1}).has_value());
  EXPECT_FALSE(query.FirstHit({0.25, 0.25, 0}, {0, 0, -1}).has_value());
  EXPECT_NEAR(query.Distance({0.25, 0.25, 5}), 3, 1e-12);
}

// A sheet without thickness has a front and a back at one place, whichever the tree finds first.
TEST(MeshQuery, OfFacesAtOneDistanceAFrontOneIsNamed) {
  for (const double scale : {1e-9, 1.0, 1e9})
    for (const double offset : {0.0, 1e6}) {
      const Eigen::Vector3d far(offset * scale, -offset * scale, offset * scale);
      Mesh mesh;
      for (const Eigen::Vector3d& x : {Eigen::Vector3d(0, 0, 2), {1, 0, 2}, {0, 1, 2}})
        mesh.vertices.push_back(far + scale * x);
      mesh.faces = {{0, 1, 2}, {0, 2, 1}, {0, 1, 2}};  // the second looks towards -z
      const auto hit = MeshQuery(mesh).FirstHit(far + scale * Eigen::Vector3d(0.25, 0.25, 0), {0, 0, 1});
      ASSERT_TRUE(hit.has_value());
      EXPECT_TRUE(hit->front) << scale << ", " << offset;
      EXPECT_EQ(hit->face, 1) << scale << ", " << offset;
      // Well apart, the nearer one counts, from behind too.
      mesh.vertices.insert(mesh.vertices.end(),
                           {far + scale * Eigen::Vector3d(0, 0, 3), far + scale * Eigen::Vector3d(1, 0, 3),
                            far + scale * Eigen::Vector3d(0, 1, 3)});
      mesh.faces = {{0, 1, 2}, {3, 5, 4}};
      const auto back = MeshQuery(mesh).FirstHit(far + scale * Eigen::Vector3d(0.25, 0.25, 0), {0, 0, 1});
      ASSERT_TRUE(back.has_value());
      EXPECT_FALSE(back->front);
      EXPECT_EQ(back->face, 0);
    }
}

TEST(MeshQuery, EmptyAndDegenerateMeshesAreMetByNothing) {
  const Mesh empty;
  EXPECT_FALSE(MeshQuery(empty).FirstHit({0, 0, 0}, {0, 0, 1}).has_value());
  EXPECT_TRUE(std::isinf(MeshQuery(empty).Distance({0, 0, 0})));
  Mesh flat;
  flat.vertices = {{0, 0, 2}, {1, 0, 2}, {2, 0, 2}};
  flat.faces = {{0, 1, 2}};
  EXPECT_FALSE(MeshQuery(flat).FirstHit({0.5, 0, 0}, {0, 0, 1}).has_value());
}

}  // namespace
}  // namespace lumi::test
