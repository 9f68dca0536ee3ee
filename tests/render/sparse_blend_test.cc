#include <gtest/gtest.h>

#include "render/picture/convert.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/parallel.h"
#include "sparse_test_scene.h"

namespace lumi {
namespace {

constexpr Sampling kBoth[] = {Sampling::kInterpolated, Sampling::kCandidates};

TEST(SparseBlend, AConstantColourWorldRendersConstant) {
  test::Capture c = test::MakeCapture(8, 64, std::array<std::uint8_t, 3>{200, 30, 90});
  for (const bool fine : {false, true}) {
    if (fine) c.proxy = test::Sheet(24);
    const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
    for (const Sampling sampling : kBoth)
      for (const int k : {1, 4, 9}) {
        const ImageF image =
            renderer->Render(test::SparseRequest(test::ViewOf(c, {1.3, 0.4, -4.2}, {0.1, 0, 0.5}), k, 9, sampling));
        ASSERT_EQ(test::Wrong(image), "");
        int seen = 0;
        for (int y = 0; y < image.height; ++y)
          for (int x = 0; x < image.width; ++x) {
            const float a = image.At(x, y, 3);
            if (a == 0) continue;
            ++seen;
            ASSERT_NEAR(image.At(x, y, 0) / a, 200 / 255.0, 1e-5);
            ASSERT_NEAR(image.At(x, y, 1) / a, 30 / 255.0, 1e-5);
            ASSERT_NEAR(image.At(x, y, 2) / a, 90 / 255.0, 1e-5);
          }
        EXPECT_GT(seen, 2500);
      }
  }
}

TEST(SparseBlend, AtASourceCameraThatPhotoHasNearlyAllTheWeight) {
  const test::Capture c = test::MakeCapture(9, 96);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const Sampling sampling : kBoth)
    for (std::size_t i = 0; i < c.scene.views.size(); ++i) {
      RenderRequest r = test::SparseRequest(MakeRenderView(c.scene, c.scene.views[i]), 4, 8, sampling);
      EXPECT_GT(Compare(ToRgb8(renderer->Render(r)), c.photos[i].levels[0]).psnr_db, 45) << c.scene.views[i].name;
      r.show = Show::kFalseColor;
      const ImageF image = renderer->Render(r);
      EXPECT_NEAR(Coverage(image), 1, 1e-9);
      const Eigen::Vector3f color = SourceColor(static_cast<int>(i));
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          for (int k = 0; k < 3; ++k) ASSERT_NEAR(image.At(x, y, k), color[k], 0.01) << x << " " << y;
    }
}

// The same on a fine mesh that reaches beyond the view on every side and hides parts of itself: its triangles end at
// the view's borders, where the photo still contains them.
TEST(SparseBlend, AtASourceCameraThatPhotoHasAllTheWeightOnAFineMeshToo) {
  test::Capture c = test::MakeCapture(9, 96);
  c.proxy = test::Sheet(40);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const Sampling sampling : kBoth)
    for (std::size_t i = 0; i < c.scene.views.size(); i += 2) {
      RenderRequest r = test::SparseRequest(MakeRenderView(c.scene, c.scene.views[i]), 4, 8, sampling);
      r.settings.visibility = true;
      r.show = Show::kFalseColor;
      const ImageF image = renderer->Render(r);
      r.settings.grid_columns = r.settings.grid_rows = 0;
      const ImageF pixels = renderer->Render(r);
      const Eigen::Vector3f color = SourceColor(static_cast<int>(i));
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          if (!(pixels.At(x, y, 3) > 0)) continue;
          ASSERT_GT(image.At(x, y, 3), 0.99F) << "a hole where every pixel has its photo: " << x << " " << y;
          for (int k = 0; k < 3; ++k) ASSERT_NEAR(image.At(x, y, k), color[k], 0.01) << x << " " << y;
        }
    }
}

// Whether a view sees the proxy's point of a pixel inside its photo; by margin_px > 0 from its border.
bool Sees(const test::Capture& c, std::size_t photo, const RenderView& view, int x, int y, double margin_px,
          bool& hit) {
  const Eigen::Vector3d d = RayDirection(view.P, {x + 0.5, y + 0.5})->normalized();
  const double t = test::HitDistance(c.proxy, view.centre, d);
  hit = std::isfinite(t);
  if (!hit) return false;
  const auto p = Project(MakeRenderView(c.scene, c.scene.views[photo]).P, Eigen::Vector3d(view.centre + t * d));
  const Eigen::Vector2d size = c.scene.cameras[0].width_px * Eigen::Vector2d(1, 0.75);
  return p && p->x() > margin_px && p->y() > margin_px && p->x() < size.x() - margin_px &&
         p->y() < size.y() - margin_px;
}

TEST(SparseBlend, NothingIsTakenFromOutsideAPhoto) {
  // Two photos that look to the left and to the right, and a wide view of both.
  test::Capture c = test::MakeCapture(2, 48);
  c.proxy.vertices = {{-20, -20, 1}, {20, -20, 1}, {20, 20, 1}, {-20, 20, 1}};
  c.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
  c.scene.views[0].cam_from_world = LookAt({-0.3, 0, -3}, {-1.2, 0, 1}, {0, -1, 0});
  c.scene.views[1].cam_from_world = LookAt({0.3, 0, -3}, {1.2, 0.2, 1}, {0, -1, 0});
  UpdateFrameOfReference(c.scene);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  const RenderView view =
      MakeRenderView(Camera::Pinhole(160, 120, 70, 70, 80, 60), LookAt({0, 0, -3.2}, {0, 0, 1}, {0, -1, 0}));
  for (const Sampling sampling : kBoth)
    for (const int grid : {3, 9, 30}) {
      RenderRequest r = test::SparseRequest(view, 2, grid, sampling);
      r.show = Show::kFalseColor;
      const ImageF image = renderer->Render(r);
      ASSERT_EQ(test::Wrong(image), "");
      int alone = 0, holes = 0;
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
          bool hit = false;
          // A pixel's centre within rounding of a border may count to either side.
          const bool a = Sees(c, 0, view, x, y, -1e-3, hit), b = Sees(c, 1, view, x, y, -1e-3, hit);
          const float alpha = image.At(x, y, 3);
          if (!a && !b) {
            ASSERT_EQ(alpha, 0) << x << " " << y << " grid " << grid;
            ++holes;
          } else if (a != b && alpha > 0) {
            const Eigen::Vector3f color = SourceColor(a ? 0 : 1);
            for (int k = 0; k < 3; ++k)
              ASSERT_NEAR(image.At(x, y, k) / alpha, color[k], 2e-3) << x << " " << y << " grid " << grid;
            ++alone;
          }
        }
      EXPECT_GT(alone, grid == 3 ? 200 : 2000);
      EXPECT_GT(holes, 1000);
    }
}

TEST(SparseBlend, ABoxBeforeAPlaneOccludesAsPerPixel) {
  const test::Capture c = test::MakeCapture(9, 160);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(1.3, 0.4, -4.2), Eigen::Vector3d(-1.8, 0.9, -2.5)}) {
    RenderRequest exact = test::SparseRequest(test::ViewOf(c, eye), 4, 0, Sampling::kInterpolated);
    exact.settings.visibility = false;
    const Image8 reference = ToRgb8(renderer->Render(exact));
    for (const Sampling sampling : kBoth) {
      RenderRequest r = test::SparseRequest(test::ViewOf(c, eye), 4, 25, sampling);
      r.settings.visibility = false;
      const Image8 image = ToRgb8(renderer->Render(r));
      int far = 0;
      for (std::size_t i = 0; i < image.data.size(); ++i)
        far += std::abs(image.data[i] - reference.data[i]) > 40 ? 1 : 0;
      // A wrong surface shows another place of the texture: it would fill whole cells of 40 pixels.
      EXPECT_LT(far, 40) << eye.transpose();
    }
  }
}

TEST(SparseBlend, FacetsThatCrossAndFineMeshesInDepthShowTheNearest) {
  // One photo: its weight is 1 on every path, and pictures differ by where it is read alone.
  test::Capture c = test::MakeCapture(1, 160);
  const auto wall = [](double slope, double z) {
    Mesh m;
    m.vertices = {{-3, -3, z - 3 * slope}, {3, -3, z + 3 * slope}, {3, 3, z + 3 * slope}, {-3, 3, z - 3 * slope}};
    m.faces = {{0, 1, 2}, {0, 2, 3}};
    return m;
  };
  // No edge of theirs lies where they cross: only the depth test parts them there.
  Mesh crossing = wall(0.5, 1), sheets = test::Sheet(20);
  Append(crossing, wall(-0.5, 1));
  Mesh before = test::Sheet(20);
  for (auto& v : before.vertices) v = Eigen::Vector3d(0.3 * v.x(), 0.3 * v.y(), v.z() - 1.5);
  Append(before, sheets);
  for (const Mesh& proxy : {crossing, before}) {
    c.proxy = proxy;
    const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
    RenderRequest exact =
        test::SparseRequest(test::ViewOf(c, {1.6, 0.4, -4}, {0.5, 0.2, 1}), 1, 0, Sampling::kInterpolated);
    exact.settings.visibility = false;
    const Image8 reference = ToRgb8(renderer->Render(exact));
    for (const Sampling sampling : kBoth) {
      RenderRequest r = exact;
      r.settings.grid_columns = r.settings.grid_rows = 3;
      r.settings.sampling = sampling;
      EXPECT_GT(Compare(ToRgb8(renderer->Render(r)), reference).psnr_db, 45)
          << Name(sampling) << " of " << proxy.faces.size() << " faces";
    }
  }
}

TEST(SparseBlend, ADenserGridConvergesToPerPixel) {
  test::Capture c = test::MakeCapture(13, 160);
  for (const bool fine : {false, true}) {
    if (fine) c.proxy = test::Sheet(40);
    const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
    const RenderView view = test::ViewOf(c, {0.9, 0.3, -3.8});
    for (const bool prefilter : {false, true}) {
      // What converges is the interpolation of smooth weights; occlusion edges stay sharper than any grid.
      RenderRequest exact = test::SparseRequest(view, 4, 0, Sampling::kInterpolated);
      exact.settings.prefilter = prefilter;
      exact.settings.visibility = false;
      const Image8 reference = ToRgb8(renderer->Render(exact));
      for (const Sampling sampling : kBoth) {
        std::vector<double> psnr;
        for (const int grid : {6, 24, 96}) {
          RenderRequest r = test::SparseRequest(view, 4, grid, sampling);
          r.settings.prefilter = prefilter;
          r.settings.visibility = false;
          psnr.push_back(Compare(ToRgb8(renderer->Render(r)), reference).psnr_db);
        }
        RecordProperty(std::string(Name(sampling)) + (fine ? "_fine" : "_coarse") + (prefilter ? "_prefiltered" : ""),
                       std::to_string(psnr[0]) + " " + std::to_string(psnr[1]) + " " + std::to_string(psnr[2]));
        // A fine mesh has its vertices whatever the grid.
        if (!fine && sampling == Sampling::kInterpolated) {
          EXPECT_GT(psnr[2], psnr[0] + 6);
        }
        EXPECT_GT(psnr[2], 40) << Name(sampling) << " " << fine << " " << psnr[0] << " " << psnr[1];
      }
    }
  }
}

// Smooth leaves and sums that are divided: a fifth and more is taken away by negative weights.
TEST(SparseBlend, TheOptimumsNegativeWeightsTakeAwayAsPerPixel) {
  test::Capture c = test::MakeCapture(13, 160);
  c.proxy.vertices.resize(4);  // the plane alone: no silhouettes
  c.proxy.faces.resize(2);
  // Neighbours differ, so that it shows who is taken away.
  for (std::size_t i = 0; i < c.photos.size(); ++i) {
    Image8 grey(160, 120, 3);
    std::fill(grey.data.begin(), grey.data.end(), static_cast<std::uint8_t>(i % 2 ? 90 : 160));
    c.photos[i].levels = BuildPyramid(grey);
  }
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  const RenderView view = test::ViewOf(c, {0.9, 0.3, -3.8});
  for (const bool fov : {true, false}) {
    RenderRequest r = test::SparseRequest(view, 16, 0, Sampling::kInterpolated);
    r.settings.field_of_view = fov;
    r.settings.similarity = Similarity::kFull;
    r.settings.correlation = Correlation::kFallingLeaves;
    r.settings.sum = WeightSum::kRenormalise;
    r.settings.r_min_rad = 6 * kRadPerDeg;
    r.settings.r_max_rad = 15 * kRadPerDeg;
    const Image8 reference = ToRgb8(renderer->Render(r));
    r.settings.grid_columns = r.settings.grid_rows = 64;
    const ImageF image = renderer->Render(r);
    ASSERT_EQ(test::Wrong(image), "");
    const double psnr = Compare(ToRgb8(image), reference).psnr_db;
    RecordProperty(fov ? "psnr_db" : "psnr_db_without_field_of_view", std::to_string(psnr));
    // 63 and 44; 44 and 40 with negative weights taken for 0. With field of view off photos end hard, between samples.
    EXPECT_GT(psnr, fov ? 55 : 42);
  }
}

TEST(SparseBlend, OversampledPhotosAreReadFromTheirPyramidAsPerPixel) {
  test::Capture c = test::MakeCapture(9, 256);
  for (const bool fine : {false, true}) {
    if (fine) c.proxy = test::Sheet(24);
    const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
    // A view of a fifth of the photos' pixels; levels vary over it.
    const RenderView view =
        MakeRenderView(c.scene.cameras[0].Scaled(51, 38), LookAt({1.5, 0.3, -3.2}, {0, 0, 0.5}, {0, -1, 0}));
    const Image8 reference = ToRgb8(renderer->Render(test::SparseRequest(view, 3, 0, Sampling::kInterpolated)));
    for (const Sampling sampling : kBoth) {
      RenderRequest r = test::SparseRequest(view, 3, 26, sampling);
      const double with = Compare(ToRgb8(renderer->Render(r)), reference).psnr_db;
      r.settings.prefilter = false;
      const double without = Compare(ToRgb8(renderer->Render(r)), reference).psnr_db;
      EXPECT_GT(with, without + 3) << Name(sampling) << " " << fine;
      EXPECT_GT(with, 38) << Name(sampling) << " " << fine;
    }
  }
}

TEST(SparseBlend, ExposuresAreDividedOut) {
  test::Capture c = test::MakeCapture(4, 48, std::array<std::uint8_t, 3>{120, 60, 30});
  for (std::size_t i = 0; i < 4; i += 2) {
    c.scene.views[i].gain = 2;
    for (auto& level : c.photos[i].levels)
      for (auto& v : level.data) v = static_cast<std::uint8_t>(2 * v);
  }
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const int grid : {0, 9})
    for (const Sampling sampling : kBoth) {
      RenderRequest r = test::SparseRequest(test::ViewOf(c, {0.7, 0.3, -4}), 3, grid, sampling);
      r.settings.exposure = true;
      const ImageF image = renderer->Render(r);
      for (std::size_t i = 0; i < image.data.size(); i += 4)
        if (image.data[i + 3] > 0) {
          ASSERT_NEAR(image.data[i] / image.data[i + 3], 120 / 255.0, 1e-3);
        }
    }
}

TEST(SparseBlend, WithFieldOfViewOffAPhotoThatEndsLeavesItsShareMissing) {
  test::Capture c = test::MakeCapture(2, 48);
  c.proxy.vertices = {{-20, -20, 1}, {20, -20, 1}, {20, 20, 1}, {-20, 20, 1}};
  c.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
  c.scene.views[0].cam_from_world = LookAt({-0.3, 0, -3}, {-0.5, 0, 1}, {0, -1, 0});
  c.scene.views[1].cam_from_world = LookAt({0.3, 0, -3}, {0.5, 0.2, 1}, {0, -1, 0});
  UpdateFrameOfReference(c.scene);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  const RenderView view =
      MakeRenderView(Camera::Pinhole(160, 120, 120, 120, 80, 60), LookAt({0, 0, -3.2}, {0, 0, 1}, {0, -1, 0}));
  RenderRequest r = test::SparseRequest(view, 2, 9, Sampling::kCandidates);
  r.settings.field_of_view = false;
  r.show = Show::kFalseColor;
  const ImageF image = renderer->Render(r);
  ASSERT_EQ(test::Wrong(image), "");
  int partial = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      bool hit = false;
      const bool a = Sees(c, 0, view, x, y, 0.01, hit);
      const bool a_at_all = Sees(c, 0, view, x, y, -0.01, hit), b_at_all = Sees(c, 1, view, x, y, -0.01, hit);
      const float alpha = image.At(x, y, 3);
      if (!a_at_all && !b_at_all) {
        ASSERT_EQ(alpha, 0);
      }
      // Near the border between two cells' lists one may miss the other photo.
      if (a && !b_at_all && alpha < 0.999F) {
        ++partial;
        for (int k = 0; k < 3; ++k) ASSERT_NEAR(image.At(x, y, k) / alpha, SourceColor(0)[k], 1e-3);
      }
    }
  EXPECT_GT(partial, 100);
}

TEST(SparseBlend, TheSameBytesWhateverTheThreads) {
  const test::Capture c = test::MakeCapture(7, 96);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const Sampling sampling : kBoth) {
    const RenderRequest r = test::SparseRequest(test::ViewOf(c, {1, 0.2, -4}), 4, 11, sampling);
    const ImageF a = renderer->Render(r);
    SetThreadCount(1);
    const ImageF b = renderer->Render(r);
    SetThreadCount(0);
    EXPECT_EQ(a.data, b.data);
  }
}

TEST(SparseBlend, StatisticsAndTessellation) {
  const test::Capture c = test::MakeCapture(7, 96);
  const auto renderer = MakeCpuRenderer(WorldOf(c.scene, c.proxy), c.photos);
  for (const Sampling sampling : kBoth) {
    RenderRequest r = test::SparseRequest(test::ViewOf(c, {1, 0.2, -4}), 4, 11, sampling);
    const ImageF plain = renderer->Render(r);
    const RenderStatistics s = renderer->Statistics();
    EXPECT_GE(s.samples, 11 * 11);
    EXPECT_GE(s.triangles, 2 * 10 * 10);
    EXPECT_GT(s.plan_ms, 0);
    EXPECT_GT(s.blend_ms, 0);
    r.show = Show::kTessellation;
    const ImageF drawn = renderer->Render(r);
    int changed = 0;
    for (std::size_t i = 0; i < plain.data.size(); i += 4) changed += plain.data[i] != drawn.data[i] ? 1 : 0;
    EXPECT_GT(changed, 2000);
    EXPECT_EQ(test::Wrong(drawn), "");
  }
}

}  // namespace
}  // namespace lumi
