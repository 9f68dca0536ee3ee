#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {
namespace {

const Plane kAtInfinity(0, 0, 0, 1);
const Eigen::Vector2i kImage(640, 480);

Matrix34d Pinhole(const Eigen::Vector3d& eye) {
  Eigen::Matrix3d K;
  K << 500, 0, 320, 0, 500, 240, 0, 0, 1;
  Rigid3 cam_from_world;
  cam_from_world.translation = -eye;
  return ProjectionMatrix(K, cam_from_world);
}

// The image and more is tiled, and every corner is a finite point in front of the camera that projects where it says.
void ExpectTiled(const ViewTriangulation& t, const Matrix34d& P, const std::string& what, double tolerance_px = 1e-5) {
  ASSERT_FALSE(t.triangles.empty()) << what;
  double area = 0;
  for (const auto& f : t.triangles) {
    const auto at = [&](std::size_t k) { return t.x_px[static_cast<std::size_t>(f[k])]; };
    const Eigen::Vector2d u = at(1) - at(0), v = at(2) - at(0);
    ASSERT_LT(u.x() * v.y() - u.y() * v.x(), 0) << what;
    area -= (u.x() * v.y() - u.y() * v.x()) / 2;
  }
  EXPECT_GE(area, 640.0 * 480) << what;
  for (std::size_t i = 0; i < t.vertices.size(); ++i) {
    const auto x = Project(P, t.vertices[i]);
    ASSERT_TRUE(t.vertices[i].allFinite() && x) << what;
    EXPECT_LT((*x - t.x_px[i]).norm(), tolerance_px) << what;
  }
}

std::vector<Eigen::Vector4d> Cloud(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Eigen::Vector4d> X;
  for (int i = 0; i < count; ++i) {
    const double x = uniform(random), y = uniform(random), z = 4 + 0.5 * uniform(random);
    X.emplace_back(x, y, z, 1);
  }
  return X;
}

TEST(ViewTriangulationHardCase, NoneOneTwoAndThreePoints) {
  const Matrix34d P = Pinhole({0, 0, 0});
  EXPECT_TRUE(TriangulateView(P, kImage, {}, kAtInfinity).triangles.empty());
  std::vector<Eigen::Vector4d> X{{0, 0, -1, 1}};
  EXPECT_TRUE(TriangulateView(P, kImage, X, kAtInfinity).triangles.empty());
  X.clear();
  for (const Eigen::Vector4d& x :
       {Eigen::Vector4d(0, 0, 4, 1), Eigen::Vector4d(1, 0, 4, 1), Eigen::Vector4d(0, 1, 4, 1)}) {
    X.push_back(x);
    const ViewTriangulation t = TriangulateView(P, kImage, X, kAtInfinity);
    ExpectTiled(t, P, std::to_string(X.size()) + " points");
    EXPECT_EQ(t.used, X.size());
    for (const Eigen::Vector3d& v : MeshOf(t).vertices) EXPECT_NEAR(v.z(), 4, 1e-9);  // all that is known
  }
}

TEST(ViewTriangulationHardCase, CollinearImagesApproachedStepByStep) {
  const Matrix34d P = Pinhole({0, 0, 0});
  for (double off = 1e-1; off > 1e-17; off *= 0.1) {
    std::vector<Eigen::Vector4d> X;
    for (int i = -20; i <= 20; ++i) X.emplace_back(0.1 * i, 0.05 * i + off * std::sin(7.0 * i), 4 + 0.02 * i, 1);
    ExpectTiled(TriangulateView(P, kImage, X, kAtInfinity), P, "off " + std::to_string(off));
  }
}

TEST(ViewTriangulationHardCase, CoincidentImagesApproachedStepByStep) {
  const Matrix34d P = Pinhole({0, 0, 0});
  ViewTriangulationOptions every;
  every.merge_px = 0;
  for (double gap = 1e-1; gap > 1e-17; gap *= 0.1) {
    std::vector<Eigen::Vector4d> X = Cloud(100, 1);
    const std::size_t n = X.size();
    for (std::size_t i = 0; i < n; ++i) X.emplace_back(X[i] + gap * Eigen::Vector4d(1, -1, 0, 0));
    ExpectTiled(TriangulateView(P, kImage, X, kAtInfinity), P, "gap " + std::to_string(gap));
    ExpectTiled(TriangulateView(P, kImage, X, kAtInfinity, every), P, "unmerged, gap " + std::to_string(gap));
  }
}

TEST(ViewTriangulationHardCase, PointsThatApproachThePrincipalPlane) {
  const Matrix34d P = Pinhole({0, 0, 0});
  for (double depth = 1e-2; depth > 1e-18; depth *= 0.1)
    for (const double sign : {1.0, -1.0}) {
      std::vector<Eigen::Vector4d> X = Cloud(50, 2);
      X.emplace_back(0.1 * depth, 0, sign * depth, 1);  // towards the centre of projection
      X.emplace_back(1, 0, sign * depth, 1);            // towards the side
      ExpectTiled(TriangulateView(P, kImage, X, kAtInfinity), P, "depth " + std::to_string(sign * depth));
    }
}

TEST(ViewTriangulationHardCase, PointsAtInfinityAndBeyond) {
  const Matrix34d P = Pinhole({0, 0, 0});
  for (double w = 1e-2; w > 1e-18; w *= 0.1)
    for (const double sign : {1.0, -1.0, 0.0}) {
      std::vector<Eigen::Vector4d> X = Cloud(50, 3);
      X.emplace_back(0.1, 0.1, 1, sign * w);
      const ViewTriangulation t = TriangulateView(P, kImage, X, kAtInfinity);
      ExpectTiled(t, P, "w " + std::to_string(sign * w));
      for (const Eigen::Vector4d& v : t.vertices) EXPECT_GT(v.w(), 0);
    }
}

TEST(ViewTriangulationHardCase, AnyScaleOfTheWorldAndAnyPlaceOfItsOrigin) {
  const std::vector<Eigen::Vector4d> X = Cloud(300, 4);
  const ViewTriangulation here = TriangulateView(Pinhole({0, 0, 0}), kImage, X, kAtInfinity);
  for (const double scale : {1e-9, 1e-6, 1e6, 1e9}) {
    std::vector<Eigen::Vector4d> scaled;
    for (const Eigen::Vector4d& x : X) scaled.emplace_back(scale * x.x(), scale * x.y(), scale * x.z(), 1);
    const ViewTriangulation t = TriangulateView(Pinhole({0, 0, 0}), kImage, scaled, kAtInfinity);
    EXPECT_EQ(t.triangles.size(), here.triangles.size()) << scale;
    ExpectTiled(t, Pinhole({0, 0, 0}), "scale " + std::to_string(scale));
  }
  for (double offset = 1; offset <= 1e7; offset *= 10) {
    const Eigen::Vector3d eye(offset, -offset, offset);
    std::vector<Eigen::Vector4d> moved;
    for (const Eigen::Vector4d& x : X) moved.emplace_back(x.x() + eye.x(), x.y() + eye.y(), x.z() + eye.z(), 1);
    const Matrix34d P = Pinhole(eye);
    const ViewTriangulation t = TriangulateView(P, kImage, moved, kAtInfinity);
    // P x cancels to the offset's rounding.
    ExpectTiled(t, P, "offset " + std::to_string(offset), 1e-6 + 1e3 * offset * 1e-15 * 500);
    const Mesh mesh = MeshOf(t), mesh_here = MeshOf(here);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) ASSERT_LT((mesh.vertices[i] - eye).norm(), 20) << offset;
  }
}

// An affine camera: its centre lies at infinity, which then is no plane to measure depth from.
TEST(ViewTriangulationHardCase, CamerasThatBecomeAffine) {
  for (double far = 1e1; far <= 1e12; far *= 10) {
    // From far away with a long lens: the limit is an orthographic view.
    Matrix34d P = Pinhole({0, 0, 4 - far});
    P.topRows<2>() *= far / 4;
    P.row(0) += (320 - 320 * far / 4) * P.row(2);
    P.row(1) += (240 - 240 * far / 4) * P.row(2);
    P /= far;
    const ViewTriangulation t = TriangulateView(P, kImage, Cloud(100, 5), kAtInfinity);
    ExpectTiled(t, P, "from " + std::to_string(far), 1e-3);
  }
  Matrix34d P = Matrix34d::Zero();
  P.topLeftCorner<2, 2>() = 125 * Eigen::Matrix2d::Identity();
  P.col(3) = Eigen::Vector3d(320, 240, 1);
  ExpectTiled(TriangulateView(P, kImage, Cloud(100, 5), kAtInfinity), P, "affine");
}

TEST(ViewTriangulationHardCase, MatricesAndOptionsWithoutSenseAreRefused) {
  const auto X = Cloud(10, 6);
  Matrix34d P = Pinhole({0, 0, 0});
  P.row(1) = 2 * P.row(0);
  EXPECT_THROW(TriangulateView(P, kImage, X, kAtInfinity), std::invalid_argument);
  EXPECT_THROW(TriangulateView(Pinhole({0, 0, 0}), {0, 480}, X, kAtInfinity), std::invalid_argument);
  P(0, 0) = std::nan("");
  EXPECT_THROW(TriangulateView(P, kImage, X, kAtInfinity), std::invalid_argument);
  ViewTriangulationOptions wrong;
  wrong.border_samples = 0;
  EXPECT_THROW(TriangulateView(Pinhole({0, 0, 0}), kImage, X, kAtInfinity, wrong), std::invalid_argument);
}

}  // namespace
}  // namespace lumi
