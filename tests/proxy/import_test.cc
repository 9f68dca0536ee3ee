#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "proxy/hull/soundness.h"
#include "proxy/import/icp.h"
#include "proxy/import/mesh_repair.h"
#include "proxy/import/placement.h"
#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace lumi::test {
namespace {

using testing::HasSubstr;

Mesh UnitCube() {
  Mesh m;
  for (int i = 0; i < 8; ++i) m.vertices.emplace_back(i & 1, (i >> 1) & 1, (i >> 2) & 1);
  m.faces = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
             {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return m;
}

// A body without symmetry: bumps on an ellipsoid.
Mesh Potato(int rings = 24) {
  Mesh m;
  const int around = 2 * rings;
  const auto at = [](double theta, double phi) {
    const Eigen::Vector3d d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
    const double r = 1 + 0.25 * std::sin(3 * d.x() + 1) * std::cos(2 * d.y()) + 0.15 * d.z() * d.x() +
                     0.2 * std::exp(-8 * (d - Eigen::Vector3d(0.6, 0.0, 0.8)).squaredNorm());
    return Eigen::Vector3d(1.3 * r * d.x(), r * d.y(), 0.7 * r * d.z());
  };
  m.vertices.push_back(at(0, 0));
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j)
      m.vertices.push_back(at(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / around));
  m.vertices.push_back(at(std::numbers::pi, 0));
  const auto index = [&](int i, int j) {
    return i == 0 ? 0 : i == rings ? static_cast<int>(m.vertices.size()) - 1 : 1 + (i - 1) * around + j % around;
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < around; ++j) {
      if (i > 0) m.faces.push_back({index(i, j), index(i + 1, j), index(i, j + 1)});
      if (i + 1 < rings) m.faces.push_back({index(i, j + 1), index(i + 1, j), index(i + 1, j + 1)});
    }
  return m;
}

std::vector<Eigen::Vector3d> PointsOn(const Mesh& m, int count, double noise, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> n(0, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const auto& f = m.faces[random() % m.faces.size()];
    double a = u(random), b = u(random);
    if (a + b > 1) {
      a = 1 - a;
      b = 1 - b;
    }
    const auto v = [&](std::size_t k) { return m.vertices[static_cast<std::size_t>(f[k])]; };
    const double x = n(random), y = n(random), z = n(random);
    points.push_back(v(0) + a * (v(1) - v(0)) + b * (v(2) - v(0)) + noise * Eigen::Vector3d(x, y, z));
  }
  return points;
}

// --- Repair --------------------------------------------------------------------------------------------------------

TEST(MeshRepair, ASoundMeshStaysAsItIs) {
  const Mesh cube = UnitCube();
  RepairedMesh r = RepairMesh(cube);
  OrientParts(r, {});
  EXPECT_TRUE(r.flaws.none()) << r.flaws.Describe();
  EXPECT_EQ(r.mesh.vertices, cube.vertices);
  EXPECT_EQ(r.mesh.faces, cube.faces);
  EXPECT_EQ(r.parts, 1);
  EXPECT_EQ(r.flaws.Describe(), "none");
}

TEST(MeshRepair, SeparateTrianglesBecomeASolid) {
  const Mesh cube = UnitCube();
  Mesh soup;
  for (const auto& f : cube.faces)
    for (const std::int32_t v : f) {
      soup.vertices.push_back(cube.vertices[static_cast<std::size_t>(v)]);
      soup.colors.push_back({static_cast<std::uint8_t>(v), 0, 0});
    }
  for (int i = 0; i < 12; ++i) soup.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  const RepairedMesh r = RepairMesh(soup);
  EXPECT_EQ(r.flaws.duplicate_vertices, 28U);
  EXPECT_TRUE(CheckSoundness(r.mesh).IsSolid()) << CheckSoundness(r.mesh).Describe();
  for (std::size_t i = 0; i < r.mesh.vertices.size(); ++i)
    EXPECT_EQ(r.mesh.vertices[i], cube.vertices[r.mesh.colors[i][0]]);  // colours stay with their vertices
}

TEST(MeshRepair, EachFlawIsMendedAndCounted) {
  Mesh m = UnitCube();
  m.faces.push_back(m.faces[0]);                                     // twice
  m.faces.push_back({m.faces[1][0], m.faces[1][2], m.faces[1][1]});  // twice, the other way round
  std::swap(m.faces[5][1], m.faces[5][2]);                           // turned
  m.faces.push_back({3, 3, 5});                                      // no area
  m.vertices.emplace_back(std::nan(""), 0, 0);
  m.faces.push_back({0, 1, 8});      // no number
  m.vertices.emplace_back(1, 1, 1);  // vertex 7 again
  m.faces[11] = {3, 9, 5};
  const RepairedMesh r = RepairMesh(m);
  EXPECT_EQ(r.flaws.duplicate_faces, 2U);
  EXPECT_EQ(r.flaws.turned_faces, 1U);
  EXPECT_EQ(r.flaws.zero_area_faces, 1U);
  EXPECT_EQ(r.flaws.not_finite_vertices, 1U);
  EXPECT_EQ(r.flaws.duplicate_vertices, 1U);
  EXPECT_EQ(r.faces_lost, 1U);
  EXPECT_TRUE(CheckSoundness(r.mesh).IsSolid()) << CheckSoundness(r.mesh).Describe();
  EXPECT_THAT(r.flaws.Describe(), HasSubstr("1 face turned"));
}

// A vertex in the middle of an edge, with a face without area to close the seam: as triangulations of polygons have it.
TEST(MeshRepair, ASeamIsClosedByItsNeighbour) {
  Mesh m = UnitCube();
  m.vertices.emplace_back(0.5, 0, 0);
  m.faces[0] = {0, 2, 8};
  m.faces.push_back({8, 2, 1});
  m.faces.push_back({0, 8, 1});  // no area, between those two and the face below
  const RepairedMesh r = RepairMesh(m);
  EXPECT_EQ(r.flaws.zero_area_faces, 1U);
  EXPECT_EQ(r.mesh.faces.size(), 14U);
  EXPECT_TRUE(CheckSoundness(r.mesh).IsSolid()) << CheckSoundness(r.mesh).Describe();
}

TEST(MeshRepair, PartsThatShareAnEdgeOrAVertexAreCutApart) {
  const auto two = [](const Eigen::Vector3d& shift) {
    Mesh m = UnitCube();
    Mesh other = UnitCube();
    for (Eigen::Vector3d& v : other.vertices) v += shift;
    Append(m, other);
    return m;
  };
  RepairedMesh apart = RepairMesh(two({1, 1, 0}));
  EXPECT_TRUE(apart.flaws.none()) << apart.flaws.Describe();  // closed each, and apart already
  const auto soup = [&](const Eigen::Vector3d& shift) {
    const Mesh m = two(shift);
    Mesh out;
    for (const auto& f : m.faces) {
      const auto n = static_cast<std::int32_t>(out.vertices.size());
      for (const std::int32_t v : f) out.vertices.push_back(m.vertices[static_cast<std::size_t>(v)]);
      out.faces.push_back({n, n + 1, n + 2});
    }
    return out;
  };
  const RepairedMesh edge = RepairMesh(soup({1, 1, 0}));
  EXPECT_EQ(edge.flaws.non_manifold_edges, 1U);
  EXPECT_EQ(edge.flaws.duplicate_vertices, 58U);
  const Soundness edge_sound = CheckSoundness(edge.mesh);
  EXPECT_TRUE(edge_sound.IsSolid()) << edge_sound.Describe();
  EXPECT_EQ(edge_sound.parts, 2U);
  const RepairedMesh vertex = RepairMesh(soup({1, 1, 1}));
  EXPECT_EQ(vertex.flaws.non_manifold_vertices, 1U);
  EXPECT_TRUE(CheckSoundness(vertex.mesh).IsSolid());
}

TEST(MeshRepair, AClosedPartTurnsOutwardsAnOpenOneAsItIsSeen) {
  Mesh m = UnitCube();
  for (auto& f : m.faces) std::swap(f[1], f[2]);
  RepairedMesh r = RepairMesh(m);
  EXPECT_EQ(r.flaws.turned_faces, 0U);
  EXPECT_FALSE(CheckSoundness(r.mesh).outward);
  RepairedMesh seen_from_within = r;
  OrientParts(r, {});
  EXPECT_EQ(r.flaws.inside_out_parts, 1U);
  EXPECT_TRUE(CheckSoundness(r.mesh).IsSolid());
  OrientParts(seen_from_within, {5});  // a room: the views meet its fronts
  EXPECT_EQ(seen_from_within.flaws.inside_out_parts, 0U);
  Mesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.faces = {{0, 1, 2}};
  RepairedMesh open = RepairMesh(sheet);
  OrientParts(open, {});
  EXPECT_EQ(open.mesh.faces[0], (std::array<std::int32_t, 3>{0, 1, 2}));
  OrientParts(open, {-3});
  EXPECT_EQ(open.flaws.inside_out_parts, 1U);
}

// Random damage: whatever comes, what is left is a manifold without degenerate faces.
TEST(MeshRepair, AnySoupBecomesAManifold) {
  std::mt19937 random(7);
  for (int round = 0; round < 60; ++round) {
    Mesh m;
    const int vertices = 4 + static_cast<int>(random() % 12);
    for (int i = 0; i < vertices; ++i)  // on a small grid: many collinear, coplanar and coinciding ones
      m.vertices.emplace_back(random() % 3, random() % 3, random() % 2);
    for (int i = 0; i < 30; ++i)
      m.faces.push_back({static_cast<int>(random() % static_cast<unsigned>(vertices)),
                         static_cast<int>(random() % static_cast<unsigned>(vertices)),
                         static_cast<int>(random() % static_cast<unsigned>(vertices))});
    RepairedMesh r = RepairMesh(m);
    OrientParts(r, {});
    const Soundness s = CheckSoundness(r.mesh);
    EXPECT_TRUE(s.manifold) << round;
    EXPECT_EQ(s.degenerate_faces, 0U) << round;
    EXPECT_EQ(r.part.size(), r.mesh.faces.size());
  }
}

// --- Placement -----------------------------------------------------------------------------------------------------

TEST(Placement, UnitsAndAxes) {
  EXPECT_EQ(MetresIn("mm"), 1e-3);
  EXPECT_EQ(MetresIn("in"), 0.0254);
  EXPECT_THROW(MetresIn("yard"), UsageError);
  const Eigen::Vector3d up(0, -1, 0), p(1, 2, 3);
  EXPECT_LT((AxesFromText("y-up", up) * p - Eigen::Vector3d(1, -2, -3)).norm(), 1e-12);
  EXPECT_LT((AxesFromText("z-up", up) * p - Eigen::Vector3d(1, -3, 2)).norm(), 1e-12);
  EXPECT_LT((AxesFromText("-y-up", up) * p - p).norm(), 1e-12);
  EXPECT_EQ(AxesFromText("x,-z,y", up) * p, Eigen::Vector3d(1, -3, 2));
  EXPECT_LT(AxesFromText("x,y,-z", up).determinant(), 0);  // a left-handed frame
  for (const char* wrong : {"", "up", "w-up", "x,y", "x,y,z,x", "x,x,z", "x;y;z", "2x,y,z"})
    EXPECT_THROW(AxesFromText(wrong, up), UsageError) << wrong;
}

TEST(Placement, PairsAreReadFromJsonAndFromText) {
  const TemporaryFolder folder;
  WriteTextAtomically(folder / "a.json", R"({"pairs": [{"mesh": [1, 2, 3], "scene": [4, 5, 6]}]})");
  WriteTextAtomically(folder / "a.csv", "mesh x,y,z,scene x,y,z\n# by hand\n1, 2, 3, 4, 5, 6\r\n\n1;2;3;+4;5;6\n");
  EXPECT_EQ(ReadPointPairs(folder / "a.json").at(0).scene, Eigen::Vector3d(4, 5, 6));
  ASSERT_EQ(ReadPointPairs(folder / "a.csv").size(), 2U);
  EXPECT_EQ(ReadPointPairs(folder / "a.csv")[1].scene.x(), 4);
  WriteTextAtomically(folder / "b.csv", "1 2 3 4 5 6\n1 2 3 4 5\n");
  try {
    ReadPointPairs(folder / "b.csv");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("line 2"));
  }
  for (const char* wrong : {"{", "[]", R"({"pairs": [{"mesh": [1, 2], "scene": [1, 2, 3]}]})", R"({"pairs": [7]})"}) {
    WriteTextAtomically(folder / "b.json", wrong);
    EXPECT_THROW(ReadPointPairs(folder / "b.json"), InputError) << wrong;
  }
}

TEST(Placement, PairsGiveTheSimilarityAndWhatIsLeft) {
  const Similarity3 truth{
      2.5, Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -1, 2).normalized())), {1, 2, 3}};
  std::vector<PointPair> pairs;
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)})
    pairs.push_back({x, truth * x});
  const PairAlignment exact = AlignPairs(pairs);
  EXPECT_NEAR(exact.scene_from_mesh.scale, 2.5, 1e-12);
  EXPECT_LT(exact.rms, 1e-12);
  pairs[2].scene += Eigen::Vector3d(0.5, 0, 0);
  const PairAlignment off = AlignPairs(pairs);
  EXPECT_GT(off.rms_of_extent, 0.02);
  EXPECT_EQ(std::max_element(off.distance.begin(), off.distance.end()) - off.distance.begin(), 2);
  pairs.resize(2);
  EXPECT_THROW(AlignPairs(pairs), DataError);
  EXPECT_THROW(AlignPairs({{{0, 0, 0}, {0, 0, 0}}, {{1, 1, 1}, {1, 0, 0}}, {{2, 2, 2}, {2, 0, 0}}}), DataError);
}

// --- ICP -----------------------------------------------------------------------------------------------------------

const Similarity3 kTruth{
    3.0, Eigen::Quaterniond(Eigen::AngleAxisd(0.9, Eigen::Vector3d(0.2, 1, -0.4).normalized())), {10, -4, 2}};

Similarity3 Disturbed(double scale, double angle, double shift) {
  Similarity3 s = kTruth;
  s.scale *= scale;
  s.rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 1, 0.3).normalized()) * s.rotation;
  s.translation += shift * Eigen::Vector3d(1, -1, 0.5).normalized();
  return s;
}

double Off(const Similarity3& a, const Mesh& mesh) {
  double worst = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) worst = std::max(worst, (a * v - kTruth * v).norm());
  return worst;
}

TEST(Icp, FindsThePlaceOfABodyFromARoughGuess) {
  const Mesh potato = Potato();
  std::vector<Eigen::Vector3d> points = PointsOn(potato, 1500, 0, 1);
  for (Eigen::Vector3d& p : points) p = kTruth * p;
  for (const auto& [scale, angle, shift] :
       {std::tuple(1.0, 0.0, 0.0), {1.2, 0.3, 0.5}, {0.8, -0.3, 0.5}, {1.0, 0.5, 0.0}}) {
    const IcpResult r = AlignByIcp(potato, points, Disturbed(scale, angle, shift));
    ASSERT_TRUE(r.converged) << r.why_not << " scale " << scale << " angle " << angle;
    EXPECT_LT(Off(r.scene_from_mesh, potato), 1e-4) << scale << " " << angle;
    EXPECT_LT(r.rms, 1e-5);
    EXPECT_NEAR(r.scene_from_mesh.scale, 3, 1e-5);
  }
}

TEST(Icp, NoiseAndPointsOfOtherThingsAreLivedWith) {
  const Mesh potato = Potato();
  std::vector<Eigen::Vector3d> points = PointsOn(potato, 1500, 0.005, 2);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-3, 3);
  for (int i = 0; i < 500; ++i) {
    const double x = u(random), y = u(random), z = u(random);
    points.emplace_back(x, y, z);
  }
  for (Eigen::Vector3d& p : points) p = kTruth * p;
  const IcpResult r = AlignByIcp(potato, points, Disturbed(1.1, 0.2, 0.3));
  ASSERT_TRUE(r.converged) << r.why_not;
  EXPECT_LT(Off(r.scene_from_mesh, potato), 0.05);  // of a body 10 across
  EXPECT_NEAR(r.rms, 0.005 * 3, 0.01);
}

TEST(Icp, APlaceAndSizeFarOffAreFoundFromWherePointsAre) {
  const Mesh potato = Potato();
  std::vector<Eigen::Vector3d> points = PointsOn(potato, 1000, 0, 4);
  for (Eigen::Vector3d& p : points) p = kTruth * p;
  const IcpResult r = AlignByIcp(potato, points, Disturbed(1000, 0.2, 50000));  // millimetres for metres
  ASSERT_TRUE(r.converged) << r.why_not;
  EXPECT_LT(Off(r.scene_from_mesh, potato), 1e-3);
}

TEST(Icp, WhatDoesNotFitOrSlidesIsRefused) {
  const Mesh potato = Potato();
  std::vector<Eigen::Vector3d> cube = PointsOn(UnitCube(), 1000, 0, 5), sheet;
  for (Eigen::Vector3d& p : cube) p = 4 * p;
  EXPECT_FALSE(AlignByIcp(potato, cube, Similarity3{2, Eigen::Quaterniond::Identity(), {2, 2, 2}}).converged);
  Mesh plane;
  for (int i = 0; i < 16; ++i) plane.vertices.emplace_back(i % 4, i / 4, 0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      plane.faces.push_back({4 * i + j, 4 * i + j + 1, 4 * i + j + 4});
      plane.faces.push_back({4 * i + j + 1, 4 * i + j + 5, 4 * i + j + 4});
    }
  const IcpResult slides = AlignByIcp(plane, PointsOn(plane, 500, 0, 6), {});
  EXPECT_FALSE(slides.converged);
  EXPECT_THAT(slides.why_not, HasSubstr("slides"));
  EXPECT_FALSE(AlignByIcp(potato, {}, {}).converged);
  EXPECT_FALSE(AlignByIcp(potato, PointsOn(potato, 10, 0, 7), {}).converged);
}

}  // namespace
}  // namespace lumi::test
