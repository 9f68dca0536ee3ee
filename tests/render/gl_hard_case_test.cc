// What the GL backend draws where geometry degenerates, approached step by step: finite, holes where nothing is seen,
// and the picture of the well-posed neighbour. Every way of weighing: at every pixel, from sparse samples, from cells.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "render/picture/convert.h"
#include "tests/render/gl_hard_case.h"

namespace lumi {
namespace {

using test::ArcView;
using test::GlHardCase;
using test::kColorTolerance;
using test::Over;
using test::PhotographedInTurn;
using test::Step;
using test::ViewFrom;
using test::Way;
using test::Ways;
using test::World;

double MeanDifference(const ImageF& a, const ImageF& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i)
    sum += std::abs(static_cast<double>(a.data[i]) - static_cast<double>(b.data[i]));
  return sum / static_cast<double>(a.data.size());
}

// On a photo's centre, in the proxy's plane, on its surface, looking away from it, inside the box.
TEST_F(GlHardCase, DegenerateViewsStayFinite) {
  Load(PhotographedInTurn(6, 80));
  const Camera camera = Camera::Pinhole(64, 48, 50, 50, 32, 24);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), centre = world_.scene.views[2].CentreInWorld();
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    for (int e = 2; e <= 16; e += 2) {
      const double step = e == 16 ? 0.0 : std::pow(10.0, -e);
      for (const auto& [eye, target] :
           {std::pair<Eigen::Vector3d, Eigen::Vector3d>{centre + step * Eigen::Vector3d(1, 2, -1), {0, 0, 0.3}},
            {{2, 2, step}, {0, 0, 0.3}},
            {{0.2, 0.1, 0.7 + step}, {5, 0.3, 0.7}},
            {{0.5 + step, 0, 0.3}, {-1, 0, 0.3}},
            {{3, 3, 1}, {6, 6, 2}}})
        Draw(way.settings, MakeRenderView(camera, LookAt(eye, target, up)));
    }
    RenderView singular = ArcView(1, 40, 30, 40);
    singular.P.setZero();
    EXPECT_THROW(Draw(way.settings, singular), std::invalid_argument);
  }
}

// The picture at a photo's centre is its limit. Interpolated samples on the photo's very border see it from its own
// centre only: the cells there are left out.
TEST_F(GlHardCase, ApproachesAPhotosCentreContinuously) {
  Load(PhotographedInTurn(6, 96));
  const View& source = world_.scene.views[3];
  RadianceSettings pixels, sparse, cells;
  sparse.grid_columns = cells.grid_columns = 9;
  sparse.grid_rows = cells.grid_rows = 7;
  sparse.sampling = Sampling::kInterpolated;
  for (const RadianceSettings& settings : {pixels, sparse, cells}) {
    SCOPED_TRACE(settings.Sparse() ? Name(settings.sampling) : "pixels");
    // Seen from the scene, three units away.
    const auto view_at = [&](double angle_rad) {
      Rigid3 pose = source.cam_from_world;
      pose.translation += 3 * angle_rad * Eigen::Vector3d(0.6, -0.3, 0.74);
      return MakeRenderView(world_.scene.CameraOf(source), pose);
    };
    const ImageF limit = Draw(settings, view_at(0));
    double last = std::numeric_limits<double>::infinity();
    for (int e = 1; e <= 15; ++e) {
      const double angle = std::pow(10.0, -e);
      const ImageF near = Draw(settings, view_at(angle));
      const ImageF own = WeightPictures(Request(settings, view_at(angle)))[1];  // the photo's weight is red
      double worst = 0, others = 0;
      // Inside the photo: at its very border the moved view sees past it.
      const int margin = settings.Sparse() && settings.sampling == Sampling::kInterpolated ? 13 : 4;
      for (int y = margin; y < near.height - margin; ++y)
        for (int x = margin; x < near.width - margin; ++x) {
          for (int c = 0; c < 3; ++c)
            worst = std::max(worst,
                             std::abs(static_cast<double>(near.At(x, y, c)) - static_cast<double>(limit.At(x, y, c))));
          if (near.At(x, y, 3) > 0)
            others = std::max(others, 1 - static_cast<double>(own.At(x, y, 0) / own.At(x, y, 3)));
        }
      // The other photos are a few tenths of a radian away, and where its depth map calls this one blocked it counts
      // for 50 times as far.
      EXPECT_LE(others, 50 * 10 * angle + 1e-6) << "1e-" << e;
      if (e >= 5) {
        EXPECT_LT(worst, 0.05) << "1e-" << e;
      }
      if (e >= 7) {
        EXPECT_LT(worst, 1.5 / 255);
      }
      if (!settings.Sparse()) {
        EXPECT_LE(worst, last + 0.5 / 255) << "1e-" << e;
      }
      last = worst;
    }
  }
}

TEST_F(GlHardCase, OnePhotoIsEnough) {
  Load(PhotographedInTurn(1, 96));
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    EXPECT_GT(Coverage(Draw(way.settings, ArcView(0.05, 80, 60, 90))), 0.5);
  }
}

// Behind all photos, beyond what they see, away from the proxy; and with every photo left out.
TEST_F(GlHardCase, WhereNoPhotoSeesThereAreHoles) {
  Load(PhotographedInTurn(6, 96));
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    const Camera camera = Camera::Pinhole(64, 48, 200, 200, 32, 24);
    EXPECT_EQ(Coverage(Draw(way.settings,
                            MakeRenderView(camera, LookAt({5, 5, 1}, {5.9, 5.9, 0}, Eigen::Vector3d::UnitZ())))),
              0);
    EXPECT_EQ(
        Coverage(Draw(way.settings, MakeRenderView(camera, LookAt({0, 0, 3}, {0, 1, 9}, Eigen::Vector3d::UnitZ())))),
        0);
    RenderRequest request;
    request.settings = way.settings;
    request.view = ArcView(1, 64, 48, 60);
    request.use.assign(6, false);
    EXPECT_EQ(Coverage(Draw(request)), 0);
  }
}

// A scene of another size, or far from its origin: the same picture, up to what doubles keep of its coordinates.
TEST_F(GlHardCase, ScalesAndOffsetsChangeNothing) {
  struct Case {
    double scale;
    Eigen::Vector3d offset;
    double tolerance;  // of the mean: a few pixels at silhouettes fall either way
  };
  constexpr double kSame = 1e-4;
  std::vector<ImageF> wanted;
  for (const Case& c : {Case{1, {0, 0, 0}, 0}, Case{1e-6, {0, 0, 0}, kSame}, Case{1e6, {0, 0, 0}, kSame},
                        Case{1, {1e7, -1e7, 1e7}, kSame}, Case{1e-3, {3, 5, -2}, kSame}}) {
    World w = PhotographedInTurn(6, 80);
    const Similarity3 moved{c.scale, Eigen::Quaterniond::Identity(), c.offset};
    RenderView view = ArcView(0.9, 90, 70, 90);
    Transform(w.scene, moved);
    UpdateFrameOfReference(w.scene);
    for (Eigen::Vector3d& v : w.proxy.vertices) v = moved * v;
    // P x = P' (s x + o), up to scale.
    view.P.col(3) = view.P.col(3) * c.scale - view.P.leftCols<3>() * c.offset;
    view.centre = moved * view.centre;
    Load(std::move(w));
    std::size_t i = 0;
    for (const Way& way : Ways()) {
      SCOPED_TRACE(way.name);
      const ImageF image = Draw(way.settings, view);
      EXPECT_GT(Coverage(image), 0.5);
      if (c.tolerance == 0)
        wanted.push_back(image);
      else
        EXPECT_LT(MeanDifference(image, wanted[i]), c.tolerance)
            << "scale " << c.scale << " offset " << c.offset.transpose();
      ++i;
    }
  }
}

// ---- Cameras and views in places that are.

TEST_F(GlHardCase, ACameraOnTheProxy) {
  for (double d = 1e-1; d >= 1e-15; d /= 100) {
    World world = Over({{0.3, 0.1, 4}, {-1, 0.2, 4}, {0.2, 1.1, 3}});
    for (const double height : {d, -d, 0.0}) {
      View v = world.scene.views[0];
      v.name += std::to_string(height);
      v.cam_from_world = LookAt({0.1, 0, height}, {2, 0.3, 0.5 * d}, Eigen::Vector3d::UnitZ());
      world.scene.views.push_back(v);
    }
    LoadPainted(std::move(world));
    ExpectSound(ViewFrom({0.2, 0.1, 3}), "at " + Step(d), 0.02);
  }
}

// A camera sideways of the view: its epipole goes to infinity before it, and comes back from behind.
TEST_F(GlHardCase, EpipolesAtInfinityAndBehind) {
  for (double d = 1; d >= 1e-15; d /= 100)
    for (const double sign : {-1.0, 1.0}) {
      LoadPainted(Over({{1, 0, 3 + sign * d},
                        {-0.5, 0, 3 + 3 * sign * d},
                        {0.3, 1, 3},
                        {0, 0.05 * d, 3 + sign},
                        {0, 0, 3 - sign * 0.5},
                        {-0.4, -1, 3}}));
      ExpectSound(ViewFrom({0, 0, 3}), "off by " + Step(sign * d), 0.02);
    }
}

// ---- Proxies that are.

World WithProxy(const Mesh& proxy) {
  World w = Over({{1, 0.2, 4}, {-0.7, 0.9, 4}, {0.1, -1.1, 3.5}, {-0.6, -0.2, 4.5}, {1.5, -0.8, 4}, {0.5, 1.3, 4}});
  w.proxy = proxy;
  return w;
}

TEST_F(GlHardCase, ZeroAreaAndSliverTriangles) {
  for (double d = 1e-1; d >= 1e-15; d /= 100) {
    Mesh proxy;
    test::AddQuad(proxy, {-2, -1, 0}, {2, -1, 0}, {2, -1 + d, 0}, {-2, -1 + d, 0});
    test::AddQuad(proxy, {-2, -1 + d, 0}, {2, -1 + d, 0}, {2, 2, 0}, {-2, 2, 0});
    proxy.faces.push_back({0, 1, 1});
    proxy.faces.push_back({3, 3, 3});
    proxy.vertices.push_back({0, -1, 0});  // on the line of an edge
    proxy.faces.push_back({0, 1, static_cast<std::int32_t>(proxy.vertices.size()) - 1});
    // Towards the view: a sliver in space, an edge in the picture.
    test::AddQuad(proxy, {0.5, 0, 0.1}, {0.5, 0, 1}, {0.5 + d, 0, 1}, {0.5 + d, 0, 0.1});
    LoadPainted(WithProxy(proxy));
    ExpectSound(ViewFrom({0.2, 0.1, 3}), "width " + Step(d), 0.05);
  }
}

// A floor that runs under the view and behind it, and lower and lower. OpenGL draws nothing nearer than kNearDepth, in
// scene sizes, the CPU does: they are compared as long as the floor's part in the view is farther.
TEST_F(GlHardCase, AProxyTriangleThroughTheNearPlane) {
  Mesh proxy;
  test::AddQuad(proxy, {-4, -20, 0}, {4, -20, 0}, {4, 20, 0}, {-4, 20, 0});
  LoadPainted(WithProxy(proxy));
  const Camera camera = Camera::Pinhole(33, 25, 24, 24, 16.5, 12.5);
  const double scene_size = 4, slope = 12.0 / 24;
  for (double d = 1; d >= 1e-15; d /= 10) {
    const RenderView view = MakeRenderView(camera, LookAt({0.1, -1, d}, {0.1, 3, d}, Eigen::Vector3d::UnitZ()));
    const bool drawn = d / slope > 2 * static_cast<double>(kNearDepth) * scene_size;
    ExpectSound(view, "over the floor by " + Step(d), drawn ? 0.02 : 1);
  }
}

TEST_F(GlHardCase, APlaneThroughTheCentreOfProjection) {
  const Camera camera = Camera::Pinhole(33, 25, 24, 24, 16.5, 12.5);
  for (double d = 1e-1; d >= 1e-15; d /= 100) {
    Mesh proxy;
    test::AddQuad(proxy, {-4, -20, 0}, {4, -20, 0}, {4, 20, 0}, {-4, 20, 0});
    test::AddQuad(proxy, {d, 1, 0}, {d, 3, 0}, {d, 3, 3}, {d, 1, 3});
    LoadPainted(WithProxy(proxy));
    ExpectSound(MakeRenderView(camera, LookAt({0, 0, 1}, {0.4, 3, 0.2}, Eigen::Vector3d::UnitZ())), "off by " + Step(d),
                0.04);
    ExpectSound(MakeRenderView(camera, LookAt({0, 0, 1}, {0, 3, 1}, Eigen::Vector3d::UnitZ())),
                "straight on, off by " + Step(d), 0.04);
  }
}

// Rays become parallel, angles vanish, their ratios do not: the picture is the same at any distance. The CPU traces its
// rays in float, where products of three lengths end at 1e38: beyond 1e12 it has holes.
TEST_F(GlHardCase, APointAtInfinity) {
  const RenderView view = ViewFrom({0.2, 0.1, 3}, {0.2, 0.1, 0});
  std::vector<ImageF> limit;
  for (double far = 1e1; far < 1e31; far *= 1e3) {
    Mesh proxy;
    test::AddQuad(proxy, {-far, -far, -far}, {far, -far, -far}, {far, far, -far}, {-far, far, -far});
    LoadPainted(WithProxy(proxy));
    std::size_t i = 0;
    for (Way way : Ways()) {
      if (way.settings.resolution != Resolution::kOff) way.settings.k = 0;  // so far away those of equal resolution tie
      ExpectSound(way, view, "as far as " + Step(far), far < 1e12 ? 0 : 1);
      const ImageF image = Draw(way.settings, view);
      EXPECT_EQ(Coverage(image), 1) << way.name << " " << far;
      // Photos that all see the same share at will as far as the optimum is concerned, and angles below r_min are none.
      if (far < 1e6 || way.settings.similarity == Similarity::kFull) continue;
      if (limit.size() == i) limit.push_back(image);
      float worst = 0;
      for (std::size_t n = 0; n < image.data.size(); ++n)
        worst = std::max(worst, std::abs(image.data[n] - limit[i].data[n]));
      EXPECT_LE(worst, kColorTolerance) << way.name << " " << far;
      ++i;
    }
  }
}

}  // namespace
}  // namespace lumi
