#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "proxy/hull/coverage.h"
#include "proxy/hull/soundness.h"
#include "proxy/simplify/halfspace_program.h"
#include "proxy/simplify/mesh_topology.h"
#include "proxy/simplify/pixel_scale.h"
#include "proxy/simplify/self_intersection.h"
#include "proxy/simplify/simplify.h"
#include "proxy/simplify/small_parts.h"
#include "proxy/simplify/tight_wrap.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "tests/proxy/simplify_meshes.h"

namespace lumi::test {
namespace {

// A millionth of a body's size: what EnclosedSurface::kMargin allows ten times over, and far below any pixel.
constexpr double kSlack = 1e-6;

SimplifiedMesh Simplified(const Mesh& mesh, std::size_t faces, SimplifyMethod method) {
  return Simplify(mesh, {faces}, method, SilentProgress()).front();
}

TEST(HalfspaceProgram, FindsTheCornerThatALinearProgramMeans) {
  // Three planes that meet at (1, 2, 3), and a fourth that says nothing.
  const std::vector<HalfSpace> planes = {{{1, 0, 0}, 1}, {{0, 1, 0}, 2}, {{0, 0, 1}, 3}, {{0, 0, 1}, -5}};
  const auto x = NearestAllowed(-1000 * Eigen::Vector3d(1, 1, 1).normalized(), planes);
  ASSERT_TRUE(x);
  EXPECT_LT((*x - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_FALSE(NearestAllowed(Eigen::Vector3d::Zero(), std::vector<HalfSpace>{{{1, 0, 0}, 1}, {{-1, 0, 0}, 1}}));
  EXPECT_EQ(*NearestAllowed(Eigen::Vector3d(4, 5, 6), std::vector<HalfSpace>{}), Eigen::Vector3d(4, 5, 6));
}

// Against the answer by trying every triple, pair and single plane.
TEST(HalfspaceProgram, AgreesWithTryingEverySubsetOfPlanes) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int feasible = 0;
  for (int trial = 0; trial < 400; ++trial) {
    std::vector<HalfSpace> planes(3 + random() % 10);
    for (HalfSpace& h : planes) {
      h.normal = Eigen::Vector3d(normal(random), normal(random), normal(random) + 0.8).normalized();
      h.offset = 0.3 * normal(random);
    }
    const Eigen::Vector3d goal(normal(random), normal(random), -5);
    double best = std::numeric_limits<double>::infinity();
    const auto consider = [&](const Eigen::Vector3d& x) {
      for (const HalfSpace& h : planes)
        if (!(h.normal.dot(x) >= h.offset - 1e-9)) return;
      best = std::min(best, (x - goal).norm());
    };
    consider(goal);
    for (std::size_t i = 0; i < planes.size(); ++i) {
      consider(goal + (planes[i].offset - planes[i].normal.dot(goal)) * planes[i].normal);
      for (std::size_t j = 0; j < i; ++j) {
        Eigen::MatrixXd two(2, 3);
        two << planes[i].normal.transpose(), planes[j].normal.transpose();
        const Eigen::Vector2d missing = Eigen::Vector2d(planes[i].offset, planes[j].offset) - two * goal;
        consider(goal + two.transpose() * (two * two.transpose()).inverse() * missing);
        for (std::size_t k = 0; k < j; ++k) {
          Eigen::Matrix3d three;
          three << planes[i].normal.transpose(), planes[j].normal.transpose(), planes[k].normal.transpose();
          consider(three.inverse() * Eigen::Vector3d(planes[i].offset, planes[j].offset, planes[k].offset));
        }
      }
    }
    const auto x = NearestAllowed(goal, planes);
    ASSERT_EQ(x.has_value(), std::isfinite(best)) << trial;
    if (!x) continue;
    ++feasible;
    EXPECT_NEAR((*x - goal).norm(), best, 1e-7) << trial;
  }
  EXPECT_GT(feasible, 100);
}

TEST(KeepHull, ACubeOfManyFacesBecomesTheCubeItself) {
  const SimplifiedMesh cube = Simplified(SubdividedCube(8), 12, SimplifyMethod::kKeepHull);
  EXPECT_EQ(cube.mesh.faces.size(), 12u);
  EXPECT_TRUE(cube.reached);
  EXPECT_NEAR(EnclosedVolume(cube.mesh), 1, 1e-12);
  EXPECT_TRUE(CheckSoundness(cube.mesh).IsSolid()) << CheckSoundness(cube.mesh).Describe();
  // Turned, so that no plane is exact.
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const SimplifiedMesh turned =
      Simplified(MappedVertices(SubdividedCube(8), [&](const Eigen::Vector3d& x) { return Eigen::Vector3d(turn * x); }),
                 12, SimplifyMethod::kKeepHull);
  EXPECT_EQ(turned.mesh.faces.size(), 12u);
  EXPECT_NEAR(EnclosedVolume(turned.mesh), 1, 1e-9);
}

TEST(KeepHull, EnclosesTheFormerAndStaysTight) {
  struct Case {
    const char* name;
    Mesh mesh;
    double most_volume;  // measured 1.03, 1.05, 1.10: a third of the excess more
  };
  for (const Case& c : {Case{"ball", BallMesh(14), 1.04}, Case{"bumpy ball", BumpyBall(16), 1.08},
                        Case{"ring", TorusMesh(40, 20), 1.14}}) {
    const SimplifiedMesh hull = Simplified(c.mesh, 200, SimplifyMethod::kKeepHull);
    EXPECT_TRUE(hull.reached) << c.name;
    EXPECT_LE(hull.mesh.faces.size(), 200u) << c.name;
    EXPECT_EQ(Escaped(c.mesh, hull.mesh, kSlack), 0u) << c.name;
    const Soundness sound = CheckSoundness(hull.mesh);
    EXPECT_TRUE(sound.IsSolid()) << c.name << ": " << sound.Describe();
    EXPECT_FALSE(IntersectsItself(hull.mesh)) << c.name;
    const double ratio = EnclosedVolume(hull.mesh) / EnclosedVolume(c.mesh);
    std::printf("%s: %zu faces of %zu, volume ratio %.4f\n", c.name, hull.mesh.faces.size(), c.mesh.faces.size(),
                ratio);
    EXPECT_GE(ratio, 1) << c.name;
    EXPECT_LE(ratio, c.most_volume) << c.name;
  }
}

// What a proxy is for: silhouettes that cover, pixel by pixel.
TEST(KeepHull, EverySilhouetteCoversTheFormerOne) {
  const Mesh body = BumpyBall(14);
  const Mesh hull = Simplified(body, 100, SimplifyMethod::kKeepHull).mesh;
  const Mesh nearest = Simplified(body, 100, SimplifyMethod::kQuadric).mesh;
  double uncovered_by_nearest = 0;
  for (int n = 0; n < 12; ++n) {
    const Eigen::Vector3d eye(5 * std::cos(n * 0.5), 5 * std::sin(n * 0.5), n % 3 - 1.0);
    const Eigen::Vector3d z = -eye.normalized(), x = Eigen::Vector3d::UnitZ().cross(z).normalized();
    Eigen::Matrix3d K = Eigen::Matrix3d::Identity(), R;
    K << 400, 0, 150, 0, 400, 150, 0, 0, 1;
    R << x.transpose(), z.cross(x).transpose(), z.transpose();
    SilhouetteView view;
    view.P.leftCols<3>() = K * R;
    view.P.col(3) = -K * R * eye;
    view.mask = RenderOutline(body, view.P, 300, 300);
    EXPECT_EQ(MeasureSilhouette(hull, view).coverage, 1) << n;
    uncovered_by_nearest = std::max(uncovered_by_nearest, 1 - MeasureSilhouette(nearest, view).coverage);
  }
  EXPECT_GT(uncovered_by_nearest, 0.001);  // the other way does not: the test can tell
}

TEST(KeepHull, TheSameBytesForAnyNumberOfThreads) {
  const Mesh body = BumpyBall(14);
  SetThreadCount(1);
  const Mesh one = Simplified(body, 400, SimplifyMethod::kKeepHull).mesh;
  SetThreadCount(3);
  const Mesh three = Simplified(body, 400, SimplifyMethod::kKeepHull).mesh;
  SetThreadCount(0);
  ASSERT_EQ(one.faces, three.faces);
  EXPECT_EQ(one.vertices, three.vertices);
}

TEST(Quadric, FollowsTheSurfaceAndKeepsItsBorders) {
  const Mesh ball = BallMesh(20);
  const SimplifiedMesh simple = Simplified(ball, 300, SimplifyMethod::kQuadric);
  EXPECT_TRUE(CheckSoundness(simple.mesh).IsSolid());
  EXPECT_NEAR(EnclosedVolume(simple.mesh) / EnclosedVolume(ball), 1, 0.03);

  const Mesh sheet = WavySheet(40);
  const SimplifiedMesh coarse = Simplified(sheet, 200, SimplifyMethod::kQuadric);
  const Soundness sound = CheckSoundness(coarse.mesh);
  EXPECT_TRUE(sound.manifold);
  EXPECT_EQ(sound.degenerate_faces, 0u);
  EXPECT_LE(coarse.mesh.faces.size(), 200u);
  // Seen from above it still fills the unit square, to a hundredth of its side.
  double area = 0;
  for (const auto& f : coarse.mesh.faces) {
    const auto at = [&](std::size_t k) { return coarse.mesh.vertices[static_cast<std::size_t>(f[k])]; };
    const double z = (at(1) - at(0)).cross(at(2) - at(0)).z();
    EXPECT_GT(z, 0);
    area += z / 2;
  }
  EXPECT_NEAR(area, 1, 0.01);
}

// A camera at the origin that looks along z: 200 px wide, its focal length 100 px.
ProxyView CameraAtOrigin(double shift_x = 0) {
  Camera camera;
  camera.width_px = camera.height_px = 200;
  camera.params = {100, 100, 100, 100};
  Rigid3 pose;
  pose.translation = {-shift_x, 0, 0};
  ProxyView view;
  view.render = MakeRenderView(camera, pose);
  view.focal_px = 100;
  return view;
}

// A wavy sheet, as large in a picture wherever it stands.
Mesh SheetAtDepth(int n, double depth, double x) {
  return MappedVertices(WavySheet(n), [=](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(depth * (x + 0.6 * (p.x() - 0.5)), depth * (0.5 - p.y()), depth * (1 - 0.4 * p.z()));
  });
}

TEST(PixelScale, IsTheFocalLengthOverTheDepthInThePhotoThatShowsItLargest) {
  Mesh mesh;
  const auto face = [&](const Eigen::Vector3d& at) {
    const auto v = static_cast<std::int32_t>(mesh.vertices.size());
    for (const Eigen::Vector3d& d :
         {Eigen::Vector3d(0.1, 0, 0), Eigen::Vector3d(-0.1, 0.1, 0), Eigen::Vector3d(0, -0.1, 0)})
      mesh.vertices.push_back(at + d);
    mesh.faces.push_back({v, v + 1, v + 2});
  };
  face({0, 0, 2});
  face({0, 0, 5});
  face({0, 0, -3});    // behind
  face({9, 0, 2});     // beside
  face({0, 0, 1e-9});  // as good as in the camera: counts as at a fiftieth of the median depth
  const std::vector<double> one = PixelScale(mesh, {CameraAtOrigin()});
  EXPECT_NEAR(one[0], 50, 1e-9);
  EXPECT_NEAR(one[1], 20, 1e-9);
  EXPECT_NEAR(one[2], 20, 1e-9);
  EXPECT_NEAR(one[3], 20, 1e-9);
  EXPECT_NEAR(one[4], 100 / (0.02 * 2), 1e-6);
  ProxyView nearer = CameraAtOrigin();
  nearer.focal_px = 300;
  EXPECT_NEAR(PixelScale(mesh, {CameraAtOrigin(), nearer})[1], 60, 1e-9);
  EXPECT_EQ(PixelScale(mesh, {}), std::vector<double>(5, 1.0));
}

TEST(InPixels, KeepsWhatIsNearAsWellAsWhatIsFar) {
  // Two sheets as large in the picture, one ten times as far away: to the picture they are the same.
  const int n = 40;
  Mesh both = SheetAtDepth(n, 1, -0.4);
  const std::size_t near_faces = both.faces.size();
  const Mesh far = SheetAtDepth(n, 10, 0.4);
  const auto first = static_cast<std::int32_t>(both.vertices.size());
  both.vertices.insert(both.vertices.end(), far.vertices.begin(), far.vertices.end());
  for (const auto& f : far.faces) both.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  const std::vector<ProxyView> views = {CameraAtOrigin()};
  const auto share_near = [&](SimplifyMethod method) {
    const Mesh simple = Simplify(both, {400}, method, SilentProgress(), views).front().mesh;
    std::size_t near = 0;
    for (const auto& f : simple.faces) near += simple.vertices[static_cast<std::size_t>(f[0])].z() < 3;
    return static_cast<double>(near) / static_cast<double>(simple.faces.size());
  };
  EXPECT_EQ(near_faces * 2, both.faces.size());
  EXPECT_NEAR(share_near(SimplifyMethod::kInPixels), 0.5, 0.05);
  EXPECT_LT(share_near(SimplifyMethod::kQuadric), 0.2);  // distances ten times as large count a hundred times
}

TEST(InPixels, IsTheSameAtAnyUnitOfLengthAndAnywhere) {
  const Mesh sheet = SheetAtDepth(30, 1, 0);
  const Mesh simple =
      Simplify(sheet, {300}, SimplifyMethod::kInPixels, SilentProgress(), {CameraAtOrigin()}).front().mesh;
  for (const double unit : {0x1p-40, 0x1p-10, 0x1p30}) {
    const Mesh scaled = MappedVertices(sheet, [=](const Eigen::Vector3d& x) { return Eigen::Vector3d(unit * x); });
    const Mesh again =
        Simplify(scaled, {300}, SimplifyMethod::kInPixels, SilentProgress(), {CameraAtOrigin()}).front().mesh;
    EXPECT_EQ(again.faces, simple.faces) << unit;
  }
}

Mesh Moved(const Mesh& mesh, double scale, const Eigen::Vector3d& to) {
  return MappedVertices(mesh, [&](const Eigen::Vector3d& x) { return Eigen::Vector3d(scale * x + to); });
}

// Specks of twelve faces each, which float in front of what lies behind them.
constexpr std::size_t kSpecks = 2000, kSpeckFaces = 12;
void AddSpecks(Mesh& mesh) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> in(-1, 1);
  for (std::size_t i = 0; i < kSpecks; ++i)
    Append(mesh, Moved(SubdividedCube(1), 0.01, {3 * in(random), 3 * in(random), 8 + in(random)}));
}

// Of vertices near the ball: how far they are off its surface at most, in radii.
double FarthestOffBall(const Mesh& mesh, const Eigen::Vector3d& middle, double radius) {
  double farthest = 0;
  int near = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) {
    const double r = (v - middle).norm() / radius;
    if (r > 2) continue;
    farthest = std::max(farthest, std::abs(r - 1));
    ++near;
  }
  return near > 20 ? farthest : std::numeric_limits<double>::infinity();
}

// A room, seen from within, and a ball of a hundredth of its size in it: a wrap of all this would have gaps as large.
TEST(InPixels, SpecksGoWhereTheyWouldTakeTheFacesOfWhatIsInFrontOfTheSurroundings) {
  const Eigen::Vector3d middle(0, 0, 4);
  Mesh mesh = Moved(SubdividedCube(40), -100, Eigen::Vector3d::Constant(50));
  Append(mesh, Moved(BallMesh(20), 0.5, middle));
  AddSpecks(mesh);
  ASSERT_GE(mesh.faces.size(), 20000u);  // as large as what is wrapped otherwise
  const std::vector<ProxyView> views = {CameraAtOrigin()};
  const std::vector<std::size_t> wanted = {33000, 4000, 9000, 4000};
  const std::vector<SimplifiedMesh> together =
      Simplify(mesh, wanted, SimplifyMethod::kInPixels, SilentProgress(), views);
  ASSERT_EQ(together.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const SimplifiedMesh& simple = together[i];
    EXPECT_TRUE(simple.reached);
    EXPECT_FALSE(simple.wrapped);
    EXPECT_LE(simple.mesh.faces.size(), wanted[i]);
    const std::size_t specks = CountParts(simple.mesh).parts - 2;
    EXPECT_EQ(specks, kSpecks - simple.removed_parts);
    EXPECT_LT(FarthestOffBall(simple.mesh, middle, 0.5), 0.02) << wanted[i];
    // Room and ball may have four times four faces each. No more specks go than have to.
    const std::size_t shape = 2 * 4 * kFacesPerLeast;
    EXPECT_LE(specks * kSpeckFaces + shape, wanted[i]);
    EXPECT_TRUE(specks == kSpecks || (specks + 1) * kSpeckFaces + shape > wanted[i]) << specks;
  }
  EXPECT_EQ(together[0].removed_parts, 0u);
  EXPECT_EQ(together[1].mesh.faces, together[3].mesh.faces);
  EXPECT_EQ(together[2].mesh.faces,
            Simplify(mesh, {9000}, SimplifyMethod::kInPixels, SilentProgress(), views).front().mesh.faces);
}

TEST(SmallParts, GoByWhatPhotosShowOfThemAndTheLargestStays) {
  Mesh mesh;
  for (const double depth : {1.0, 4.0, 2.0, 8.0, 16.0}) Append(mesh, Moved(SubdividedCube(2), 0.125, {0, 0, depth}));
  const auto depths = [](const Mesh& m) {
    std::vector<int> found;
    for (std::size_t v = 0; v < m.vertices.size(); v += 26) found.push_back(static_cast<int>(m.vertices[v].z()));
    return found;
  };
  const auto kept = [&](std::size_t faces, const std::vector<double>& scale) {
    Mesh rest = mesh;
    const SmallParts small = RemoveSmallParts(rest, faces, scale);
    EXPECT_EQ(depths(rest).size(), 5 - small.removed);
    EXPECT_EQ(small.least, 4 * depths(rest).size());
    EXPECT_FALSE(Validate(rest));
    return depths(rest);
  };
  const std::vector<double> scale = PixelScale(mesh, {CameraAtOrigin()});
  EXPECT_THAT(kept(80, scale), testing::ElementsAre(1, 4, 2, 8, 16));  // four times the four faces of each
  EXPECT_THAT(kept(79, scale), testing::ElementsAre(1, 4, 2, 8));
  EXPECT_THAT(kept(48, scale), testing::ElementsAre(1, 4, 2));
  // The second has more of the surface in the photo than four of so many faces.
  EXPECT_THAT(kept(24, scale), testing::ElementsAre(1, 2));
  EXPECT_THAT(kept(1, scale), testing::ElementsAre(1));
  // Equally large: those of lower number go first, and never all of them.
  EXPECT_THAT(kept(1, std::vector<double>(mesh.faces.size(), 1)), testing::ElementsAre(16));
  // What has few faces needs no more than those.
  mesh = {};
  for (const double depth : {1.0, 2.0, 4.0}) Append(mesh, Moved(SubdividedCube(1), 0.125, {0, 0, depth}));
  EXPECT_EQ(RemoveSmallParts(mesh, 36, PixelScale(mesh, {CameraAtOrigin()})).removed, 0u);
  EXPECT_EQ(RemoveSmallParts(mesh, 35, PixelScale(mesh, {CameraAtOrigin()})).removed, 1u);
}

TEST(InPixels, HolesKeepTheFacesThatTheirShapeNeeds) {
  const Mesh ring = Moved(TorusMesh(40, 20, 1, 0.4), 1, {0, 0, 5});
  const SimplifiedMesh simple =
      Simplify(ring, {20}, SimplifyMethod::kInPixels, SilentProgress(), {CameraAtOrigin()}).front();
  EXPECT_FALSE(simple.reached);
  EXPECT_EQ(CountParts(simple.mesh).handles, 1u);
  EXPECT_EQ(simple.mesh.faces.size(), kFacesPerLeast * CountParts(ring).least_faces);
  // Without holes it is as few as wanted.
  const Mesh ball = Moved(BallMesh(6), 1, {0, 0, 5});
  EXPECT_TRUE(Simplify(ball, {10}, SimplifyMethod::kInPixels, SilentProgress(), {CameraAtOrigin()}).front().reached);
}

TEST(TightWrap, EnclosesAndClosesTunnelsThatAreNarrow) {
  const Mesh ring = TorusMesh(40, 20, 1, 0.9);  // a hole of a tenth of its ring
  const Mesh wrap = TightWrap(ring, 0.5, 0.02);
  EXPECT_EQ(CountParts(ring).handles, 1u);
  EXPECT_EQ(CountParts(wrap).handles, 0u);
  EXPECT_TRUE(CheckSoundness(wrap).IsSolid());
  EXPECT_EQ(Escaped(ring, wrap, 0), 0u);
  EXPECT_EQ(CountParts(TightWrap(ring, 0.05, 0.01)).handles, 1u);
}

}  // namespace
}  // namespace lumi::test
