// Geometry next to its degenerate neighbours, approached step by step, against 50 digits: error at most
// 10 x condition x epsilon of double, and a named non-answer (nullopt) where there is no answer.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <limits>

#include "random_scene.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/projection.h"
#include "scene/triangulation/triangulate.h"

namespace lumi {
namespace {

using Big = boost::multiprecision::cpp_bin_float_50;
using Big3 = std::array<Big, 3>;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kSafety = 10;

Big3 ToBig(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Big Dot(const Big3& a, const Big3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Where the ray c + s d meets n . x + e = 0.
Big3 Meet(const Big3& c, const Big3& d, const Big3& n, const Big& e) {
  const Big s = -(Dot(n, c) + e) / Dot(n, d);
  return {c[0] + s * d[0], c[1] + s * d[1], c[2] + s * d[2]};
}

double Distance(const Eigen::Vector3d& a, const Big3& b) {
  Big sum = 0;
  for (int i = 0; i < 3; ++i) {
    const Big diff = Big(a[i]) - b[static_cast<std::size_t>(i)];
    sum += diff * diff;
  }
  return static_cast<double>(sqrt(sum));
}

TEST(HardCase, InverseProjectionOntoAPlaneThatTurnsEdgeOn) {
  // Camera at the origin, f = 1 px, so that the ray of pixel (x, y) is (x, y, 1) without rounding.
  const Matrix34d P = Rigid3{}.Matrix();
  int steps = 0, answered = 0;
  for (double a = 1e-2; a >= 1e-15; a /= 10, ++steps) {
    const Eigen::Vector3d n(0, 1, -a);  // seen under the angle a
    const Plane plane(n.x(), n.y(), n.z(), -1);
    const Eigen::Vector2d pixel(0.25, 4 * a);
    const auto x = InverseProject(P, plane, pixel);
    if (!x || x->w() == 0) continue;  // at infinity or refused: no wrong number either
    ++answered;
    const Big3 truth = Meet({0, 0, 0}, {Big(0.25), Big(4 * a), 1}, ToBig(n), -1);
    const double length = static_cast<double>(sqrt(Dot(truth, truth)));
    const double condition = 1 / (3 * a);  // |n||d| / |n . d|
    EXPECT_LT(Distance(x->hnormalized(), truth), kSafety * condition * kEpsilon * length) << "angle " << a;
  }
  EXPECT_EQ(answered, steps);
}

TEST(HardCase, PlaneApproachingTheCentreOfProjection) {
  const Matrix34d P = Rigid3{}.Matrix();
  int answered = 0;
  for (double e = 1e-2; e >= 1e-15; e /= 10) {
    const Plane plane(0, 0, 1, -e);  // passes the centre at distance e
    const auto x = InverseProject(P, plane, {0.5, -0.25});
    if (!x) continue;
    ++answered;
    const Big3 truth = Meet({0, 0, 0}, {Big(0.5), Big(-0.25), 1}, {0, 0, 1}, -Big(e));
    EXPECT_LT(Distance(x->hnormalized(), truth), kSafety * kEpsilon * (1 + 1 / e) * e) << e;
  }
  EXPECT_GE(answered, 11);                                           // down to 1e-12
  EXPECT_FALSE(InverseProject(P, Plane(0, 0, 1, 0), {0.5, -0.25}));  // through the centre: no answer
  EXPECT_FALSE(PlaneHomography(P, P, Plane(0, 0, 1, 0)));
}

TEST(HardCase, PointsAtInfinityProjectAndComeBack) {
  const Matrix34d P = ProjectionMatrix(test::TestCamera().K(), LookAt({1, 2, 3}, {0, 0, 0}, {0, 0, 1}));
  const Plane at_infinity(0, 0, 0, 1);
  const auto x = InverseProject(P, at_infinity, {100.5, 77.25});
  ASSERT_TRUE(x);
  EXPECT_NEAR(x->w(), 0, 1e-15);
  EXPECT_LT((*Project(P, *x) - Eigen::Vector2d(100.5, 77.25)).norm(), 1e-9);
}

TEST(HardCase, AngleFromOneTenthToTheSmallestAgainstFiftyDigits) {
  test::Random random(3);
  for (double a = 1e-1; a >= 1e-15; a /= 10) {
    const Eigen::Vector3d u = random.Direction();
    const Eigen::Vector3d v = u + a * u.unitOrthogonal();  // rounded: the oracle sees the same doubles
    const Big3 bu = ToBig(u), bv = ToBig(v);
    const Big3 cross{bu[1] * bv[2] - bu[2] * bv[1], bu[2] * bv[0] - bu[0] * bv[2], bu[0] * bv[1] - bu[1] * bv[0]};
    const Big truth = atan2(sqrt(Dot(cross, cross)), Dot(bu, bv));
    // Condition of an angle between vectors known to epsilon: absolute, 1.
    EXPECT_LT(std::abs(AngleBetween(u, v) - static_cast<double>(truth)), kSafety * kEpsilon) << a;
  }
}

TEST(HardCase, TriangulationAsTheBaselineVanishes) {
  const Eigen::Matrix3d K = test::TestCamera().K();
  const Eigen::Vector3d x(0.3, -0.2, 4);
  int answered = 0;
  for (double b = 1e-1; b >= 1e-15; b /= 10) {
    const std::vector<Matrix34d> P{
        ProjectionMatrix(K, Rigid3{}),
        ProjectionMatrix(K, Rigid3{Eigen::Quaterniond::Identity(), Eigen::Vector3d(-b, 0, 0)})};
    const auto t = Triangulate(P, {*Project(P[0], x), *Project(P[1], x)});
    if (!t) continue;  // parallel to rounding: named as no answer
    ++answered;
    EXPECT_TRUE(t->x_in_world.allFinite());
    // Depth = b / angle: its condition is depth / b, on pixels known to epsilon times their size over f.
    EXPECT_LT((t->x_in_world - x).norm(), kSafety * (x.norm() / b) * kEpsilon * x.norm() * 2) << b;
  }
  EXPECT_GE(answered, 6);  // down to 1e-6
  EXPECT_FALSE(Triangulate({ProjectionMatrix(K, Rigid3{}), ProjectionMatrix(K, Rigid3{})}, {{10, 10}, {10, 10}}));
}

TEST(HardCase, CentreOfProjectionUnderLargeOffsets) {
  test::Random random(9);
  for (double offset = 1; offset <= 1e9; offset *= 10) {
    Rigid3 pose = random.PoseAroundBox();
    const Eigen::Vector3d centre = pose.OriginInSource() + Eigen::Vector3d(offset, -offset, offset);
    pose.translation = -(pose.rotation * centre);
    const Eigen::Vector4d c = CentreOfProjection(ProjectionMatrix(test::TestCamera().K(), pose));
    // P's last column already carries the offset's rounding: condition = cond(K) ~ 1e3.
    EXPECT_LT((c.hnormalized() - centre).norm(), kSafety * 1e3 * kEpsilon * centre.norm()) << offset;
  }
}

TEST(HardCase, EpipoleAsTheCamerasMeet) {
  const Eigen::Matrix3d K = test::TestCamera().K();
  const Matrix34d P = ProjectionMatrix(K, Rigid3{});
  int steps = 0, answered = 0;
  for (double d = 1e-2; d >= 1e-13; d /= 10, ++steps) {
    const Matrix34d other = ProjectionMatrix(K, Rigid3{Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, -d)});
    const auto e = Epipole(P, other);
    if (!e) continue;
    ++answered;
    // The direction of a displacement d known to epsilon: condition 1/d, times f in pixels.
    EXPECT_LT((e->hnormalized() - test::TestCamera().PrincipalPointPx()).norm(), kSafety * kEpsilon / d * 530 + 1e-9)
        << d;
  }
  EXPECT_GE(answered, steps - 1);  // down to 1e-12
  EXPECT_FALSE(Epipole(P, P));
}

}  // namespace
}  // namespace lumi
