#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>

#include "proxy/hull/contour.h"
#include "proxy/hull/coverage.h"
#include "proxy/hull/soundness.h"

namespace lumi::test {
namespace {

GridFrame Grid(int cells) {
  GridFrame grid;
  grid.origin = Eigen::Vector3d::Constant(-1);
  grid.cell = 2.0 / cells;
  grid.cells = {cells, cells, cells};
  return grid;
}

std::vector<std::array<int, 3>> AllCubes(int cells) {
  std::vector<std::array<int, 3>> cubes;
  for (int k = 0; k < cells; ++k)
    for (int j = 0; j < cells; ++j)
      for (int i = 0; i < cells; ++i) cubes.push_back({i, j, k});
  return cubes;
}

TEST(Contour, ABallIsASolidOfItsVolume) {
  const Solid ball = [](const Eigen::Vector3d& x, std::int32_t) { return static_cast<float>(x.norm() - 0.7); };
  const Mesh mesh = Contour(Grid(40), AllCubes(40), ball);
  const Soundness s = CheckSoundness(mesh);
  EXPECT_TRUE(s.IsSolid()) << s.Describe();
  EXPECT_EQ(s.parts, 1u);
  const double volume = 4.0 / 3 * std::numbers::pi * 0.343;
  // Chords of a cell's length cut (cell / radius)^2 / 8 off each radius at most: 0.0006 of it.
  EXPECT_NEAR(EnclosedVolume(mesh), volume, 3 * 0.001 * volume);
}

TEST(Contour, CubesThatAreMissingAreFoundFromTheirNeighbours) {
  const Solid ball = [](const Eigen::Vector3d& x, std::int32_t) { return static_cast<float>(x.norm() - 0.7); };
  const Mesh all = Contour(Grid(20), AllCubes(20), ball);
  const Mesh from_one = Contour(Grid(20), {{10, 10, 16}}, ball);
  EXPECT_EQ(from_one.faces.size(), all.faces.size());
  EXPECT_TRUE(CheckSoundness(from_one).IsSolid());
}

// Every case of a cube beside every other: signs at random, the worst that a solid can do.
TEST(Contour, NoiseIsClosedAndManifoldToo) {
  for (std::uint32_t seed = 0; seed < 6; ++seed) {
    const int cells = 24;
    const GridFrame grid = Grid(cells);
    const Solid noise = [&](const Eigen::Vector3d& x, std::int32_t) {
      const Eigen::Vector3d at = (x - grid.origin) / grid.cell;
      std::uint32_t h = seed * 0x9E3779B9U + 1;
      for (int a = 0; a < 3; ++a) {
        h ^= static_cast<std::uint32_t>(std::lround(at[a])) + 0x7F4A7C15U;
        h *= 0x85EBCA6BU;
        h ^= h >> 13;
      }
      h *= 0xC2B2AE35U;
      return (h >> 8 & 3) <= seed % 3 ? -1.0F : 1.0F;
    };
    const Mesh mesh = Contour(grid, AllCubes(cells), noise);
    const Soundness s = CheckSoundness(mesh);
    EXPECT_TRUE(s.manifold) << seed;
    EXPECT_TRUE(s.closed) << seed;
    EXPECT_EQ(s.degenerate_faces, 0u) << seed;
    EXPECT_TRUE(IsClosed(mesh)) << seed;
  }
}

TEST(Contour, TheGridsBoundaryCutsWhatGoesOn) {
  const Solid everything = [](const Eigen::Vector3d&, std::int32_t) { return -1.0F; };
  const Mesh mesh = Contour(Grid(8), AllCubes(8), everything);
  EXPECT_TRUE(CheckSoundness(mesh).IsSolid());
  EXPECT_LT(EnclosedVolume(mesh), 8);
  EXPECT_GT(EnclosedVolume(mesh), 0.9 * 8);
}

TEST(Contour, VerticesLieOnTheSolid) {
  const Solid ball = [](const Eigen::Vector3d& x, std::int32_t) {
    return static_cast<float>(std::pow(x.norm(), 3) - 0.2);
  };
  const double radius = std::cbrt(0.2);
  const GridFrame grid = Grid(30);
  for (const Eigen::Vector3d& v : Contour(grid, AllCubes(30), ball).vertices) {
    EXPECT_NEAR(v.norm(), radius, 0.011 * grid.cell);  // a hundredth of an edge: vertices stay clear of its ends
  }
}

TEST(Soundness, EachFlawIsNamed) {
  Mesh mesh = Contour(Grid(8), AllCubes(8),
                      [](const Eigen::Vector3d& x, std::int32_t) { return static_cast<float>(x.norm() - 0.5); });
  Mesh turned = mesh;
  for (auto& f : turned.faces) std::swap(f[0], f[1]);
  EXPECT_FALSE(CheckSoundness(turned).outward);
  Mesh open = mesh;
  open.faces.pop_back();
  EXPECT_FALSE(CheckSoundness(open).closed);
  Mesh one_turned = mesh;
  std::swap(one_turned.faces[0][0], one_turned.faces[0][1]);
  EXPECT_FALSE(CheckSoundness(one_turned).manifold);
  Mesh flat = mesh;
  flat.vertices[static_cast<std::size_t>(flat.faces[0][0])] = flat.vertices[static_cast<std::size_t>(flat.faces[0][1])];
  EXPECT_GT(CheckSoundness(flat).degenerate_faces, 0u);
  EXPECT_FALSE(CheckSoundness(Mesh{}).IsSolid());
}

}  // namespace
}  // namespace lumi::test
