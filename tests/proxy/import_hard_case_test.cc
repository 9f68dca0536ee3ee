#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "proxy/hull/soundness.h"
#include "proxy/import/icp.h"
#include "proxy/import/mesh_repair.h"
#include "proxy/import/placement.h"
#include "scene/program/error.h"

namespace lumi::test {
namespace {

// A wedge without symmetry.
Mesh Wedge() {
  Mesh m;
  m.vertices = {{0, 0, 0}, {3, 0, 0}, {3, 2, 0}, {0, 2, 0}, {0, 0, 1}, {1, 2, 1.5}};
  m.faces = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {3, 5, 2}, {0, 4, 3}, {3, 4, 5}, {1, 2, 5}, {1, 5, 4}};
  return m;
}

std::vector<Eigen::Vector3d> Samples(const Mesh& m, const Similarity3& s) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& f : m.faces)
    for (int i = 0; i <= 12; ++i)
      for (int j = 0; i + j <= 12; ++j) {
        const auto v = [&](std::size_t k) { return m.vertices[static_cast<std::size_t>(f[k])]; };
        points.push_back(s * Eigen::Vector3d(v(0) + i / 12.0 * (v(1) - v(0)) + j / 12.0 * (v(2) - v(0))));
      }
  return points;
}

void ExpectSoundRepair(const Mesh& m, const std::string& what) {
  RepairedMesh r = RepairMesh(m);
  OrientParts(r, {});
  const Soundness s = CheckSoundness(r.mesh);
  EXPECT_TRUE(s.manifold) << what;
  EXPECT_EQ(s.degenerate_faces, 0U) << what;
}

TEST(ImportHardCase, SliversOnTheWayToNoArea) {
  for (double height = 1e-2; height > 1e-20; height *= 0.1) {
    Mesh m = Wedge();
    m.vertices.emplace_back(1.5, 0, -height);  // beside the edge 0 1, splitting the face below it
    m.faces[0] = {0, 2, 6};
    m.faces.push_back({6, 2, 1});
    m.faces.push_back({0, 6, 1});
    ExpectSoundRepair(m, "height " + std::to_string(height));
    EXPECT_TRUE(IsClosed(RepairMesh(m).mesh)) << height;
  }
}

TEST(ImportHardCase, SeamsUponSeams) {
  // Four vertices along an edge, with faces without area among themselves only.
  Mesh m = Wedge();
  for (const double x : {0.75, 1.5, 2.25}) m.vertices.emplace_back(x, 0, 0);
  m.faces[0] = {0, 2, 6};
  for (const auto& f : {std::array<std::int32_t, 3>{6, 2, 7}, {7, 2, 8}, {8, 2, 1}, {0, 6, 7}, {0, 7, 8}, {0, 8, 1}})
    m.faces.push_back(f);
  ExpectSoundRepair(m, "seams");
  EXPECT_TRUE(IsClosed(RepairMesh(m).mesh));
}

TEST(ImportHardCase, NothingOrNoNumbers) {
  EXPECT_TRUE(RepairMesh({}).mesh.faces.empty());
  Mesh m = Wedge();
  for (Eigen::Vector3d& v : m.vertices) v.x() = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(RepairMesh(m).mesh.faces.empty());
  EXPECT_EQ(RepairMesh(m).faces_lost, m.faces.size());
  for (Eigen::Vector3d& v : m.vertices) v.setZero();
  EXPECT_TRUE(RepairMesh(m).mesh.faces.empty());
  m.faces.push_back({0, 1, 99});
  EXPECT_THROW(RepairMesh(m), std::invalid_argument);
}

TEST(ImportHardCase, IcpInAnyUnitAndFarFromTheOrigin) {
  const Mesh wedge = Wedge();
  for (const double unit : {1e-6, 1.0, 1e6})
    for (const double offset : {0.0, 1e4}) {
      const Similarity3 truth{unit, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 1).normalized())),
                              unit * offset * Eigen::Vector3d(1, -1, 1)};
      Similarity3 guess = truth;
      guess.scale *= 1.1;
      guess.rotation = Eigen::AngleAxisd(0.15, Eigen::Vector3d::UnitY()) * guess.rotation;
      guess.translation += 0.2 * unit * Eigen::Vector3d(1, 1, 0);
      const IcpResult r = AlignByIcp(wedge, Samples(wedge, truth), guess);
      ASSERT_TRUE(r.converged) << unit << " " << offset << ": " << r.why_not;
      for (const Eigen::Vector3d& v : wedge.vertices)
        EXPECT_LT((r.scene_from_mesh * v - truth * v).norm(), 1e-4 * unit) << unit << " " << offset;
    }
}

// A box that flattens to a sheet: aligned while its height can be told from noise, then named for sliding; never wrong
// in silence.
TEST(ImportHardCase, BodiesThatFlattenSlideInTheEnd) {
  bool slid = false;
  for (double height = 1; height > 1e-13; height *= 0.1) {
    Mesh flat = Wedge();
    for (Eigen::Vector3d& v : flat.vertices) v.z() *= height;
    // What is left of the sides is sampled no more: points of the top and the bottom alone.
    Mesh faces = flat;
    faces.faces = {flat.faces[0], flat.faces[1], flat.faces[5]};
    const Similarity3 guess{1, Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitZ())), {0.05, 0.02, 0}};
    const IcpResult r = AlignByIcp(flat, Samples(faces, {}), guess);
    EXPECT_TRUE(r.converged || !r.why_not.empty()) << height;
    slid = slid || r.why_not.find("slides") != std::string::npos;
    EXPECT_FALSE(slid && r.converged) << height;
  }
  EXPECT_TRUE(slid);
}

TEST(ImportHardCase, PairsOnTheWayToOneLine) {
  const Similarity3 truth{2, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX())), {1, 2, 3}};
  for (double off = 1e-1; off > 1e-17; off *= 0.1) {
    std::vector<PointPair> pairs;
    for (const Eigen::Vector3d& x : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, off, 0), Eigen::Vector3d(2, 0, 0)})
      pairs.push_back({x, truth * x});
    try {
      const PairAlignment a = AlignPairs(pairs);
      // The turn about the line is known to the coordinates' rounding over the width.
      EXPECT_LT((a.scene_from_mesh * Eigen::Vector3d(0, 0, 1) - truth * Eigen::Vector3d(0, 0, 1)).norm(),
                1e-13 / off + 1e-12)
          << off;
    } catch (const DataError&) {
      EXPECT_LT(off, 1e-5);
    }
  }
}

}  // namespace
}  // namespace lumi::test
