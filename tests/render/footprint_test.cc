// Which level of a photo's pyramid a pixel reads: against finite differences of the map from the view to the photo, and
// in pictures of a plane that is seen obliquely, where the ratio of depths says nothing.
#include <gtest/gtest.h>

#include <random>

#include "render/picture/convert.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/prefilter.h"
#include "render/world/renderer.h"
#include "scene/image_difference/image_difference.h"
#include "tests/render/oblique_floor.h"

namespace lumi {
namespace {

Eigen::Vector2d Pixel(const Matrix34d& P, const Eigen::Vector3d& x) { return (P * x.homogeneous()).hnormalized(); }

// The photo's pixel of what the view's pixel shows on the plane n.x = c.
Eigen::Vector2d ThroughPlane(const RenderView& view, const RenderView& photo, const Eigen::Vector3d& n, double c,
                             const Eigen::Vector2d& x_px) {
  const Eigen::Vector3d d = *RayDirection(view.P, x_px);
  return Pixel(photo.P, view.centre + (c - n.dot(view.centre)) / n.dot(d) * d);
}

TEST(Footprint, IsTheHomographysJacobiansDeterminant) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> u(-1, 1);
  const Camera wide = Camera::Pinhole(200, 150, 160, 170, 90, 80),
               narrow = Camera::Pinhole(300, 300, 420, 410, 160, 140);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d n = Eigen::Vector3d(u(engine), u(engine), u(engine)).normalized(),
                          p(u(engine), u(engine), u(engine));
    const RenderView view =
        MakeRenderView(wide, LookAt(p + 4 * Eigen::Vector3d(u(engine), u(engine), -1.2), p, {0, -1, 0}));
    const RenderView photo = MakeRenderView(narrow, LookAt(p + 3 * Eigen::Vector3d(u(engine), u(engine), -1.1),
                                                           p + Eigen::Vector3d(0.2 * u(engine), 0, 0), {0, -1, 0}));
    // Where either sees the plane edge on, finite differences say nothing.
    if (std::abs(n.dot(p - view.centre)) < 0.2 || std::abs(n.dot(p - photo.centre)) < 0.2) continue;
    const Eigen::Vector2d x = Pixel(view.P, p);
    constexpr double kStep = 1e-4;
    Eigen::Matrix2d J;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
      J.col(axis) =
          (ThroughPlane(view, photo, n, n.dot(p), x + step) - ThroughPlane(view, photo, n, n.dot(p), x - step)) /
          (2 * kStep);
    }
    const double focal_ratio = std::sqrt(420.0 * 410.0 / (160.0 * 170.0));
    const double depth_ratio = view.P.row(2).dot(p.homogeneous()) / photo.P.row(2).dot(p.homogeneous());
    const double got =
        Footprint(focal_ratio, FacingRatio(n.dot(p - photo.centre), n.dot(p - view.centre)), depth_ratio);
    EXPECT_NEAR(got / std::abs(J.determinant()), 1, 1e-5);
  }
}

TEST(Footprint, IsTheRatioOfPixelsWhereBothFaceThePlane) {
  EXPECT_NEAR(Footprint(4.0, FacingRatio(2.0, 2.0), 1.0), 16, 1e-12);  // four times the focal length
  EXPECT_NEAR(Footprint(1.0, FacingRatio(1.0, 2.0), 2.0), 4, 1e-12);   // half as far
  EXPECT_LT(PyramidLevel(1.99), 0) << "read as it is up to two pixels a pixel";
  EXPECT_NEAR(PyramidLevel(4 * kReadWhole), 1, 1e-7F);
}

TEST(Footprint, IsFiniteEdgeOn) {
  for (const float a : {0.0F, 1e-38F, 1.0F, 1e30F})
    for (const float b : {0.0F, 1e-38F, 1.0F, 1e30F}) {
      const float ratio = FacingRatio(a, b);
      EXPECT_GT(ratio, 0) << a << " over " << b;
      EXPECT_LE(ratio, kMostFacing<float>) << a << " over " << b;
    }
}

TEST(Prefilter, AnObliquePlaneIsNotAliased) {
  const test::ObliqueFloor f;
  const auto renderer = MakeCpuRenderer(WorldOf(f.c.scene, f.c.proxy), f.c.photos);
  RenderRequest request;
  request.settings.k = 1;
  request.settings.field_of_view = false;  // no border fades: the photos alone are looked at
  request.settings.prefilter = false;
  request.view = f.fine;
  const Image8 wanted = Resize(ToRgb8(renderer->Render(request)), 160, 60);
  request.view = f.view;
  const double aliased = Compare(ToRgb8(renderer->Render(request)), wanted).psnr_db;
  request.settings.prefilter = true;
  const ImageF pixels = renderer->Render(request);
  const double filtered = Compare(ToRgb8(pixels), wanted).psnr_db;
  RecordProperty("aliased_db", std::to_string(aliased));
  RecordProperty("filtered_db", std::to_string(filtered));
  std::printf("  an oblique plane: %.1f dB as it is, %.1f dB prefiltered\n", aliased, filtered);
  EXPECT_GT(filtered, aliased + 3);

  // Levels from the corners of a cell, linear between them, are nearly those of its pixels.
  for (const Sampling sampling : {Sampling::kCandidates, Sampling::kInterpolated}) {
    request.settings.grid_columns = 17;
    request.settings.grid_rows = 13;
    request.settings.sampling = sampling;
    const double sparse = Compare(ToRgb8(renderer->Render(request)), ToRgb8(pixels)).psnr_db;
    std::printf("  %s against a level a pixel: %.1f dB\n", std::string(Name(sampling)).c_str(), sparse);
    EXPECT_GT(sparse, 40) << Name(sampling);
  }
}

}  // namespace
}  // namespace lumi
