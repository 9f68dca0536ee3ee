#include <gtest/gtest.h>

#include "proxy/delaunay/min_cut.h"
#include "proxy/delaunay/surface.h"
#include "proxy/delaunay/tetrahedra.h"
#include "tests/proxy/synthetic_scene.h"

namespace lumi::test {
namespace {

std::vector<Eigen::Vector3d> RandomPoints(int count, std::uint64_t seed) {
  SceneBuilder random(seed);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) points.emplace_back(random.Random(), random.Random(), random.Random());
  return points;
}

Capacity CostOf(const Tetrahedra& tets, const CutProblem& problem, const std::vector<std::uint8_t>& free) {
  Capacity cost = 0;
  for (std::size_t c = 0; c < tets.cells.size(); ++c) {
    cost += free[c] ? problem.sink[c] : problem.source[c];
    for (std::size_t i = 0; i < 4; ++i) {
      if (free[c] && !free[static_cast<std::size_t>(tets.cells[c].neighbor[i])]) cost += problem.facet[c][i];
    }
  }
  return cost;
}

TEST(MinCut, FindsTheSmallestOfAllLabellings) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const auto located = Tetrahedralize(RandomPoints(6, seed), {});
    ASSERT_TRUE(located);
    const Tetrahedra& tets = located->tetrahedra;
    const std::size_t n = tets.cells.size();
    ASSERT_LE(n, 16u);
    SceneBuilder random(seed + 100);
    CutProblem problem;
    for (std::size_t c = 0; c < n; ++c) {
      problem.source.push_back(static_cast<Capacity>(40 * random.Random()));
      problem.sink.push_back(static_cast<Capacity>(40 * random.Random()));
      problem.facet.push_back({});
      for (Capacity& f : problem.facet.back()) f = static_cast<Capacity>(12 * random.Random());
    }
    Capacity best = std::numeric_limits<Capacity>::max();
    for (std::uint32_t labels = 0; labels < (1u << n); ++labels) {
      std::vector<std::uint8_t> free(n);
      for (std::size_t c = 0; c < n; ++c) free[c] = (labels >> c) & 1;
      best = std::min(best, CostOf(tets, problem, free));
    }
    EXPECT_EQ(CostOf(tets, problem, SolveMinCut(tets, problem)), best) << "seed " << seed;
  }
}

// Any labelling at all, also with edges and vertices where many sheets meet, must come out closed.
TEST(Surface, IsClosedForRandomLabels) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto located = Tetrahedralize(RandomPoints(60, seed), {});
    ASSERT_TRUE(located);
    const Tetrahedra& tets = located->tetrahedra;
    SceneBuilder random(seed + 50);
    std::vector<std::uint8_t> free(tets.cells.size());
    double volume = 0;
    for (std::size_t c = 0; c < free.size(); ++c) {
      const Tetrahedra::Cell& cell = tets.cells[c];
      if (!cell.finite()) continue;
      free[c] = random.Random() < 0.5;
      if (!free[c]) continue;
      Eigen::Matrix3d m;
      for (int i = 0; i < 3; ++i) {
        m.col(i) = tets.vertices[static_cast<std::size_t>(cell.vertex[static_cast<std::size_t>(i) + 1])] -
                   tets.vertices[static_cast<std::size_t>(cell.vertex[0])];
      }
      EXPECT_GT(m.determinant(), 0);
      volume += m.determinant() / 6;
    }
    const Mesh mesh = ExtractSurface(tets, free);
    ASSERT_GT(mesh.faces.size(), 50u);
    EXPECT_TRUE(IsClosed(mesh)) << "seed " << seed;
    // Front faces look at the free side: the enclosed volume, counted outwards, is minus the free cells'.
    double enclosed = 0;
    for (const auto& f : mesh.faces) {
      const auto& v = mesh.vertices;
      Eigen::Matrix3d m;
      m << v[static_cast<std::size_t>(f[0])], v[static_cast<std::size_t>(f[1])], v[static_cast<std::size_t>(f[2])];
      enclosed += m.determinant() / 6;
    }
    EXPECT_NEAR(enclosed, -volume, 1e-12);
  }
}

TEST(Walk, CrossesTheSameCellsAsDenseSamplingSays) {
  const std::vector<Eigen::Vector3d> points = RandomPoints(200, 5);
  const Eigen::Vector3d target(0.5, 0.45, 0.55);
  const auto located = Tetrahedralize(points, {target});
  ASSERT_TRUE(located);
  const Tetrahedra& tets = located->tetrahedra;
  for (std::int32_t v = 0; v < 200; ++v) {
    const Eigen::Vector3d& x = points[static_cast<std::size_t>(v)];
    double last = 0;
    std::int32_t previous = -1;
    const std::int32_t end = WalkFromVertex(tets, v, target, [&](std::int32_t cell, int facet, double distance) {
      EXPECT_GE(distance, last);
      // The middle of the stretch within a cell lies inside all of its facets.
      const Eigen::Vector3d middle = x + 0.5 * (last + distance) * (target - x).normalized();
      for (const auto& plane : tets.planes[static_cast<std::size_t>(cell)])
        EXPECT_LE(plane.n.dot(middle) - plane.offset, 1e-9);
      EXPECT_TRUE(previous < 0 || cell == previous);
      previous = tets.cells[static_cast<std::size_t>(cell)].neighbor[static_cast<std::size_t>(facet)];
      last = distance;
      return true;
    });
    EXPECT_EQ(end, located->query_cell[0]);
  }
}

}  // namespace
}  // namespace lumi::test
