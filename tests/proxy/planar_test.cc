// Boxes and planes against scenes whose walls are known.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "proxy/box/box_proxy.h"
#include "proxy/mesh_query.h"
#include "proxy/planes/planes_json.h"
#include "proxy/planes/planes_proxy.h"
#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

using Eigen::Vector3d;

constexpr double kHalfWidth = 1.1, kHalfHeight = 1.4, kLength = 20;

// A hallway along z of 2.2 x 2.8, its end wall at 20; cameras drive down its first half, a hand's breadth off the
// middle. `clutter`: points that stand about in it. `walls`: of left, right, upper and lower.
Scene Hallway(int points_a_wall, int clutter, std::array<bool, 4> walls = {true, true, true, true}, double noise = 0) {
  SceneBuilder builder(11);
  for (int i = 0; i < 30; ++i) builder.AddCamera({0.1, 0.05, 0.35 * i}, {0.1, 0.05, 0.35 * i + 5});
  const Vector3d x = kHalfWidth * Vector3d::UnitX(), y = kHalfHeight * Vector3d::UnitY(),
                 z = kLength / 2 * Vector3d::UnitZ();
  if (walls[0]) builder.AddSurface({z - x, y, z}, points_a_wall);
  if (walls[1]) builder.AddSurface({z + x, y, z}, points_a_wall);
  if (walls[2]) builder.AddSurface({z - y, x, z}, points_a_wall);
  if (walls[3]) builder.AddSurface({z + y, x, z}, points_a_wall);
  builder.AddSurface({2 * z, x, y}, points_a_wall / 4);
  for (int i = 0; i < clutter; ++i)
    builder.AddPoint({(2 * builder.Random() - 1) * kHalfWidth, (2 * builder.Random() - 1) * kHalfHeight,
                      builder.Random() * kLength});
  Scene scene = builder.Build();
  for (Point& p : scene.points)
    p.x_in_world += noise * Vector3d(builder.Random() - 0.5, builder.Random() - 0.5, builder.Random() - 0.5);
  return scene;
}

Scene Turned(Scene scene, const Eigen::Quaterniond& q) {
  Transform(scene, Similarity3{1, q, Vector3d::Zero()});
  return scene;
}

double FarthestCorner(const Mesh& mesh, const Eigen::Quaterniond& q, double half_width, double half_height) {
  double worst = 0;
  for (const Vector3d& v : mesh.vertices) {
    const Vector3d c = q.conjugate() * v;
    worst = std::max({worst, std::abs(std::abs(c.x()) - half_width), std::abs(std::abs(c.y()) - half_height)});
  }
  return worst;
}

TEST(Box, StandsWhereTheWallsOfAHallwayStand) {
  const Scene scene = Hallway(800, 0);
  BoxSummary summary;
  const Mesh mesh = BuildBoxProxy(scene, {}, &summary);
  EXPECT_EQ(mesh.faces.size(), 12u);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_LT(FarthestCorner(mesh, Eigen::Quaterniond::Identity(), kHalfWidth, kHalfHeight), 1e-3)
      << "the end wall's points along its border have a say";
  EXPECT_NEAR(summary.box_from_world.determinant(), 1, 1e-9);
  EXPECT_NEAR(summary.high.z(), kLength - 5.075, 0.5) << "relative to the mean camera: the end wall";
  const MeshFit fit = MeasureFit(mesh, MakeProxyViews(scene), {});
  EXPECT_EQ(fit.coverage_min, 1.0);
  EXPECT_EQ(fit.front_fraction, 1.0);
}

TEST(Box, LeavesOutWhatStandsAbout) {
  const Scene scene = Hallway(500, 1000, {true, true, true, true}, 0.02);
  EXPECT_LT(FarthestCorner(BuildBoxProxy(scene, {}), Eigen::Quaterniond::Identity(), kHalfWidth, kHalfHeight), 0.02)
      << "the points' own noise";
}

TEST(Box, TurnsAndMovesWithTheWorld) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(1.1, Vector3d(0.3, -0.8, 0.5).normalized()));
  EXPECT_LT(FarthestCorner(BuildBoxProxy(Turned(Hallway(600, 200), q), {}), q, kHalfWidth, kHalfHeight), 0.01);
  const Vector3d far(1e6, -2e6, 3e6);
  const Mesh here = BuildBoxProxy(Hallway(600, 200), {}),
             there = BuildBoxProxy(Moved(Hallway(600, 200), 1e-3, far), {});
  for (std::size_t i = 0; i < 8; ++i) EXPECT_LT((there.vertices[i] - far - 1e-3 * here.vertices[i]).norm(), 1e-8) << i;
}

TEST(Box, IsOpenAtItsEndsWhereAsked) {
  for (const int sides : {4, 5}) {
    BoxOptions options;
    options.sides = sides;
    const Mesh mesh = BuildBoxProxy(Hallway(400, 0), options);
    EXPECT_EQ(mesh.faces.size(), 2u * static_cast<std::size_t>(sides));
    EXPECT_FALSE(IsClosed(mesh));
    const MeshQuery query(mesh);
    EXPECT_EQ(query.FirstHit({0, 0, 5}, Vector3d::UnitZ()).has_value(), sides == 5);
    EXPECT_FALSE(query.FirstHit({0, 0, 5}, -Vector3d::UnitZ()).has_value());
  }
  BoxOptions three;
  three.sides = 3;
  EXPECT_THROW(BuildBoxProxy(Hallway(400, 0), three), UsageError);
}

TEST(BoxHardCase, AWallWithoutPointsStandsWhereTheFarthestEnd) {
  BoxSummary summary;
  const Scene scene = Hallway(600, 100, {true, true, false, true});
  const Mesh mesh = BuildBoxProxy(scene, {}, &summary);
  EXPECT_FALSE(Validate(mesh).has_value());
  EXPECT_LT(summary.wall_points[2], 20u);
  double left = 0, right = 0, lower = 0;
  for (const Vector3d& v : mesh.vertices)
    left = std::min(left, v.x()), right = std::max(right, v.x()), lower = std::max(lower, v.y());
  EXPECT_NEAR(left, -kHalfWidth, 0.02);
  EXPECT_NEAR(right, kHalfWidth, 0.02);
  EXPECT_NEAR(lower, kHalfHeight, 0.02);
  EXPECT_EQ(MeasureFit(mesh, MakeProxyViews(scene), {}).coverage_min, 1.0);
}

TEST(BoxHardCase, CamerasAllAroundHaveNoAxis) { EXPECT_THROW(BuildBoxProxy(BoxRoom(200, 3), {}), DataError); }

TEST(BoxHardCase, FewOrCollinearPointsAreRefusedOrFinite) {
  Scene few = Hallway(600, 0);
  few.points.resize(8);
  EXPECT_THROW(BuildBoxProxy(few, {}), DataError);
  SceneBuilder line(3);
  for (int i = 0; i < 10; ++i) line.AddCamera({0, 0, 0.3 * i}, {0, 0, 0.3 * i + 5});
  for (int i = 0; i < 60; ++i) line.AddPoint({1, 0, 3 + 0.1 * i});
  EXPECT_FALSE(Validate(BuildBoxProxy(line.Build(), {})).has_value());
}

// A square before a wall: ground at y = 1.5 (y points down), backdrop at z = 12.
Scene Square(int ground, int wall, int clutter, double tilt_rad = 0) {
  SceneBuilder builder(5);
  for (int i = 0; i < 12; ++i)
    builder.AddCamera({0.25 * i - 1.4, 0.1 * (i % 3), 0.1 * (i % 2)}, {0.25 * i - 1.4, 0.6, 10});
  builder.AddSurface({{0, 1.5, 6}, {6, 0, 0}, {0, 0, 6}}, ground);
  builder.AddSurface({{0, -1.5, 12}, {9, 0, 0}, {0, 3, 3 * std::tan(tilt_rad)}}, wall);
  for (int i = 0; i < clutter; ++i)
    builder.AddPoint({(builder.Random() - 0.5) * 8, builder.Random() * 3 - 1.5, 4 + 7 * builder.Random()});
  return builder.Build();
}

TEST(Planes, GroundAndBackdropJoinAtTheirCrease) {
  const Scene scene = Square(700, 700, 300);
  PlanesSummary summary;
  PlanesOptions options;
  options.backdrop = false;
  const Mesh mesh = BuildPlanesProxy(scene, options, {}, &summary);
  ASSERT_EQ(summary.planes.size(), 2u);
  for (const FittedPlane& p : summary.planes) {
    const bool ground = std::abs(p.normal.y()) > 0.5;
    EXPECT_LT(AngleBetween(p.normal, ground ? Vector3d(0, -1, 0) : Vector3d(0, 0, -1)), 1e-3);
    EXPECT_NEAR(-p.offset, ground ? 1.5 : 12.0, 0.01);
  }
  // Neither reaches through the other.
  int crease = 0;
  for (const Vector3d& v : mesh.vertices) {
    EXPECT_LT(v.y(), 1.53);  // the clutter's points near the ground have a say, and the far corners a lever
    EXPECT_LT(v.z(), 12.05);
    crease += std::abs(v.y() - 1.5) < 0.02 && std::abs(v.z() - 12) < 0.05;
  }
  EXPECT_EQ(crease, 4) << "two corners of each";
  const MeshFit fit = MeasureFit(mesh, MakeProxyViews(scene), {});
  EXPECT_EQ(fit.coverage_min, 1.0);
  EXPECT_EQ(fit.front_fraction, 1.0);
}

TEST(Planes, SamplesOfAnySeedFindTheSame) {
  const Scene scene = Square(600, 500, 400, 0.2);
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    PlanesOptions options;
    options.seed = seed;
    PlanesSummary summary;
    BuildPlanesProxy(scene, options, {}, &summary);
    ASSERT_GE(summary.planes.size(), 2u) << seed;
    const std::size_t ground = std::abs(summary.planes[0].normal.y()) > 0.5 ? 0 : 1;
    EXPECT_LT(AngleBetween(summary.planes[ground].normal, Vector3d(0, -1, 0)), 4e-3) << seed;
    EXPECT_LT(AngleBetween(summary.planes[1 - ground].normal, Vector3d(0, std::sin(0.2), -std::cos(0.2))), 4e-3)
        << seed;
  }
}

TEST(Planes, ABackdropFillsWhatTheyLeaveEmpty) {
  const Scene scene = Square(900, 0, 0);
  PlanesSummary with, without;
  PlanesOptions options;
  BuildPlanesProxy(scene, options, {}, &with);
  options.backdrop = false;
  BuildPlanesProxy(scene, options, {}, &without);
  EXPECT_FALSE(without.backdrop_added);
  EXPECT_LT(without.coverage, 0.8);
  EXPECT_TRUE(with.backdrop_added);
  EXPECT_GT(with.coverage, 0.98);
}

TEST(Planes, APlateAmidTheSceneEndsWhereItsPointsEnd) {
  const Scene scene = PlateBeforeWall(900, 300, 21);
  PlanesSummary summary;
  const Mesh mesh = BuildPlanesProxy(scene, {}, {}, &summary);
  ASSERT_EQ(summary.planes.size(), 2u);
  const MeshQuery query(mesh);
  EXPECT_NEAR(query.FirstHit({0, 0, 0}, Vector3d::UnitZ())->distance, 2, 0.02);
  EXPECT_NEAR(query.FirstHit({1, 0.8, 0}, Vector3d::UnitZ())->distance, 4, 0.02) << "past the plate";
}

TEST(PlanesHardCase, ScenesWithoutAPlaneAreRefused) {
  SceneBuilder ball(9);
  for (int i = 0; i < 6; ++i) ball.AddCamera({0.4 * i - 1, 0, 0}, {0, 0, 6});
  for (int i = 0; i < 500; ++i) {
    const Vector3d x(ball.Random() - 0.5, ball.Random() - 0.5, ball.Random() - 0.5);
    ball.AddPoint(Vector3d(0, 0, 6) + 4 * x);
  }
  PlanesOptions strict;
  strict.tolerance = 1e-5;
  EXPECT_THROW(BuildPlanesProxy(ball.Build(), strict), DataError);
  SceneBuilder line(9);
  for (int i = 0; i < 6; ++i) line.AddCamera({0.4 * i - 1, 0, 0}, {0, 0, 6});
  for (int i = 0; i < 60; ++i) line.AddPoint({0.02 * i - 0.6, 0, 6});
  EXPECT_THROW(BuildPlanesProxy(line.Build(), {}), DataError) << "collinear points";
}

TEST(PlanesHardCase, ScaleAndOriginDoNotMatter) {
  PlanesSummary here, there;
  BuildPlanesProxy(Square(600, 600, 100), {}, {}, &here);
  const Vector3d far(1e5, 2e5, -3e5);
  BuildPlanesProxy(Moved(Square(600, 600, 100), 1e-6, Vector3d::Zero()), {}, {}, &there);
  ASSERT_EQ(here.planes.size(), there.planes.size());
  for (std::size_t i = 0; i < here.planes.size(); ++i)
    EXPECT_NEAR(there.planes[i].offset, 1e-6 * here.planes[i].offset, 1e-12);
  BuildPlanesProxy(Moved(Square(600, 600, 100), 1, far), {}, {}, &there);
  ASSERT_EQ(here.planes.size(), there.planes.size());
  for (std::size_t i = 0; i < here.planes.size(); ++i)
    EXPECT_NEAR(there.planes[i].offset, here.planes[i].offset + here.planes[i].normal.dot(far), 1e-6);
}

TEST(PlanesJson, TakesQuadsAndPlanesAndRefusesOthers) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    WriteTextAtomically(folder / "planes.json", text);
    return ReadPlanesJson(folder / "planes.json");
  };
  const GivenPlanes given = read(R"({"quads": [[[0,0,1],[1,0,1],[1,1,1],[0,1,1]]],
    "planes": [{"points": [[0,1.5,0],[1,1.5,0],[0,1.5,5],[3,1.5,2]]}, {"normal": [0,0,2], "offset": 24}]})");
  EXPECT_EQ(given.quads.faces.size(), 2u);
  ASSERT_EQ(given.planes.size(), 2u);
  EXPECT_NEAR(std::abs(given.planes[0].offset), 1.5, 1e-12);
  EXPECT_NEAR(given.planes[1].offset, 12, 1e-12);
  // Given planes are cut where they meet like those that are found.
  const Scene scene = Square(300, 300, 0);
  PlanesSummary summary;
  const Mesh mesh = BuildPlanesProxy(scene, {}, given.planes, &summary);
  for (const Vector3d& v : mesh.vertices) EXPECT_TRUE(v.y() < 1.501 && v.z() < 12.001);
  EXPECT_EQ(MeasureFit(mesh, MakeProxyViews(scene), {}).front_fraction, 1.0);
  for (const char* bad :
       {"[1]", "{}", R"({"quads": [[[0,0,1],[1,0,1],[1,1,1]]]})", R"({"quads": [[[0,0,1],[1,1,1],[1,0,1],[0,1,1]]]})",
        R"({"quads": [[[0,0,1],[1,0,2],[1,1,1],[0,1,2]]]})", R"({"planes": [{"points": [[0,0,0],[1,1,1],[2,2,2]]}]})",
        R"({"planes": [{"normal": [0,0,0], "offset": 1}]})", R"({"planes": [{"normal": [0,0,1]}]})",
        R"({"planes": [{"points": [[0,0,"x"]]}]})", R"({"quads": [[[1e999,0,1],[1,0,1],[1,1,1],[0,1,1]]]})"})
    EXPECT_THROW(read(bad), InputError) << bad;
}

}  // namespace
}  // namespace lumi::test
