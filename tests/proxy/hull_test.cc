#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proxy/hull/hull_tradeoff.h"
#include "proxy/hull/soundness.h"
#include "proxy/hull/visual_hull.h"
#include "scene/program/error.h"
#include "tests/proxy/hull_bodies.h"

namespace lumi::test {
namespace {

constexpr double kPi = std::numbers::pi;

HullSummary ExpectSolidHull(const std::vector<SilhouetteView>& views, const HullOptions& options = {},
                            Mesh* mesh_out = nullptr) {
  HullSummary summary;
  const Mesh mesh = BuildVisualHull(views, options, SilentProgress(), &summary);
  const Soundness s = CheckSoundness(mesh);
  EXPECT_TRUE(s.IsSolid()) << s.Describe();
  EXPECT_GE(summary.fit.coverage_min, 0.995);
  EXPECT_LE(summary.fit.deepest_uncovered_px, 2);
  EXPECT_EQ(summary.used.size() + summary.left_out.size(), views.size());
  if (mesh_out != nullptr) *mesh_out = mesh;
  return summary;
}

// Volumes approach the body's from above as views are added; to 64 views: tests/benchmark/hull_bench.cc.
void ExpectVolumesFromAbove(const char* name, const Body& body, double volume, double at_most_in_the_end) {
  double last = 1e300;
  const std::vector<SilhouetteView> all = Around(body, 16);
  HullOptions options;
  options.cell_px = 4;
  for (const std::size_t every : {4U, 2U, 1U}) {
    std::vector<SilhouetteView> views;
    for (std::size_t n = 0; n < all.size(); n += every) views.push_back(all[n]);
    const HullSummary s = ExpectSolidHull(views, options);
    EXPECT_EQ(s.left_out.size(), 0u);
    EXPECT_GT(s.volume, volume) << name << " " << views.size();
    EXPECT_LT(s.volume, last) << name << " " << views.size();
    last = s.volume;
  }
  EXPECT_LT(last, at_most_in_the_end * volume) << name;
}

TEST(VisualHull, VolumesApproachTheBodysFromAbove) {
  // Half a pixel of a radius of 100 is 1.5 % of a ball's volume; 16 cones leave some more.
  ExpectVolumesFromAbove("ball", Ellipsoid({1, 1, 1}), 4.0 / 3 * kPi, 1.06);
  ExpectVolumesFromAbove("ellipsoid", Ellipsoid({1, 0.7, 0.5}), 4.0 / 3 * kPi * 0.35, 1.08);
  // Its edges are seen edge-on by few views: slower.
  ExpectVolumesFromAbove("cube", Block({0.6, 0.6, 0.6}), 8 * 0.216, 1.25);
}

// Six cameras on a cube's axes at distance D see squares. The cones' intersection has volume 8 (k D)^3 / (1 + k)^2, k
// the tangent of half the angle at which a face is seen (8 a^3 D / (D - a) for a half edge a): the ordered region x >=
// y >= z >= 0, x + k y <= k D, times 48.
TEST(VisualHull, OfACubeFromItsAxesHasTheExactVolume) {
  const double D = 5, k = 0.25;  // half edge 1; 100 px at f = 400, the sides between two pixels
  Shot shot;
  shot.focal_px = 400;
  std::vector<SilhouetteView> views;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      Eigen::Vector3d eye = Eigen::Vector3d::Zero();
      eye[axis] = side * D;
      views.push_back(Photograph(Block({1, 1, 1}), eye, Eigen::Vector3d::Zero(), shot));
    }
  }
  HullOptions options;
  for (const double dilation : {0.0, 0.5, 1.0}) {
    options.dilation_px = dilation;
    options.keep_all_views = true;
    double error = 1;
    for (const double cell : {8.0, 4.0, 2.0}) {
      options.cell_px = cell;
      HullSummary s;
      const Mesh mesh = BuildVisualHull(views, options, SilentProgress(), &s);
      EXPECT_TRUE(CheckSoundness(mesh).IsSolid());
      const double wide = k * (1 + dilation / 100), exact = 8 * std::pow(wide * D, 3) / std::pow(1 + wide, 2);
      // The grid cuts corners and edges: a hundredth at 4 pixels of 200.
      EXPECT_NEAR(s.volume / exact, 1, 0.01 * cell / 4) << dilation << " " << cell;
      EXPECT_LT(std::abs(s.volume / exact - 1), error) << dilation << " " << cell;
      error = std::abs(s.volume / exact - 1) + 1e-4;
    }
  }
}

TEST(VisualHull, AViewWhoseCameraIsOffIsFoundAndLeftOut) {
  for (const double off : {0.01, 0.03, 0.1}) {
    std::vector<SilhouetteView> views = Around(Union(Ellipsoid({1, 0.6, 0.5}), Block({0.2, 0.2, 0.9})), 16);
    // Moved sideways by a share of its distance: five pixels at 1 %.
    views[5].P.col(3) +=
        views[5].P.leftCols<3>() * (off * 5 * Eigen::Vector3d(views[5].P.block<1, 3>(0, 0).transpose()).normalized());
    const HullSummary s = ExpectSolidHull(views);
    ASSERT_EQ(s.left_out.size(), 1u) << off;
    EXPECT_EQ(s.left_out[0].name, "view5") << off;
    EXPECT_NE(s.left_out[0].reason.find("does not agree"), std::string::npos) << s.left_out[0].reason;
  }
}

TEST(VisualHull, SeveralWrongViewsAreFoundToo) {
  std::vector<SilhouetteView> views = Around(Ellipsoid({1, 0.6, 0.5}), 20);
  views[3].P = LookAt({5, 0.3, 0}, {0.2, 0, 0});  // another place altogether
  std::swap(views[7].mask, views[12].mask);       // two masks mixed up
  for (int y = 0; y < 320; ++y)
    for (int x = 0; x < 150; ++x) views[16].mask.At(x, y, 0) = 0;  // half of it lost
  const HullSummary s = ExpectSolidHull(views);
  std::vector<std::string> names;
  for (const auto& l : s.left_out) names.push_back(l.name);
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"view12", "view16", "view3", "view7"}));
}

// A shadow on one photo: the view stays, and the hull is as large as without the shadow.
TEST(VisualHull, ASilhouetteThatLacksAPartIsMended) {
  const Body body = Union(Ellipsoid({1, 0.6, 0.5}), Block({0.2, 0.2, 0.9}));
  std::vector<SilhouetteView> views = Around(body, 16);
  const SilhouetteView before = views[5];
  HullOptions options;
  options.cell_px = 3;
  const HullSummary whole = ExpectSolidHull(views, options);
  EXPECT_TRUE(whole.mended.empty());
  const Eigen::Vector2d end = *Project(before.P, Eigen::Vector3d(0, 0, 0.95));
  for (int y = 0; y < 320; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (std::hypot(x + 0.5 - end.x(), y + 0.5 - end.y()) < 12) views[5].mask.At(x, y, 0) = 0;
    }
  }
  Mesh mesh;
  const HullSummary s = ExpectSolidHull(views, options, &mesh);
  EXPECT_EQ(s.left_out.size(), 0u);
  double view5 = 0, others = 0;
  for (const auto& m : s.mended) (m.name == "view5" ? view5 : others) += m.share;
  EXPECT_GT(view5, 0.01);
  EXPECT_LT(others, 0.2 * view5);
  EXPECT_NEAR(s.volume, whole.volume, 0.01 * whole.volume);
  // What the photo showed before it was spoilt is covered.
  EXPECT_GE(MeasureSilhouette(mesh, before).coverage, 0.995);
  // Where nothing may be mended the view is left out.
  options.max_mended = 0;
  const HullSummary strict = ExpectSolidHull(views, options);
  EXPECT_TRUE(strict.mended.empty());
  ASSERT_EQ(strict.left_out.size(), 1u);
  EXPECT_EQ(strict.left_out[0].name, "view5");
}

TEST(VisualHull, TheSameInputGivesTheSameMesh) {
  const std::vector<SilhouetteView> views = Around(Ellipsoid({1, 0.6, 0.5}), 8);
  Mesh a, b;
  ExpectSolidHull(views, {}, &a);
  ExpectSolidHull(views, {}, &b);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.vertices, b.vertices);
}

TEST(VisualHull, OptionsOutOfRangeAreRefused) {
  HullOptions options;
  options.cell_px = 0;
  EXPECT_THROW(BuildVisualHull({}, options, SilentProgress()), UsageError);
  options = {};
  options.dilation_px = -1;
  EXPECT_THROW(BuildVisualHull({}, options, SilentProgress()), UsageError);
}

TEST(HullTradeoff, ViewsAreChosenFarFromEachOther) {
  std::vector<SilhouetteView> ring;
  for (int n = 0; n < 12; ++n)
    ring.push_back(
        {std::to_string(n), LookAt({5 * std::cos(n * kPi / 6), 5 * std::sin(n * kPi / 6), 0}, {0, 0, 0}), {}});
  const std::vector<std::size_t> order = SpreadDirections(ring, {0, 0, 0});
  ASSERT_EQ(order.size(), 12u);
  EXPECT_EQ(order[0], 0u);
  EXPECT_EQ(order[1] % 6, 3u);  // a right angle; the opposite view says nothing new
  std::vector<std::size_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t n = 0; n < 12; ++n) EXPECT_EQ(sorted[n], n);
}

TEST(HullTradeoff, AReducedSilhouetteHoldsTheWholeOneWhereItWas) {
  const SilhouetteView view = Photograph(Ellipsoid({1, 0.6, 0.5}), {5, 0, 1});
  const SilhouetteView half = Reduced(view, 3);
  EXPECT_EQ(half.mask.width, 107);
  for (int y = 0; y < 320; ++y) {
    for (int x = 0; x < 320; ++x) EXPECT_LE(view.mask.At(x, y, 0), half.mask.At(x / 3, y / 3, 0));
  }
  const Eigen::Vector3d x(0.3, 0.2, 0.1);
  EXPECT_LT((3 * *Project(half.P, x) - *Project(view.P, x)).norm(), 1e-9);
}

TEST(Outline, ATriangleCoversThePixelsWhoseCentresItHolds) {
  Mesh mesh;
  mesh.vertices = {{1, 1, 1}, {5, 1, 1}, {1, 5, 1}};  // pixels of a camera with f = 1
  mesh.faces = {{0, 1, 2}, {0, 2, 1}};                // front and back
  Matrix34d P = Matrix34d::Zero();
  P.leftCols<3>().setIdentity();
  const Image8 outline = RenderOutline(mesh, P, 8, 8);
  for (int y = 0; y < 8; ++y) {
    for (int x = 0; x < 8; ++x)
      EXPECT_EQ(outline.At(x, y, 0) != 0, x >= 1 && y >= 1 && x + y + 1 <= 6) << x << " " << y;
  }
}

// Front faces and back faces cover the same pixels, without a gap between two faces.
TEST(Outline, FrontAndBackFacesDrawTheSame) {
  const std::vector<SilhouetteView> views = Around(Ellipsoid({1, 0.6, 0.5}), 24);
  Mesh mesh;
  ExpectSolidHull(views, {}, &mesh);
  Mesh turned = mesh;
  for (auto& f : turned.faces) std::swap(f[0], f[1]);
  for (const SilhouetteView& v : views)
    EXPECT_EQ(RenderOutline(mesh, v.P, 320, 320).data, RenderOutline(turned, v.P, 320, 320).data);
}

}  // namespace
}  // namespace lumi::test
