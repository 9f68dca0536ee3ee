// Sparse plans next to their degenerate neighbours: finite numbers, weights in [0,1] that sum to 1 or alpha 0, no pixel
// wrong.
#include <gtest/gtest.h>

#include <cstdio>
#include <limits>
#include <random>

#include "render/radiance/sparse/constrained_delaunay.h"
#include "sparse_test_scene.h"

namespace lumi {
namespace {

using Segment = std::array<Eigen::Vector2d, 2>;

// Renders a proxy from a view by all paths, and holds every number to what weights and pictures may be.
void ExpectSound(const test::Capture& c, const RenderView& view, const std::string& what) {
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const int grid : {2, 9}) {
    for (const bool epipoles : {false, true}) {
      RenderRequest r = test::SparseRequest(view, 3, grid, Sampling::kInterpolated);
      r.settings.epipoles = epipoles;
      SparsePlan plan;
      PlanSparse(MakeViewSetup(MakeSources(c.scene), view, r.settings),
                 SparseProxy(c.proxy, c.scene.normalized_from_world), nullptr, test::InTurn, plan);
      ASSERT_EQ(test::Wrong(plan), "") << what;
      for (const bool field_of_view : {true, false}) {
        r.settings.field_of_view = field_of_view;
        r.settings.sampling = Sampling::kInterpolated;
        ASSERT_EQ(test::Wrong(renderer->Render(r)), "") << what << " interpolated, field of view " << field_of_view;
        r.settings.sampling = Sampling::kCandidates;
        for (const Resolution resolution : {Resolution::kOff, Resolution::kDistance, Resolution::kJacobian})
          for (const bool time : {false, true}) {
            RenderRequest terms = r;
            terms.settings.resolution = resolution;
            terms.settings.time = time;
            ASSERT_EQ(test::Wrong(renderer->Render(terms)), "")
                << what << " candidates, field of view " << field_of_view << ", resolution " << Name(resolution)
                << ", time " << time;
          }
      }
    }
  }
}

Mesh Quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, const Eigen::Vector3d& d) {
  Mesh m;
  m.vertices = {a, b, c, d};
  m.faces = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

TEST(HardCase, CollinearAndCoincidentSamplesAndSegments) {
  PlanarTriangulation t;
  const std::vector<Eigen::Vector2d> square{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const auto area = [&] {
    double sum = 0;
    for (const auto& f : t.triangles) {
      const auto p = [&](std::size_t i) { return t.points[static_cast<std::size_t>(f[i])]; };
      const Eigen::Vector2d u = p(1) - p(0), v = p(2) - p(0);
      sum += (u.x() * v.y() - u.y() * v.x()) / 2;
    }
    return sum;
  };
  for (double d = 1e-1; d >= 1e-15; d /= 10) {
    std::vector<Eigen::Vector2d> points = square;
    for (int i = 0; i <= 8; ++i) points.emplace_back(0.5 + i * d / 8, 0.5);      // on a line
    for (int i = 0; i < 5; ++i) points.emplace_back(0.25, 0.25 + i * d * 1e-3);  // all but coincident
    const std::vector<Segment> segments{{Eigen::Vector2d(0, 0.5), Eigen::Vector2d(1, 0.5)},
                                        {Eigen::Vector2d(0, 0.5), Eigen::Vector2d(1, 0.5)},
                                        {Eigen::Vector2d(0.2, 0.5), Eigen::Vector2d(0.7, 0.5)},
                                        {Eigen::Vector2d(0, 0.5 - d), Eigen::Vector2d(1, 0.5 + d)},
                                        {Eigen::Vector2d(0.3, 0.3), Eigen::Vector2d(0.3, 0.3)}};
    TriangulateConstrained(points, segments, t);
    EXPECT_NEAR(area(), 1, 1e-9) << d;
  }
  TriangulateConstrained(std::vector<Eigen::Vector2d>{{0, 0}, {1, 1}, {2, 2}, {1, 1}}, std::vector<Segment>{}, t);
  EXPECT_TRUE(t.triangles.empty());
  TriangulateConstrained(std::vector<Eigen::Vector2d>{}, std::vector<Segment>{}, t);
  EXPECT_TRUE(t.triangles.empty());
}

TEST(HardCase, ProxyEdgesAlongGridLinesAndThroughSamples) {
  test::Capture c = test::MakeCapture(4, 32);
  // Seen straight on: the proxy's borders fall on the grid's lines exactly, or within steps of them.
  const RenderView view =
      MakeRenderView(Camera::Pinhole(64, 64, 64, 64, 32, 32), LookAt({0, 0, -4}, {0, 0, 0}, {0, -1, 0}));
  for (double d = 1e-2; d >= 1e-15; d /= 10) {
    c.proxy = Quad({-1 - d, -1, 0}, {1, -1 + d, 0}, {1, 1, 0}, {-1, 1, 0});
    Append(c.proxy, Quad({-2, -2, 1}, {2, -2, 1}, {2, 2, 1}, {-2, 2 + d, 1}));
    ExpectSound(c, view, "offset " + std::to_string(d));
  }
}

TEST(HardCase, EpipolesAtInfinityAndBehind) {
  test::Capture c = test::MakeCapture(5, 32);
  // Camera 1 sideways of the view: its epipole goes to infinity as the step falls, from before the view and from
  // behind.
  for (double d = 1e-1; d >= 1e-15; d /= 10)
    for (const double sign : {-1.0, 1.0}) {
      c.scene.views[1].cam_from_world = LookAt({1, 0, -4 + sign * d}, {0, 0, 0.5}, {0, -1, 0});
      ExpectSound(c, MakeRenderView(c.scene.cameras[0], LookAt({0, 0, -4}, {0, 0, 0.5}, {0, -1, 0})),
                  "step " + std::to_string(sign * d));
    }
}

TEST(HardCase, AViewAtAndNextToASourceCamera) {
  const test::Capture c = test::MakeCapture(5, 32);
  for (double d = 1e-1; d >= 1e-15; d /= 10) {
    RenderView view = MakeRenderView(c.scene, c.scene.views[2]);
    view = MakeRenderView(c.scene.cameras[0], LookAt(view.centre + Eigen::Vector3d(d, -d, d), {0, 0, 0.5}, {0, -1, 0}));
    ExpectSound(c, view, "offset " + std::to_string(d));
  }
}

TEST(HardCase, AProxyTriangleThroughTheNearPlane) {
  test::Capture c = test::MakeCapture(4, 32);
  // A floor that runs under the camera and behind it, and lower and lower.
  for (double d = 1; d >= 1e-15; d /= 10) {
    c.proxy = Quad({-5, d, -20}, {5, d, -20}, {5, d, 20}, {-5, d, 20});
    ExpectSound(c, test::ViewOf(c, {0, 0, -4}, {0, 0, 0}), "floor at " + std::to_string(d));
  }
  // The same of many facets.
  c.proxy = test::Sheet(20);
  for (auto& v : c.proxy.vertices) v = Eigen::Vector3d(v.x(), 0.4 * v.z(), 3 * v.y());
  ExpectSound(c, test::ViewOf(c, {0, 0, -4}, {0, 0, 0}), "fine floor");
  ExpectSound(c, test::ViewOf(c, {0, 0, -1}, {0, 0.1, 5}), "fine floor, inside");
}

TEST(HardCase, APlaneThroughTheCentreOfProjectionAndAProxyEdgeOn) {
  test::Capture c = test::MakeCapture(4, 32);
  for (double d = 1e-1; d >= 1e-15; d /= 10) {
    c.proxy = Quad({-2, d, -3}, {2, d, -3}, {2, 0, 3}, {-2, 0, 3});
    ExpectSound(c, test::ViewOf(c, {0, 0, -4}, {0, 0, 0}), "tilt " + std::to_string(d));
    Append(c.proxy, Quad({-2, -2, 2}, {2, -2, 2}, {2, 2, 2}, {-2, 2, 2}));
    ExpectSound(c, test::ViewOf(c, {0, 0, -4}, {0, 0, 0}), "tilt before a wall " + std::to_string(d));
  }
  c.proxy = Quad({-2, 0, -3}, {2, 0, -3}, {2, 0, 3}, {-2, 0, 3});
  ExpectSound(c, test::ViewOf(c, {0, 0, -4}, {0, 0, 0}), "edge on");
}

TEST(HardCase, ZeroAreaAndSliverTriangles) {
  test::Capture c = test::MakeCapture(4, 32);
  for (double d = 1e-1; d >= 1e-15; d /= 10) {
    c.proxy = Quad({-2, -1, 1}, {2, -1, 1}, {2, -1 + d, 1}, {-2, -1 + d, 1});
    Append(c.proxy, Quad({-2, -1 + d, 1}, {2, -1 + d, 1}, {2, 2, 1}, {-2, 2, 1}));
    c.proxy.faces.push_back({0, 1, 1});
    c.proxy.faces.push_back({3, 3, 3});
    c.proxy.vertices.push_back({0, -1, 1});  // on the line of an edge
    c.proxy.faces.push_back({0, 1, static_cast<std::int32_t>(c.proxy.vertices.size()) - 1});
    ExpectSound(c, test::ViewOf(c, {0.2, 0.1, -4}), "height " + std::to_string(d));
    test::Capture fine = c;
    Append(fine.proxy, test::Sheet(16));
    ExpectSound(fine, test::ViewOf(c, {0.2, 0.1, -4}), "fine, height " + std::to_string(d));
  }
}

TEST(HardCase, FacetsThatTouchInterpenetrateAndCoincide) {
  test::Capture c = test::MakeCapture(4, 32);
  for (double d = 1e-1; d >= 1e-15; d /= 10) {
    c.proxy = Quad({-2, -2, 1}, {2, -2, 1 + d}, {2, 2, 1}, {-2, 2, 1 - d});
    Append(c.proxy, Quad({-2, -2, 1 + d}, {2, -2, 1}, {2, 2, 1 - d}, {-2, 2, 1}));
    Append(c.proxy, Quad({-2, -2, 1}, {2, -2, 1}, {2, 2, 1}, {-2, 2, 1}));
    ExpectSound(c, test::ViewOf(c, {0.2, 0.1, -4}), "apart " + std::to_string(d));
  }
  c.proxy = Quad({-2, -2, 1}, {2, -2, 1}, {2, 2, 1}, {-2, 2, 1});
  Append(c.proxy, Mesh(c.proxy));
  ExpectSound(c, test::ViewOf(c, {0.2, 0.1, -4}), "twice the same");
}

TEST(HardCase, ACameraOnTheProxyAndAViewTouchingIt) {
  test::Capture c = test::MakeCapture(4, 32);
  c.proxy = Quad({-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  for (double d = 1e-1; d >= 1e-15; d /= 10) {
    c.scene.views[1].cam_from_world = LookAt({0.1, 0, -d}, {0.1, 0, 1}, {0, -1, 0});
    ExpectSound(c, test::ViewOf(c, {0.2, 0.1, -4}), "camera at " + std::to_string(d));
    ExpectSound(c, MakeRenderView(c.scene.cameras[0], LookAt({0, 0, -d}, {0, 0, 1}, {0, -1, 0})),
                "view at " + std::to_string(d));
  }
}

TEST(HardCase, OneCameraAndNoCameraThatSees) {
  test::Capture one = test::MakeCapture(1, 32);
  ExpectSound(one, test::ViewOf(one, {0.2, 0.1, -4}), "one camera");
  test::Capture none = test::MakeCapture(3, 32);
  for (auto& v : none.scene.views) v.cam_from_world = LookAt({0, 0, -9}, {0, 0, -20}, {0, -1, 0});
  ExpectSound(none, test::ViewOf(none, {0.2, 0.1, -4}), "all look away");
  const auto renderer = MakeCpuRenderer(WorldOf(none.scene, none.proxy), none.photos);
  for (const Sampling sampling : {Sampling::kInterpolated, Sampling::kCandidates}) {
    const ImageF image = renderer->Render(test::SparseRequest(test::ViewOf(none, {0.2, 0.1, -4}), 3, 9, sampling));
    EXPECT_TRUE(std::all_of(image.data.begin(), image.data.end(), [](float v) { return v == 0; }));
  }
  test::Capture empty = test::MakeCapture(3, 32);
  empty.proxy = {};
  ExpectSound(empty, test::ViewOf(empty, {0.2, 0.1, -4}), "no proxy");
}

// The same picture, of another size or far from the origin. At 1e7 scene sizes a double holds 1e7 x 2^-53 = 1e-9 of the
// scene, and so much a camera's centre is off, which comes of a pose: a millionth of a pixel. What is nearer than that
// to a silhouette, or to a limit of the floats that follow, falls either way.
TEST(HardCase, CoordinatesFarAwayAndScenesOfAnySize) {
  const test::Capture c = test::MakeCapture(5, 32);
  const Rigid3 pose = LookAt({0.7, 0.3, -4}, {0, 0, 0.5}, {0, -1, 0});
  const Camera camera = Camera::Pinhole(96, 72, 86, 86, 48, 36);
  std::vector<RadianceSettings> ways(1);
  for (const Sampling sampling : {Sampling::kInterpolated, Sampling::kCandidates}) {
    RenderRequest r = test::SparseRequest({}, 3, 9, sampling);
    ways.push_back(r.settings);
    r.settings.resolution = Resolution::kJacobian;
    ways.push_back(r.settings);
    if (sampling == Sampling::kCandidates) continue;
    r.settings.similarity = Similarity::kFull;
    r.settings.correlation = Correlation::kFallingLeaves;
    ways.push_back(r.settings);
  }
  const auto pictures = [&](const test::Capture& capture, const RenderView& view) {
    const auto renderer = MakeCpuRenderer(WorldOf(capture.scene, capture.proxy), capture.photos);
    std::vector<ImageF> out;
    for (const RadianceSettings& settings : ways) {
      RenderRequest r;
      r.view = view;
      r.settings = settings;
      out.push_back(renderer->Render(r));
    }
    return out;
  };
  const std::vector<ImageF> wanted = pictures(c, MakeRenderView(camera, pose));
  for (const ImageF& image : wanted) ASSERT_GT(image.At(48, 36, 3), 0);
  double farthest_off = 0, most_differ = 0;
  for (const auto& [scale, sizes] :
       {std::pair(1e-6, 0.0), std::pair(1e6, 0.0), std::pair(1.0, 1e4), std::pair(1.0, 1e7)}) {
    const std::string what = "scale " + std::to_string(scale) + " offset " + std::to_string(sizes) + " scene sizes";
    const double offset = sizes / c.scene.normalized_from_world.scale;
    test::Capture moved = c;
    const Similarity3 s{scale, Eigen::Quaterniond::Identity(), {offset, -offset, offset}};
    Transform(moved.scene, s);
    for (auto& v : moved.proxy.vertices) v = s * v;
    ExpectSound(moved, MakeRenderView(c.scene.cameras[0], TransformPose(pose, s)), what);

    const RenderView view = MakeRenderView(camera, TransformPose(pose, s));
    const double off = (Normalized(view, moved.scene.normalized_from_world).centre -
                        Normalized(MakeRenderView(camera, pose), c.scene.normalized_from_world).centre)
                           .norm();
    EXPECT_LE(off, 1e-15 + 10 * sizes * std::numeric_limits<double>::epsilon()) << what;
    farthest_off = std::max(farthest_off, off);
    const std::vector<ImageF> got = pictures(moved, view);
    for (std::size_t i = 0; i < ways.size(); ++i) {
      int differ = 0;
      for (int y = 0; y < 72; ++y)
        for (int x = 0; x < 96; ++x) {
          bool same = true;
          for (int k = 0; k < 4; ++k) same = same && std::abs(got[i].At(x, y, k) - wanted[i].At(x, y, k)) <= 1.0F / 255;
          differ += !same;
        }
      EXPECT_LE(differ, 96 * 72 / 1000) << what << ", way " << i;
      most_differ = std::max(most_differ, differ / (96.0 * 72));
    }
  }
  std::printf(
      "  a camera's centre is off by %.1e scene sizes at most, %.2f %% of a picture's pixels by more than a code "
      "value\n",
      farthest_off, 100 * most_differ);
}

TEST(HardCase, APhotoOfOnePixelsWidth) {
  test::Capture c = test::MakeCapture(3, 32);
  for (auto& p : c.photos) {
    p.levels.erase(p.levels.begin(), p.levels.end() - 1);
    p.level0_shift = 5;
  }
  ExpectSound(c, test::ViewOf(c, {0.2, 0.1, -4}), "1 x 1 photos");
}

}  // namespace
}  // namespace lumi
