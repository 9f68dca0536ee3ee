// What the GL backend draws where geometry degenerates, approached step by step: finite, holes where nothing is seen, and
// the picture of the well-posed neighbour. Every way of weighing: at every pixel, from sparse samples, from cells.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "render/convert.h"
#include "render/renderer.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

using test::ArcView;
using test::MakeWorld;
using test::World;

struct Way {
  const char* name;
  RadianceSettings settings;
};
// Plain, and with everything on that can divide by something.
std::vector<Way> Ways() {
  RadianceSettings plain, all;
  all.resolution = Resolution::kJacobian;
  all.resolution_low = 0.4;
  all.time = true;
  all.exposure = true;
  all.correlation = Correlation::kFallingLeaves;
  std::vector<Way> ways;
  for (const auto& [name, sparse_name, cell_name, settings] :
       {std::tuple{"pixels", "sparse", "cells", plain}, {"pixels, everything", "sparse, everything", "cells, everything", all}}) {
    ways.push_back({name, settings});
    RadianceSettings sparse = settings;
    sparse.grid_columns = 9;
    sparse.grid_rows = 7;
    sparse.sampling = Sampling::kInterpolated;
    ways.push_back({sparse_name, sparse});
    sparse.sampling = Sampling::kCandidates;
    ways.push_back({cell_name, sparse});
  }
  return ways;
}

class GlHardCase : public test::GlTest {
 protected:
  using GlTest::Draw;
  ImageF Draw(const RadianceSettings& settings, const RenderView& view) {
    RenderRequest request;
    request.settings = settings;
    request.view = view;
    const ImageF image = Draw(request);
    test::ExpectFinite(image);
    return image;
  }
};

World Photographed(int views, int side_px) {
  World w = MakeWorld(views, side_px);
  for (std::size_t i = 0; i < w.scene.views.size(); ++i) w.scene.views[i].time_s = 0.01 * static_cast<double>(i);
  test::Photograph(w);
  return w;
}

double MeanDifference(const ImageF& a, const ImageF& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::abs(static_cast<double>(a.data[i]) - static_cast<double>(b.data[i]));
  return sum / static_cast<double>(a.data.size());
}

// On a photo's centre, in the proxy's plane, on its surface, looking away from it, inside the box.
TEST_F(GlHardCase, DegenerateViewsStayFinite) {
  Load(Photographed(6, 80));
  const Camera camera = Camera::Pinhole(64, 48, 50, 50, 32, 24);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ(), centre = world_.scene.views[2].CentreInWorld();
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    for (int e = 2; e <= 16; e += 2) {
      const double step = e == 16 ? 0.0 : std::pow(10.0, -e);
      for (const auto& [eye, target] : {std::pair<Eigen::Vector3d, Eigen::Vector3d>{centre + step * Eigen::Vector3d(1, 2, -1), {0, 0, 0.3}},
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

// The picture at a photo's centre is its limit. Interpolated samples on the photo's very border see it from its own centre
// only: the cells there are left out.
TEST_F(GlHardCase, ApproachesAPhotosCentreContinuously) {
  Load(Photographed(8, 96));
  const View& source = world_.scene.views[3];
  RadianceSettings pixels, sparse, cells;
  sparse.grid_columns = cells.grid_columns = 9;
  sparse.grid_rows = cells.grid_rows = 7;
  sparse.sampling = Sampling::kInterpolated;
  for (const RadianceSettings& settings : {pixels, sparse, cells}) {
    SCOPED_TRACE(settings.Sparse() ? Name(settings.sampling) : "pixels");
    const auto at = [&](double distance) {
      Rigid3 pose = source.cam_from_world;
      pose.translation += distance * Eigen::Vector3d(0.6, -0.3, 0.74);
      return Draw(settings, MakeRenderView(world_.scene.CameraOf(source), pose));
    };
    const ImageF limit = at(0);
    double last = std::numeric_limits<double>::infinity();
    for (int e = 2; e <= 7; ++e) {
      const ImageF near = at(std::pow(10.0, -e));
      double worst = 0;
      // Inside the photo: at its very border the moved view sees past it.
      const int margin = settings.Sparse() && settings.sampling == Sampling::kInterpolated ? 13 : 4;
      for (int y = margin; y < near.height - margin; ++y)
        for (int x = margin; x < near.width - margin; ++x)
          for (int c = 0; c < 3; ++c)
            worst = std::max(worst, std::abs(static_cast<double>(near.At(x, y, c)) - static_cast<double>(limit.At(x, y, c))));
      if (e >= 5) {
        EXPECT_LT(worst, 0.05) << "1e-" << e;
      }
      if (e == 7) {
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
  Load(Photographed(1, 96));
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    EXPECT_GT(Coverage(Draw(way.settings, ArcView(0.05, 80, 60, 90))), 0.5);
  }
}

// Behind all photos, beyond what they see, away from the proxy; and with every photo left out.
TEST_F(GlHardCase, WhereNoPhotoSeesThereAreHoles) {
  Load(Photographed(5, 96));
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    const Camera camera = Camera::Pinhole(64, 48, 200, 200, 32, 24);
    EXPECT_EQ(Coverage(Draw(way.settings, MakeRenderView(camera, LookAt({5, 5, 1}, {5.9, 5.9, 0}, Eigen::Vector3d::UnitZ())))), 0);
    EXPECT_EQ(Coverage(Draw(way.settings, MakeRenderView(camera, LookAt({0, 0, 3}, {0, 1, 9}, Eigen::Vector3d::UnitZ())))), 0);
    RenderRequest request;
    request.settings = way.settings;
    request.view = ArcView(1, 64, 48, 60);
    request.use.assign(5, false);
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
  for (const Case& c : {Case{1, {0, 0, 0}, 0}, Case{1e-6, {0, 0, 0}, kSame}, Case{1e6, {0, 0, 0}, kSame}, Case{1, {1e7, -1e7, 1e7}, kSame},
                        Case{1e-3, {3, 5, -2}, kSame}}) {
    World w = Photographed(7, 80);
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
        EXPECT_LT(MeanDifference(image, wanted[i]), c.tolerance) << "scale " << c.scale << " offset " << c.offset.transpose();
      ++i;
    }
  }
}

}  // namespace
}  // namespace lumi
