// Every mesh that is made is 2-manifold, oriented and without degenerate faces, and closed where its kind promises it:
// judged by CGAL.
#include <gtest/gtest.h>

#include "proxy/box/box_proxy.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/hull/soundness.h"
#include "proxy/mesh_query.h"
#include "proxy/plane/plane_proxy.h"
#include "proxy/planes/planes_proxy.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

void ExpectSoundMesh(const Mesh& mesh, bool closed, const std::string& what) {
  const Soundness s = CheckSoundness(mesh);
  EXPECT_TRUE(s.manifold) << what << ": " << s.Describe();
  EXPECT_EQ(s.degenerate_faces, 0U) << what;
  EXPECT_FALSE(mesh.faces.empty()) << what;
  EXPECT_TRUE(s.closed || !closed) << what;
}

// Clutter: rectangles of all turns amid a room, so that sheets meet at edges and corners.
Scene Clutter(std::uint64_t seed, int rectangles) {
  SceneBuilder builder(seed);
  for (int i = 0; i < 12; ++i)
    builder.AddCamera({2.5 * std::cos(i * 0.5), 0.3 * (i % 3), 2.5 * std::sin(i * 0.5)}, {0, 0, 0});
  for (int i = 0; i < rectangles; ++i) {
    Eigen::Vector3d c, a, b;
    for (Eigen::Vector3d* v : {&c, &a, &b})
      for (int k = 0; k < 3; ++k) (*v)[k] = 2 * builder.Random() - 1;
    builder.AddSurface({0.8 * c, 0.4 * a, 0.4 * b}, 40);
  }
  return builder.Build();
}

TEST(Soundness, DelaunayMeshesOfManyScenes) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    ExpectSoundMesh(BuildDelaunayProxy(Clutter(seed, 8), {}, SilentProgress()), true,
                    "clutter " + std::to_string(seed));
    ExpectSoundMesh(BuildDelaunayProxy(BoxRoom(20 + 10 * static_cast<int>(seed), seed), {}, SilentProgress()), true,
                    "room " + std::to_string(seed));
  }
  for (const double scale : {1e-6, 1e6})
    ExpectSoundMesh(BuildDelaunayProxy(Moved(Clutter(3, 8), scale, {0, 0, 0}), {}, SilentProgress()), true,
                    "scale " + std::to_string(scale));
  for (const double offset : {1e3, 1e6})
    ExpectSoundMesh(BuildDelaunayProxy(Moved(Clutter(4, 8), 1, {offset, -offset, offset}), {}, SilentProgress()), true,
                    "offset " + std::to_string(offset));
}

TEST(Soundness, PlanePlanesAndBox) {
  for (const double scale : {1e-6, 1.0, 1e6}) {
    const Scene plate = Moved(PlateBeforeWall(600, 150, 5), scale, {0, 0, 0}),
                room = Moved(BoxRoom(120, 6), scale, {0, 0, 0});
    ExpectSoundMesh(BuildPlaneProxy(plate, {}), false, "plane");
    ExpectSoundMesh(BuildPlanesProxy(plate, {}), false, "planes");
    ExpectSoundMesh(BuildPlanesProxy(room, {}), false, "planes of a room");
  }
  SceneBuilder builder(7);
  for (int i = 0; i < 10; ++i) builder.AddCamera({0.1 * (i % 2), 0, 0.8 * i}, {0, 0, 20});
  for (const double s : {-1.0, 1.0}) {
    builder.AddSurface({{1.5 * s, 0, 8}, {0, 1, 0}, {0, 0, 8}}, 300);
    builder.AddSurface({{0, s, 8}, {1.5, 0, 0}, {0, 0, 8}}, 300);
  }
  builder.AddSurface({{0, 0, 16}, {1.5, 0, 0}, {0, 1, 0}}, 100);
  const Scene tube = builder.Build();
  for (const int sides : {4, 5, 6}) {
    BoxOptions options;
    options.sides = sides;
    ExpectSoundMesh(BuildBoxProxy(tube, options), sides == 6, std::to_string(sides) + " sides");
  }
}

TEST(MeshQuery, LayersAreCountedOnceAtEdges) {
  Mesh two;  // squares at z = 1 and z = 2, each of two triangles whose common edge runs through the middle
  for (const double z : {1.0, 2.0})
    for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}}) two.vertices.emplace_back(x, y, z);
  two.faces = {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}};
  const MeshQuery query(two);
  EXPECT_EQ(query.Layers({0, 0, 0}, {0, 0, 1}), 2);
  EXPECT_EQ(query.Layers({0.3, -0.2, 0}, {0, 0, 5}), 2);
  EXPECT_EQ(query.Layers({0.3, -0.2, 1.5}, {0, 0, 1}), 1);
  EXPECT_EQ(query.Layers({3, 0, 0}, {0, 0, 1}), 0);
  EXPECT_EQ(query.FirstHit({0.3, -0.2, 0}, {0, 0, 1})->face, 0);
  const MeshQuery::Nearest nearest = query.NearestTo({0.2, 0.1, 1.2});
  EXPECT_LT((nearest.point - Eigen::Vector3d(0.2, 0.1, 1)).norm(), 1e-12);
  EXPECT_NEAR(std::abs(nearest.normal.z()), 1, 1e-12);
}

}  // namespace
}  // namespace lumi::test
