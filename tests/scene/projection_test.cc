#include "scene/geometry/projection.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "random_scene.h"
#include "scene/geometry/angle.h"

namespace lumi {
namespace {

using test::Random;

// Pixels of magnitude 1e3 through a handful of double operations.
constexpr double kTolerancePx = 1e-9;

TEST(Projection, PointOnTheOpticalAxisFallsOnThePrincipalPoint) {
  const Rigid3 pose = LookAt({1, 2, 3}, {4, -1, 0}, {0, 1, 0});
  const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), pose);
  const auto x = Project(P, Eigen::Vector3d(4, -1, 0));
  ASSERT_TRUE(x);
  EXPECT_NEAR(x->x(), 318.5, kTolerancePx);
  EXPECT_NEAR(x->y(), 241.25, kTolerancePx);
}

TEST(Projection, LookAtPutsUpUpwardsInTheImage) {
  const Rigid3 pose = LookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0});
  const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), pose);
  EXPECT_LT(Project(P, Eigen::Vector3d(0, 1, 0))->y(), Project(P, Eigen::Vector3d(0, 0, 0))->y());
  EXPECT_GT(pose.R().determinant(), 0.99);
}

TEST(Projection, PointBehindHasNoPixel) {
  const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), LookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}));
  EXPECT_FALSE(Project(P, Eigen::Vector3d(0, 0, 6)));
  EXPECT_TRUE(Project(P, Eigen::Vector4d(0, 0, -1, 0)));  // a point at infinity in front
  EXPECT_FALSE(Project(P, Eigen::Vector4d(0, 0, 1, 0)));
}

TEST(Projection, SignIsFixedByAPointInFront) {
  Random random(7);
  for (int i = 0; i < 100; ++i) {
    const Rigid3 pose = random.PoseAroundBox();
    const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), pose);
    const Eigen::Vector4d inside(0.1, 0.1, 0, 1);
    EXPECT_EQ(WithSign(-3.0 * P, inside), 3.0 * P);
    const Eigen::Vector4d centre = CentreOfProjection(-P);
    EXPECT_LT((centre.hnormalized() - pose.OriginInSource()).norm(), 1e-11);
  }
  const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), Rigid3{});
  EXPECT_THROW(WithSign(P, Eigen::Vector4d(1, 2, 0, 1)), std::invalid_argument);
}

TEST(Projection, RayThroughAPixelProjectsBack) {
  Random random(11);
  for (int i = 0; i < 200; ++i) {
    const Rigid3 pose = random.PoseAroundBox();
    const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), pose);
    const Eigen::Vector2d x(random.Uniform(0, 640), random.Uniform(0, 480));
    const auto d = RayDirection(random.Uniform(-1, 1) < 0 ? Matrix34d(-P) : P, x);
    ASSERT_TRUE(d);
    const auto back = Project(P, Eigen::Vector3d(pose.OriginInSource() + 2.5 * d->normalized()));
    // A negated matrix points its rays the other way: front is what its sign says.
    if (back) {
      EXPECT_LT((*back - x).norm(), kTolerancePx);
    }
  }
}

TEST(Projection, InverseProjectionLiesOnThePlaneAndProjectsBack) {
  Random random(13);
  for (int i = 0; i < 500; ++i) {
    const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), random.PoseAroundBox());
    const Eigen::Vector3d on_plane = random.InBox(0.5), n = random.Direction();
    const Plane plane(n.x(), n.y(), n.z(), -n.dot(on_plane));
    const auto x = Project(P, on_plane);
    ASSERT_TRUE(x);
    const auto back = InverseProject(P, plane, *x);
    ASSERT_TRUE(back);
    // Edge-on planes stretch a pixel's rounding along the ray: the tolerance follows the incidence.
    const Eigen::Vector3d ray = *RayDirection(P, *x);
    const double incidence = std::abs(n.dot(ray.normalized()));
    EXPECT_LT((back->hnormalized() - on_plane).norm(), 1e-11 / incidence);
  }
}

TEST(Projection, HomographyOfAPlaneAgreesWithItsPoints) {
  Random random(17);
  for (int i = 0; i < 300; ++i) {
    const Matrix34d A = ProjectionMatrix(test::TestCamera().K(), random.PoseAroundBox());
    const Matrix34d B = ProjectionMatrix(test::TestCamera().K(), random.PoseAroundBox());
    const Eigen::Vector3d n = random.Direction(), p = random.InBox(0.4);
    const Plane plane(n.x(), n.y(), n.z(), -n.dot(p));
    const auto H = PlaneHomography(B, A, plane);
    ASSERT_TRUE(H);
    const double incidence = std::abs(n.dot(RayDirection(A, *Project(A, p))->normalized()));
    if (incidence < 0.05) continue;
    const Eigen::Vector3d b = *H * Project(A, p)->homogeneous();
    EXPECT_LT((b.hnormalized() - *Project(B, p)).norm(), 1e-8 / incidence);
  }
}

TEST(Projection, EpipoleIsWhereTheOtherCameraStands) {
  const Eigen::Matrix3d K = test::TestCamera().K();
  const Matrix34d P = ProjectionMatrix(K, LookAt({0, 0, 5}, {0, 0, 0}, {0, 1, 0}));
  const Matrix34d in_front = ProjectionMatrix(K, LookAt({0.5, 0.2, 1}, {0, 0, 0}, {0, 1, 0}));
  const auto e = Epipole(P, in_front);
  ASSERT_TRUE(e);
  EXPECT_GT(e->z(), 0);
  EXPECT_LT((e->hnormalized() - *Project(P, Eigen::Vector3d(0.5, 0.2, 1))).norm(), kTolerancePx);
  const Matrix34d behind = ProjectionMatrix(K, LookAt({0, 0, 9}, {0, 0, 0}, {0, 1, 0}));
  const auto b = Epipole(P, behind);
  ASSERT_TRUE(b);
  EXPECT_LT(b->z(), 0);  // behind: the image of the centre on the line extended backwards
  EXPECT_LT((b->hnormalized() - Eigen::Vector2d(318.5, 241.25)).norm(), 1e-9);
  EXPECT_FALSE(Epipole(P, P));
}

TEST(Angle, IsAccurateNearZeroAndNearPi) {
  for (double a = 1e-1; a > 1e-15; a /= 10) {
    const Eigen::Vector3d u(1, 0, 0), v(std::cos(a), std::sin(a), 0);
    EXPECT_NEAR(AngleBetween(u, v), a, 4e-16);
    EXPECT_NEAR(AngleBetween(u, Eigen::Vector3d(-v)), 3.14159265358979323846 - a, 9e-16);
  }
}

}  // namespace
}  // namespace lumi
