#include "scene/geometry/mesh.h"

#include <gtest/gtest.h>

#include <limits>

namespace lumi {
namespace {

Mesh Tetrahedron() {
  Mesh m;
  m.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  m.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return m;
}

TEST(Mesh, ATetrahedronIsClosedAndIsNotWithoutAFaceOrWithOneTurned) {
  Mesh m = Tetrahedron();
  EXPECT_TRUE(IsClosed(m));
  std::swap(m.faces[0][0], m.faces[0][1]);
  EXPECT_FALSE(IsClosed(m));
  m = Tetrahedron();
  m.faces.pop_back();
  EXPECT_FALSE(IsClosed(m));
  EXPECT_FALSE(IsClosed(Mesh{}));
}

TEST(Mesh, ValidationNamesTheFirstOffender) {
  Mesh m = Tetrahedron();
  EXPECT_FALSE(Validate(m));
  m.faces[2][1] = 4;
  EXPECT_EQ(Validate(m), "face 2 names vertex 4 of 4");
  m.vertices[1].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Validate(m), "vertex 1 is not a finite number");
}

TEST(Mesh, NormalsPointOutAndAFaceWithoutAreaHasNone) {
  Mesh m = Tetrahedron();
  EXPECT_LT((m.FaceNormal(0) - Eigen::Vector3d(0, 0, -1)).norm(), 1e-15);
  m.vertices[1] = m.vertices[0];
  EXPECT_EQ(m.FaceNormal(0).norm(), 0);
}

TEST(Mesh, AppendKeepsBothApart) {
  Mesh m = Tetrahedron();
  Append(m, Tetrahedron());
  EXPECT_EQ(m.faces.size(), 8u);
  EXPECT_TRUE(IsClosed(m));
  EXPECT_FALSE(Validate(m));
}

}  // namespace
}  // namespace lumi
