#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

#include "proxy/hull/coverage.h"
#include "proxy/hull/soundness.h"
#include "proxy/simplify/mesh_topology.h"
#include "proxy/simplify/simplify.h"
#include "scene/program/error.h"
#include "tests/proxy/simplify_meshes.h"

namespace lumi::test {
namespace {

using testing::HasSubstr;

constexpr double kBodySlack = 1e-6;  // of the body's size, see simplify_test.cc

SimplifiedMesh Reduced(const Mesh& mesh, std::size_t faces, SimplifyMethod method) {
  return Simplify(mesh, {faces}, method, SilentProgress()).front();
}
constexpr std::array<SimplifyMethod, 2> kBothWays = {SimplifyMethod::kQuadric, SimplifyMethod::kKeepHull};

std::string WhatIsRefused(const std::function<void()>& what) {
  try {
    what();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing";
}

TEST(SimplifyHardCase, AnyUnitOfLength) {
  const Mesh body = BumpyBall(10);
  for (const SimplifyMethod method : kBothWays) {
    const double ratio = EnclosedVolume(Reduced(body, 150, method).mesh) / EnclosedVolume(body);
    for (const double unit : {1e-6, 1e6}) {
      const Mesh scaled = MappedVertices(body, [&](const Eigen::Vector3d& x) { return Eigen::Vector3d(unit * x); });
      const Mesh simple = Reduced(scaled, 150, method).mesh;
      EXPECT_TRUE(CheckSoundness(simple).IsSolid()) << Name(method) << " " << unit;
      EXPECT_LE(simple.faces.size(), 150u);
      // Another unit rounds the input otherwise, and ties fall otherwise; no more than that.
      EXPECT_NEAR(EnclosedVolume(simple) / EnclosedVolume(scaled), ratio, 0.02) << Name(method) << " " << unit;
      if (method == SimplifyMethod::kKeepHull) {
        EXPECT_EQ(Escaped(scaled, simple, kBodySlack * unit), 0u) << unit;
      }
    }
  }
}

// At 1e7 sizes from the origin doubles hold 1e-9 of the size: enough for all of it, with a slack of that.
TEST(SimplifyHardCase, FarFromTheOrigin) {
  const Mesh body = BumpyBall(10);
  for (const double offset : {1e3, 1e5, 1e7}) {
    const Eigen::Vector3d away = offset * Eigen::Vector3d(1, -0.7, 0.4);
    const Mesh moved = MappedVertices(body, [&](const Eigen::Vector3d& x) { return Eigen::Vector3d(x + away); });
    for (const SimplifyMethod method : kBothWays) {
      const Mesh simple = Reduced(moved, 150, method).mesh;
      EXPECT_TRUE(CheckSoundness(simple).IsSolid()) << Name(method) << " " << offset;
      EXPECT_LE(simple.faces.size(), 150u);
      if (method == SimplifyMethod::kKeepHull) {
        EXPECT_EQ(Escaped(moved, simple, kBodySlack + 1e-15 * offset), 0u) << offset;
      }
    }
  }
}

TEST(SimplifyHardCase, SliversDownToRounding) {
  // Rows of the ring's faces pressed together, until two rows are one to the last digit.
  for (const double pressed : {1e-2, 1e-5, 1e-8, 1e-10, 1e-12, 1e-15, 0.0}) {
    Mesh ring = TorusMesh(24, 12);
    for (std::size_t j = 0; j < 12; ++j)
      ring.vertices[5 * 12 + j] =
          ring.vertices[4 * 12 + j] + pressed * (ring.vertices[5 * 12 + j] - ring.vertices[4 * 12 + j]);
    for (const SimplifyMethod method : kBothWays) {
      const Mesh simple = Reduced(ring, 120, method).mesh;
      const Soundness sound = CheckSoundness(simple);
      EXPECT_TRUE(sound.IsSolid()) << Name(method) << " " << pressed << ": " << sound.Describe();
      EXPECT_LE(simple.faces.size(), 120u);
      EXPECT_EQ(CountParts(simple).handles, 1u);
      if (method == SimplifyMethod::kKeepHull) {
        EXPECT_EQ(Escaped(ring, simple, kBodySlack), 0u) << pressed;
      }
    }
  }
}

TEST(SimplifyHardCase, TrianglesWrittenOneByOne) {
  const Mesh ball = BallMesh(12);
  Mesh soup;
  for (const auto& f : ball.faces) {
    std::array<std::int32_t, 3> face{};
    for (std::size_t k = 0; k < 3; ++k) {
      face[k] = static_cast<std::int32_t>(soup.vertices.size());
      soup.vertices.push_back(ball.vertices[static_cast<std::size_t>(f[k])]);
    }
    soup.faces.push_back(face);
  }
  soup.faces.push_back({0, 0, 1});
  for (const SimplifyMethod method : kBothWays) {
    const Mesh simple = Reduced(soup, 100, method).mesh;
    EXPECT_TRUE(CheckSoundness(simple).IsSolid());
    EXPECT_LE(simple.faces.size(), 100u);
  }
}

TEST(SimplifyHardCase, PartsThatTouchInAVertexStayTwoParts) {
  Mesh two = SubdividedCube(6);
  const Mesh other = MappedVertices(
      SubdividedCube(6), [](const Eigen::Vector3d& x) { return Eigen::Vector3d(x + Eigen::Vector3d::Ones()); });
  Append(two, other);
  const auto first = static_cast<std::int32_t>(SubdividedCube(6).vertices.size());
  std::int32_t corner = -1, touching = -1;
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(two.vertices.size()); ++v)
    if ((two.vertices[static_cast<std::size_t>(v)] - Eigen::Vector3d::Ones()).norm() < 1e-12)
      (v < first ? corner : touching) = v;
  for (auto& f : two.faces)
    for (std::int32_t& v : f)
      if (v == touching) v = corner;
  for (const SimplifyMethod method : kBothWays) {
    const Mesh simple = Reduced(two, 24, method).mesh;
    EXPECT_EQ(CheckSoundness(simple).parts, 2u);
    EXPECT_TRUE(CheckSoundness(simple).IsSolid());
    EXPECT_NEAR(EnclosedVolume(simple), 2, method == SimplifyMethod::kKeepHull ? 1e-9 : 0.3);
  }
}

TEST(SimplifyHardCase, NothingToDoChangesNothing) {
  const Mesh ball = BallMesh(6);
  for (const SimplifyMethod method : {SimplifyMethod::kQuadric, SimplifyMethod::kInPixels, SimplifyMethod::kKeepHull}) {
    EXPECT_TRUE(Reduced(SubdividedCube(1), 12, method).reached);
    const SimplifiedMesh same = Reduced(ball, ball.faces.size() + 100, method);
    EXPECT_TRUE(same.reached);
    EXPECT_EQ(same.removed_parts, 0u);
    EXPECT_EQ(same.mesh.faces.size(), ball.faces.size());
    EXPECT_NEAR(EnclosedVolume(same.mesh), EnclosedVolume(ball), 1e-15);
  }
}

TEST(SimplifyHardCase, TooFewFacesAreNamed) {
  const Mesh ball = BallMesh(6), ring = TorusMesh(20, 10);
  Mesh two = ball;
  Append(two,
         MappedVertices(ball, [](const Eigen::Vector3d& x) { return Eigen::Vector3d(x + Eigen::Vector3d(3, 0, 0)); }));
  for (const SimplifyMethod method : kBothWays) {
    EXPECT_THAT(WhatIsRefused([&] { Reduced(ball, 3, method); }), HasSubstr("enclose nothing"));
    EXPECT_THAT(WhatIsRefused([&] { Reduced(ball, 0, method); }), HasSubstr("at least 1"));
    EXPECT_THAT(WhatIsRefused([&] { Reduced(ring, 12, method); }), HasSubstr("need 14"));
    EXPECT_THAT(WhatIsRefused([&] { Reduced(ball, 3, SimplifyMethod::kInPixels); }), HasSubstr("enclose nothing"));
    EXPECT_THAT(WhatIsRefused([&] { Reduced(two, 6, method); }), HasSubstr("2 parts"));
    // The least that there is: a tetrahedron each, as far as the shapes let it.
    EXPECT_LE(Reduced(ball, 4, method).mesh.faces.size(), 12u) << Name(method);
    const Mesh least = Reduced(ring, 14, method).mesh;
    EXPECT_EQ(CountParts(least).handles, 1u);
    EXPECT_TRUE(CheckSoundness(least).manifold);
  }
}

TEST(SimplifyHardCase, WhatHasNoInsideHasNoHull) {
  const Mesh sheet = WavySheet(10), ball = BallMesh(6);
  EXPECT_THAT(WhatIsRefused([&] { Reduced(sheet, 20, SimplifyMethod::kKeepHull); }), HasSubstr("open"));
  Mesh turned = ball;
  for (auto& f : turned.faces) std::swap(f[0], f[1]);
  EXPECT_THAT(WhatIsRefused([&] { Reduced(turned, 20, SimplifyMethod::kKeepHull); }), HasSubstr("inside out"));
  Mesh fins = sheet;
  fins.vertices.push_back({0.5, 0.5, 1});
  fins.faces.push_back({0, 1, static_cast<std::int32_t>(fins.vertices.size() - 1)});
  fins.faces.push_back({0, 12, static_cast<std::int32_t>(fins.vertices.size() - 1)});
  EXPECT_THAT(WhatIsRefused([&] { Reduced(fins, 20, SimplifyMethod::kQuadric); }), HasSubstr("no surface"));
  EXPECT_THAT(WhatIsRefused([&] { Reduced(Mesh{}, 20, SimplifyMethod::kQuadric); }), HasSubstr("no face"));
}

// Rounding alone decides which side of a plane its own points lie on.
TEST(SimplifyHardCase, NoiseOnFlatSidesDownToRounding) {
  for (const double noise : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> shake(-noise, noise);
    const Mesh cube = MappedVertices(SubdividedCube(6), [&](const Eigen::Vector3d& x) {
      return Eigen::Vector3d(x + Eigen::Vector3d(shake(random), shake(random), shake(random)));
    });
    const Mesh hull = Reduced(cube, 40, SimplifyMethod::kKeepHull).mesh;
    EXPECT_TRUE(CheckSoundness(hull).IsSolid()) << noise;
    EXPECT_EQ(Escaped(cube, hull, kBodySlack), 0u) << noise;
    EXPECT_LE(hull.faces.size(), 40u) << noise;
    EXPECT_NEAR(EnclosedVolume(hull), 1, 12 * noise + 1e-6) << noise;
  }
}

}  // namespace
}  // namespace lumi::test
