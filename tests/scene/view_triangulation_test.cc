#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "scene/view_triangulation/lattice_delaunay.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {
namespace {

using Triangles = std::vector<std::array<std::int32_t, 3>>;

std::vector<LatticePoint> RandomLattice(int count, int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<LatticePoint> points{{0, 0}, {width, 0}, {width, height}, {0, height}};
  for (int i = 0; i < count; ++i)
    points.push_back({static_cast<std::int32_t>(random() % static_cast<unsigned>(width + 1)),
                      static_cast<std::int32_t>(random() % static_cast<unsigned>(height + 1))});
  return points;
}

// Every triangle turns positively, together they have the rectangle's area, each inner edge has a triangle on both
// sides: a tiling. No point lies in a triangle's circle: Delaunay's.
void ExpectDelaunay(const std::vector<LatticePoint>& points, const Triangles& triangles) {
  const auto at = [&](std::int32_t v) { return points[static_cast<std::size_t>(v)]; };
  std::int64_t area = 0;
  std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
  for (const auto& t : triangles) {
    const std::int64_t turn = TurnOf(at(t[0]), at(t[1]), at(t[2]));
    ASSERT_GT(turn, 0);
    area += turn;
    for (std::size_t k = 0; k < 3; ++k) ASSERT_EQ(++edges[std::make_pair(t[k], t[(k + 1) % 3])], 1);
  }
  EXPECT_EQ(area, 2 * std::int64_t{points[2].x} * points[2].y);
  for (const auto& [edge, n] : edges) {
    if (edges.count({edge.second, edge.first}) > 0) continue;
    const LatticePoint a = at(edge.first), b = at(edge.second);
    EXPECT_TRUE((a.x == b.x && (a.x == 0 || a.x == points[2].x)) || (a.y == b.y && (a.y == 0 || a.y == points[2].y)));
  }
  std::vector<bool> used(points.size(), false);
  for (const auto& t : triangles) {
    for (const std::int32_t v : t) used[static_cast<std::size_t>(v)] = true;
    for (const LatticePoint& p : points) ASSERT_LE(InCircle(at(t[0]), at(t[1]), at(t[2]), p), 0);
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_TRUE(used[i] ||
                std::find(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(i), points[i]) !=
                    points.begin() + static_cast<std::ptrdiff_t>(i) ||
                std::find(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, points.end(), points[i]) != points.end())
        << i;
}

TEST(LatticeDelaunay, RandomPointsInRectanglesOfAllSizes) {
  unsigned seed = 1;
  for (const int width : {1, 2, 3, 10, 1000, 1 << 20, kMaxLattice})
    for (const int height : {1, 7, 1 << 10, kMaxLattice})
      for (const int count : {0, 1, 2, 40, 150}) {
        const auto points = RandomLattice(count, width, height, seed++);
        ExpectDelaunay(points, TriangulateLattice(points));
      }
}

TEST(LatticeDelaunay, GridsAndLinesAreNothingSpecial) {
  std::vector<LatticePoint> grid{{0, 0}, {12, 0}, {12, 12}, {0, 12}}, line{{0, 0}, {40, 0}, {40, 40}, {0, 40}},
      ring{{0, 0}, {100, 0}, {100, 100}, {0, 100}};
  for (int x = 0; x <= 12; ++x)
    for (int y = 0; y <= 12; ++y) grid.push_back({x, y});
  for (int i = 0; i <= 40; ++i) line.push_back({i, i});
  for (const auto& [x, y] : {std::pair(25, 0),
                             {0, 25},
                             {-25, 0},
                             {0, -25},
                             {7, 24},
                             {-7, 24},
                             {7, -24},
                             {-7, -24},
                             {24, 7},
                             {-24, 7},
                             {24, -7},
                             {-24, -7},
                             {15, 20},
                             {20, 15},
                             {-15, -20},
                             {-20, 15}})
    ring.push_back({50 + x, 50 + y});
  for (const auto& points : {grid, line, ring}) ExpectDelaunay(points, TriangulateLattice(points));
}

TEST(LatticeDelaunay, PredicatesAreExactWhereDoublesAreNot) {
  const std::int32_t m = kMaxLattice;
  // Nearly collinear over the whole range, by one unit.
  EXPECT_EQ(TurnOf({0, 0}, {m, m - 1}, {m - 1, m - 2}), -1);
  EXPECT_EQ(TurnOf({0, 0}, {m, m}, {m - 1, m - 1}), 0);
  // On the circle of the rectangle's corners, and a unit to either side.
  EXPECT_EQ(InCircle({0, 0}, {m, 0}, {m, m}, {0, m}), 0);
  EXPECT_EQ(InCircle({0, 0}, {m, 0}, {m, m}, {1, m}), 1);
  EXPECT_EQ(InCircle({1, 0}, {m, 0}, {m, m}, {0, m}), -1);
}

TEST(LatticeDelaunay, RefusesWhatIsNoRectangle) {
  EXPECT_THROW(TriangulateLattice(std::vector<LatticePoint>{{0, 0}, {1, 0}, {1, 1}}), std::invalid_argument);
  EXPECT_THROW(TriangulateLattice(std::vector<LatticePoint>{{0, 0}, {9, 0}, {9, 9}, {1, 9}}), std::invalid_argument);
  EXPECT_THROW(TriangulateLattice(std::vector<LatticePoint>{{0, 0}, {9, 0}, {9, 9}, {0, 9}, {10, 3}}),
               std::invalid_argument);
}

// --- Views ---------------------------------------------------------------------------------------------------------

const Plane kMetricInfinity(0, 0, 0, 1);
const Eigen::Vector2i kSize(640, 480);

Matrix34d TestCamera(const Eigen::Vector3d& eye = {0.1, -0.2, -3}) {
  Eigen::Matrix3d K;
  K << 500, 0, 320, 0, 520, 240, 0, 0, 1;
  Rigid3 cam_from_world;
  cam_from_world.rotation = Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 0.5).normalized());
  cam_from_world.translation = -(cam_from_world.rotation * eye);
  return ProjectionMatrix(K, cam_from_world);
}

// Points on the plane z = 0.2 x + 0.1 y + offset.
std::vector<Eigen::Vector4d> SlantedPlane(int count, double offset, unsigned seed, double half = 2) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-half, half);
  std::vector<Eigen::Vector4d> X;
  for (int i = 0; i < count; ++i) {
    const double x = uniform(random), y = uniform(random);
    X.emplace_back(x, y, 0.2 * x + 0.1 * y + offset, 1);
  }
  return X;
}

// What holds of every triangulation: it tiles the image, each corner projects where it says, in front, with its kappa.
void ExpectSound(const ViewTriangulation& t, const Matrix34d& P) {
  ASSERT_FALSE(t.triangles.empty());
  double area = 0;
  Eigen::Vector2d low = t.x_px.front(), high = low;
  for (const Eigen::Vector2d& x : t.x_px) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  EXPECT_LE(low.maxCoeff(), 0);
  EXPECT_GE(high.x(), kSize.x());
  EXPECT_GE(high.y(), kSize.y());
  for (const auto& f : t.triangles) {
    const auto at = [&](std::size_t k) { return t.x_px[static_cast<std::size_t>(f[k])]; };
    const Eigen::Vector2d u = at(1) - at(0), v = at(2) - at(0);
    const double turn = u.x() * v.y() - u.y() * v.x();
    ASSERT_LT(turn, 0);
    area -= turn / 2;
  }
  const double whole = (high - low).prod();
  EXPECT_NEAR(area, whole, 1e-9 * whole);
  constexpr double kPixelTolerance = 1e-6;
  for (std::size_t i = 0; i < t.vertices.size(); ++i) {
    ASSERT_TRUE(t.vertices[i].allFinite());
    const auto x = Project(P, t.vertices[i]);
    ASSERT_TRUE(x.has_value()) << i;
    EXPECT_LT((*x - t.x_px[i]).norm(), kPixelTolerance);
    EXPECT_NEAR((P * t.vertices[i]).z(), 1, 1e-9);
  }
}

TEST(ViewTriangulation, APlaneOfPointsIsThatPlaneOutToTheBorder) {
  const Matrix34d P = TestCamera();
  const auto X = SlantedPlane(400, 0, 3, 1.5);
  const ViewTriangulation t = TriangulateView(P, kSize, X, kMetricInfinity);
  ExpectSound(t, P);
  EXPECT_EQ(t.outliers, 0U);
  EXPECT_GT(t.used, 300U);
  const Mesh mesh = MeshOf(t);
  EXPECT_EQ(mesh.vertices.size(), t.vertices.size());
  EXPECT_EQ(mesh.faces.size(), t.triangles.size());
  // Points that are not on the border lie on the plane as far as half a lattice unit (1/512 px) moves them.
  double off_points = 0, off_border = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& x = mesh.vertices[i];
    double& worst = t.point[i] >= 0 ? off_points : off_border;
    worst = std::max(worst, std::abs(x.z() - 0.2 * x.x() - 0.1 * x.y()));
  }
  EXPECT_LT(off_points, 3.0 / 500 / 256);
  EXPECT_LT(off_border, 0.5);  // extended 200 px beyond the points, leaning towards their mean: no flight to infinity
}

TEST(ViewTriangulation, FacesTurnTheirFrontsToTheCamera) {
  const Eigen::Vector3d eye(0.1, -0.2, -3);
  const ViewTriangulation t = TriangulateView(TestCamera(eye), kSize, SlantedPlane(200, 0, 4), kMetricInfinity);
  const Mesh mesh = MeshOf(t);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    EXPECT_GT(mesh.FaceNormal(f).dot(eye - mesh.vertices[static_cast<std::size_t>(mesh.faces[f][0])]), 0);
}

// The same photos in another frame: the same triangles, and vertices that are moved along.
TEST(ViewTriangulation, AProjectiveTransformationOfTheSceneChangesNothing) {
  const Matrix34d P = TestCamera();
  std::vector<Eigen::Vector4d> X = SlantedPlane(150, 0, 5);
  for (const Eigen::Vector4d& x : SlantedPlane(150, 1.5, 6)) X.push_back(x);
  const ViewTriangulation here = TriangulateView(P, kSize, X, kMetricInfinity);
  Eigen::Matrix4d H;
  H << 1.1, 0.2, -0.1, 0.3, 0.05, 0.9, 0.3, -0.2, -0.2, 0.1, 1.2, 0.5, 0.03, -0.02, 0.05, 0.8;
  const Eigen::Matrix4d inverse = H.inverse();
  const Matrix34d P_there = 0.37 * P * inverse;  // P up to scale, too
  std::vector<Eigen::Vector4d> X_there;
  for (const Eigen::Vector4d& x : X) X_there.push_back(H * x);
  const ViewTriangulation there =
      TriangulateView(P_there, kSize, X_there, Plane(inverse.transpose() * kMetricInfinity));
  ExpectSound(there, P_there);
  ASSERT_EQ(there.triangles, here.triangles);
  for (std::size_t i = 0; i < here.vertices.size(); ++i) {
    const Eigen::Vector4d moved = (H * here.vertices[i]).normalized(), other = there.vertices[i].normalized();
    EXPECT_LT((moved - other).norm(), 1e-9) << i;
  }
  // Without a plane at infinity the triangles still run through the points.
  const ViewTriangulation blind = TriangulateView(P_there, kSize, X_there, std::nullopt);
  ExpectSound(blind, P_there);
  for (std::size_t i = 0; i < blind.vertices.size(); ++i)
    if (blind.point[i] >= 0) {
      const Eigen::Vector4d& x = X_there[static_cast<std::size_t>(blind.point[i])];
      EXPECT_LT((blind.vertices[i].normalized() - x.normalized()).norm(), 1e-4);
    }
}

TEST(ViewTriangulation, ATrianglesPlaneCarriesItsPixelsToOtherViews) {
  const Matrix34d P = TestCamera(), other = TestCamera({0.7, 0.1, -2.8});
  const ViewTriangulation t = TriangulateView(P, kSize, SlantedPlane(80, 0, 7), kMetricInfinity);
  const Eigen::Vector4d C = CentreOfProjection(P);
  for (std::size_t f = 0; f < t.triangles.size(); ++f) {
    const Plane plane = PlaneOfTriangle(t, f, C);
    EXPECT_GT(plane.dot(C), 0);
    const auto H = PlaneHomography(other, P, plane);
    ASSERT_TRUE(H.has_value());
    for (const std::int32_t v : t.triangles[f]) {
      const Eigen::Vector2d x = (*H * t.x_px[static_cast<std::size_t>(v)].homogeneous()).hnormalized();
      const auto direct = Project(other, t.vertices[static_cast<std::size_t>(v)]);
      ASSERT_TRUE(direct.has_value());
      EXPECT_LT((x - *direct).norm(), 1e-5 * (1 + direct->norm()));
    }
  }
}

TEST(ViewTriangulation, PointsBehindOutsideAndWrongOnesAreLeftOut) {
  const Matrix34d P = TestCamera();
  std::vector<Eigen::Vector4d> X = SlantedPlane(300, 0, 8);
  ViewTriangulationOptions options;
  options.outlier_spread = 0.3;  // the plane is slanted, and sparse at its border
  const std::size_t good = TriangulateView(P, kSize, X, kMetricInfinity, options).used;
  const std::size_t outside = TriangulateView(P, kSize, X, kMetricInfinity, options).outside;
  X.emplace_back(0, 0, -10, 1);  // behind
  X.emplace_back(std::nan(""), 0, 0, 1);
  X.emplace_back(0, 0, 1, 0);            // at infinity
  X.emplace_back(5, 0, 0, 1);            // beside the image
  X.emplace_back(0.05, -0.15, -2.5, 1);  // in front of the plane, alone
  X.push_back(X[0]);                     // twice
  const ViewTriangulation t = TriangulateView(P, kSize, X, kMetricInfinity, options);
  ExpectSound(t, P);
  EXPECT_EQ(t.behind, 2U);
  EXPECT_EQ(t.outside, outside + 1);
  EXPECT_EQ(t.outliers, 2U);
  EXPECT_NEAR(static_cast<double>(t.used), static_cast<double>(good), 1);  // the one alone may have shared a cell
  EXPECT_EQ(t.used + t.behind + t.outside + t.merged + t.outliers, X.size());
}

TEST(ViewTriangulation, OfCoincidentImagesTheNearestPointStays) {
  const Matrix34d P = TestCamera();
  const Eigen::Vector4d far(0.3, 0.2, 1, 1), eye(0.1, -0.2, -3, 1);
  const Eigen::Vector4d near = 0.5 * (far + eye);
  const ViewTriangulation t = TriangulateView(P, kSize, std::vector{far, near}, kMetricInfinity);
  EXPECT_EQ(t.merged, 1U);
  EXPECT_EQ(std::count(t.point.begin(), t.point.end(), 1), 1);
  // Where nothing says which is nearer, the first stays.
  const ViewTriangulation blind = TriangulateView(P, kSize, std::vector{far, near}, std::nullopt);
  EXPECT_EQ(std::count(blind.point.begin(), blind.point.end(), 0), 1);
}

TEST(ViewTriangulation, TheReliablePointsOfASceneAreTaken) {
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(640, 480, 500, 500, 320, 240));
  for (int i = 0; i < 3; ++i) {
    View view;
    view.name = std::to_string(i);
    view.camera.value = 0;
    view.cam_from_world.translation = Eigen::Vector3d(-0.5 * i, 0, 0);
    scene.views.push_back(view);
  }
  const auto point = [&](const Eigen::Vector3d& x, std::vector<int> views, double error_px) {
    Point p;
    p.x_in_world = x;
    p.error_px = error_px;
    for (const int v : views) p.track.push_back({ViewId{v}, Eigen::Vector2d::Zero()});
    scene.points.push_back(p);
  };
  point({0, 0, 5}, {0, 1}, 0.3);
  point({0, 1, 5}, {0, 1, 2}, 0.3);
  point({0, 0, 5}, {0, 1}, 9);         // inaccurate
  point({0, 0, 500}, {0, 1, 2}, 0.3);  // far: its rays are parallel
  point({0, std::nan(""), 5}, {0, 1}, 0.3);
  point({0, 0, 5}, {2}, 0.3);
  const auto X = StructurePoints(scene);
  ASSERT_EQ(X.size(), 2U);
  EXPECT_EQ(X[0], Eigen::Vector4d(0, 1, 5, 1));  // seen by most
  EXPECT_EQ(X[1], Eigen::Vector4d(0, 0, 5, 1));
  EXPECT_EQ(*PlaneAtInfinity(scene), kMetricInfinity);
  scene.frame = Frame::kProjective;
  EXPECT_FALSE(PlaneAtInfinity(scene).has_value());
}

}  // namespace
}  // namespace lumi
