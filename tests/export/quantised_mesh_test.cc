#include "export/quantised_mesh.h"

#include <gtest/gtest.h>

#include <random>

namespace lumi {
namespace {

Mesh Tetrahedron(double size) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 5}, {size, 0, 5}, {0, size, 5}, {0, 0, 5 + size}};
  mesh.faces = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
  return mesh;
}

std::vector<RenderView> OneView() { return {MakeRenderView(Camera::Pinhole(640, 480, 600, 600, 320, 240), Rigid3{})}; }

TEST(QuantisedMesh, HoldsVerticesWithinHalfAStep) {
  const Mesh mesh = Tetrahedron(1);
  const QuantisedMesh q = Quantise(mesh, OneView());
  EXPECT_EQ(q.bytes_a_coordinate, 2);
  EXPECT_LE(q.error_px, 0.1);
  ASSERT_EQ(q.mesh.vertices.size(), mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    EXPECT_TRUE(((q.mesh.vertices[i] - mesh.vertices[i]).cwiseAbs().array() <= 0.5 * q.step.array() + 1e-12).all());
  EXPECT_EQ(q.bytes.size(), 4 * 3 * 2 + 4 * 3 * 2U);
}

TEST(QuantisedMesh, TakesFinerStepsWhereAPhotoWouldSeeTheCoarseOnes) {
  // A far-off vertex makes the box ten thousand times as large as what the photo looks at.
  Mesh mesh = Tetrahedron(1);
  mesh.vertices.push_back({0, 0, 20000});
  mesh.faces.push_back({0, 1, 4});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> near(0, 1);
  for (int i = 0; i < 50; ++i) mesh.vertices.push_back({near(random), near(random), 5 + near(random)});
  const QuantisedMesh q = Quantise(mesh, OneView());
  EXPECT_EQ(q.bytes_a_coordinate, 3);
  EXPECT_LE(q.error_px, 0.2);
}

TEST(QuantisedMesh, OfAFlatMeshHasNoStepsAcross) {
  Mesh mesh = Tetrahedron(1);
  for (auto& v : mesh.vertices) v.z() = 5;
  const QuantisedMesh q = Quantise(mesh, OneView());
  EXPECT_EQ(q.step.z(), 0);
  for (const auto& v : q.mesh.vertices) EXPECT_EQ(v.z(), 5);
}

TEST(QuantisedMesh, OfNothingIsNothing) {
  const QuantisedMesh q = Quantise(Mesh(), OneView());
  EXPECT_TRUE(q.bytes.empty());
  EXPECT_EQ(q.error_px, 0);
}

}  // namespace
}  // namespace lumi
