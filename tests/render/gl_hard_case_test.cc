// What the GL backend draws where geometry degenerates, approached step by step: finite, holes where nothing is seen,
// and the picture of the well-posed neighbour. Every way of weighing: at every pixel, from sparse samples, from cells.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "render/picture/convert.h"
#include "render/world/renderer.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

using test::ArcView;
using test::MakeWorld;
using test::World;

struct Way {
  std::string name;
  RadianceSettings settings;
};
// Plain, and with everything on that can divide by something: at every pixel, from sparse samples, from cells, and the
// optimum.
std::vector<Way> Ways() {
  RadianceSettings plain, all;
  all.resolution = Resolution::kJacobian;
  all.resolution_low = 0.4;
  all.time = true;
  all.exposure = true;
  all.correlation = Correlation::kFallingLeaves;
  std::vector<Way> ways;
  for (const auto& [suffix, settings] : {std::pair{"", plain}, {", everything", all}}) {
    const auto add = [&](const char* name, auto change) {
      ways.push_back({std::string(name) + suffix, settings});
      change(ways.back().settings);
    };
    const auto sparse = [](RadianceSettings& s) {
      s.grid_columns = 9;
      s.grid_rows = 7;
      s.sampling = Sampling::kInterpolated;
    };
    add("pixels", [](RadianceSettings&) {});
    add("sparse", sparse);
    add("cells", [&](RadianceSettings& s) {
      sparse(s);
      s.sampling = Sampling::kCandidates;
    });
    add("optimum", [&](RadianceSettings& s) {
      sparse(s);
      s.similarity = Similarity::kFull;
      s.correlation = Correlation::kFallingLeaves;
    });
  }
  return ways;
}

// Alpha and weights that GL blends with differ from the core's by a float's rounding, near ties amplified; the CPU's
// sparse blend weighs in steps of 1/4096.
constexpr float kWeightTolerance = 1e-3F;
// Code values: what is above, for colours half the range apart, and eight bits of a texture's bilinear weights.
constexpr float kColorTolerance = 3.0F / 255;

class GlHardCase : public test::GlTest {
 protected:
  using GlTest::Draw;
  ImageF Draw(const RadianceSettings& settings, const RenderView& view) {
    const ImageF image = Draw(Request(settings, view));
    test::ExpectFinite(image);
    return image;
  }
  static RenderRequest Request(const RadianceSettings& settings, const RenderView& view) {
    RenderRequest request;
    request.settings = settings;
    request.view = view;
    return request;
  }

  // Photos of a colour each, for both backends.
  void LoadPainted(World world) {
    test::Paint(world, PaintOf);
    Load(std::move(world));
    cpu_ = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos);
  }
  // From the middle half of the range: what negative weights take away is not clipped.
  static std::array<std::uint8_t, 3> PaintOf(std::size_t i) {
    const Eigen::Vector3f c = SourceColor(static_cast<int>(i));
    const auto code = [](float x) { return static_cast<std::uint8_t>(std::lround(64 + 127 * x)); };
    return {code(c.x()), code(c.y()), code(c.z())};
  }

  // Weight of each camera at a pixel of WeightPictures(); alpha is not in it.
  std::vector<float> WeightsAt(const std::vector<ImageF>& pictures, int x, int y) const {
    std::vector<float> w(world_.scene.views.size(), 0.0F);
    const float alpha = pictures[0].At(x, y, 3);
    for (std::size_t j = 0; j < w.size() && alpha > 0; ++j)
      w[j] = pictures[j / 3].At(x, y, static_cast<int>(j % 3)) / alpha;
    return w;
  }

  // Weights sum to 1, and lie in [0, 1] unless they are the optimum's, or alpha is 0.
  void ExpectConvex(const RadianceSettings& settings, const std::vector<ImageF>& pictures) {
    // What a premultiplied colour's rounding becomes where alpha is small.
    constexpr float kLeastAlpha = 1e-3F;
    const bool full = settings.similarity == Similarity::kFull;
    for (int y = 0; y < pictures[0].height; ++y)
      for (int x = 0; x < pictures[0].width; ++x) {
        const float alpha = pictures[0].At(x, y, 3);
        ASSERT_TRUE(alpha >= 0 && alpha <= 1) << alpha << " at " << x << " " << y;
        float total = 0;
        for (const ImageF& p : pictures)
          for (int c = 0; c < 3; ++c) {
            const float w = p.At(x, y, c);
            ASSERT_TRUE(std::isfinite(w) && std::abs(w) <= 2) << w << " at " << x << " " << y;
            if (!full) {
              ASSERT_TRUE(w >= 0 && w <= alpha * 1.00001F) << w << " of alpha " << alpha << " at " << x << " " << y;
            }
            total += w;
          }
        if (alpha == 0) {
          ASSERT_EQ(total, 0) << x << " " << y;
        } else if (alpha > kLeastAlpha) {
          ASSERT_NEAR(total / alpha, 1, 1e-4F) << x << " " << y;
        }
      }
  }

  // Share of the pixels at which the two backends' pictures differ.
  double Disagreement(const RadianceSettings& settings, const RenderView& view) {
    const ImageF gl = Draw(settings, view), cpu = cpu_->Render(Request(settings, view));
    int differ = 0;
    for (int y = 0; y < gl.height; ++y)
      for (int x = 0; x < gl.width; ++x) {
        bool same = true;
        for (int c = 0; c < 4; ++c) same = same && std::abs(gl.At(x, y, c) - cpu.At(x, y, c)) <= kColorTolerance;
        differ += !same;
      }
    return static_cast<double>(differ) / (gl.width * gl.height);
  }

  // Both backends in every way; `stray`: the share of pixels that may differ, at silhouettes and where there is a tie.
  void ExpectSound(const RenderView& view, const std::string& what, double stray) {
    for (const Way& way : Ways()) ExpectSound(way, view, what, stray);
  }
  void ExpectSound(const Way& way, const RenderView& view, const std::string& what, double stray) {
    SCOPED_TRACE(what + ", " + way.name);
    ExpectConvex(way.settings, WeightPictures(Request(way.settings, view)));
    const double differ = Disagreement(way.settings, view);
    EXPECT_LE(differ, stray);
    if (stray < 1) worst_ = std::max(worst_, differ);
  }

  void TearDown() override {
    cpu_.reset();
    GlTest::TearDown();
    if (worst_ > 0) std::printf("  at most %.2f %% of a picture's pixels differ between the backends\n", 100 * worst_);
  }

  std::unique_ptr<Renderer> cpu_;
  double worst_ = 0;
};

World Photographed(int views, int side_px) {
  World w = MakeWorld(views, side_px);
  for (std::size_t i = 0; i < w.scene.views.size(); ++i) w.scene.views[i].time_s = 0.01 * static_cast<double>(i);
  test::Photograph(w);
  return w;
}

// Cameras at these places that look at the origin and see all that is near it, over the floor. Six of them serve best:
// a shader is compiled for each number of cameras. Lengths are halved twice on the way to the normalised frame: what is
// symmetric here is so in floats.
World Over(const std::vector<Eigen::Vector3d>& centres) {
  World w;
  w.scene.cameras = {Camera::Pinhole(32, 32, 10, 10, 16, 16)};
  for (std::size_t i = 0; i < centres.size(); ++i) {
    View v;
    v.name = std::to_string(100000 + i) + ".png";
    v.camera = CameraId{0};
    v.cam_from_world = LookAt(centres[i], {0, 0, 0}, Eigen::Vector3d::UnitY());
    v.time_s = 0;
    w.scene.views.push_back(v);
  }
  UpdateFrameOfReference(w.scene);
  w.scene.normalized_from_world = {0.25, Eigen::Quaterniond::Identity(), {0, 0, 0}};
  test::AddQuad(w.proxy, {-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  return w;
}

// The middle of the middle pixel, (16, 12), looks straight at `at`.
RenderView ViewFrom(const Eigen::Vector3d& eye, const Eigen::Vector3d& at = {0, 0, 0}) {
  return MakeRenderView(Camera::Pinhole(33, 25, 32, 32, 16.5, 12.5), LookAt(eye, at, Eigen::Vector3d::UnitY()));
}

std::string Step(double d) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0e", d);
  return text;
}

double MeanDifference(const ImageF& a, const ImageF& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i)
    sum += std::abs(static_cast<double>(a.data[i]) - static_cast<double>(b.data[i]));
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
  Load(Photographed(6, 96));
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
  Load(Photographed(1, 96));
  for (const Way& way : Ways()) {
    SCOPED_TRACE(way.name);
    EXPECT_GT(Coverage(Draw(way.settings, ArcView(0.05, 80, 60, 90))), 0.5);
  }
}

// Behind all photos, beyond what they see, away from the proxy; and with every photo left out.
TEST_F(GlHardCase, WhereNoPhotoSeesThereAreHoles) {
  Load(Photographed(6, 96));
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
    World w = Photographed(6, 80);
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

// ---- Weights where they are ill-posed.

// Four cameras at one angle from the middle ray, exactly; the others are farther. k + 1 of the four tie for every k
// below 4. No continuity is claimed there: only that the tied share, and nobody else.
TEST_F(GlHardCase, TiedCamerasShare) {
  LoadPainted(Over({{1, 0, 4}, {0, 1, 4}, {-1, 0, 4}, {0, -1, 4}, {3, 0, 4}, {0, -3, 4}}));
  for (Way way : Ways())
    for (const int k : {1, 3, 4, 0}) {
      SCOPED_TRACE(way.name + ", k " + std::to_string(k));
      way.settings.k = k;
      const auto middle = [&](const RenderView& view) {
        const std::vector<ImageF> pictures = WeightPictures(Request(way.settings, view));
        ExpectConvex(way.settings, pictures);
        return WeightsAt(pictures, 16, 12);
      };
      const std::vector<float> w = middle(ViewFrom({0, 0, 3}));
      const float tied = w[0] + w[1] + w[2] + w[3];
      const bool identity = way.settings.similarity == Similarity::kIdentity;
      if (k > 0 && identity) {
        EXPECT_NEAR(tied, 1, 1e-5F);
      }
      for (std::size_t j = 0; j < 4; ++j) {
        // Interpolated: from samples around, none of which is at the tie.
        if (!identity || (way.settings.Sparse() && way.settings.sampling == Sampling::kInterpolated)) continue;
        EXPECT_TRUE(w[j] == 0 || std::abs(w[j] - tied / static_cast<float>(k > 0 ? std::min(k, 4) : 4)) < 1e-5F)
            << "camera " << j << ": " << w[j];
      }
      for (double step = 1e-2; step >= 1e-15; step /= 100)
        for (const Eigen::Vector2d& direction :
             {Eigen::Vector2d(1, 0.5), Eigen::Vector2d(1, 0), Eigen::Vector2d(1, 1)}) {
          const std::vector<float> near = middle(ViewFrom({step * direction.x(), step * direction.y(), 3}));
          if (k > 0 && identity && step < 1e-3) {
            EXPECT_NEAR(near[0] + near[1] + near[2] + near[3], 1, kWeightTolerance) << step;
          }
        }
    }
}

TEST_F(GlHardCase, DuplicatesShareEqually) {
  LoadPainted(Over({{0.4, 0.1, 4}, {-0.7, 0.2, 4}, {0.4, 0.1, 4}, {0.2, -0.8, 4}, {0.4, 0.1, 4}, {-1.2, -1.3, 4}}));
  for (Way way : Ways())
    for (const int k : {4, 0}) {
      way.settings.k = k;
      for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.4, 0.1, 4), Eigen::Vector3d(0.1, 0.3, 3)}) {
        const RenderView view = ViewFrom(eye);
        SCOPED_TRACE(way.name + ", k " + std::to_string(k));
        const std::vector<ImageF> pictures = WeightPictures(Request(way.settings, view));
        ExpectConvex(way.settings, pictures);
        for (int y = 0; y < 25; ++y)
          for (int x = 0; x < 33; ++x) {
            const std::vector<float> w = WeightsAt(pictures, x, y);
            ASSERT_NEAR(w[0], w[2], 1e-5F) << x << " " << y;
            ASSERT_NEAR(w[0], w[4], 1e-5F) << x << " " << y;
            if (eye.z() == 4 && way.settings.resolution == Resolution::kOff &&
                !(way.settings.similarity == Similarity::kFull)) {
              ASSERT_NEAR(w[0], 1.0F / 3, kWeightTolerance) << x << " " << y;
            }
          }
        EXPECT_LE(Disagreement(way.settings, view), 0);
      }
    }
}

// No two of them are tied but for floats. Colours tell: each lies between those of the photos.
TEST_F(GlHardCase, AThousandCamerasWithinAMillionth) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1e-6, 1e-6);
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < 1000; ++i) {
    const double x = u(random), y = u(random);
    centres.emplace_back(x, y, 4 + u(random));
  }
  World world = Over(centres);
  world.scene.cameras = {Camera::Pinhole(8, 8, 2.5, 2.5, 4, 4)};
  LoadPainted(std::move(world));
  for (const double offset : {0.0, 1e-9, 1e-6, 1e-3, 0.5})
    for (Way way : Ways())
      for (const int k : {1, 4}) {
        SCOPED_TRACE(way.name + ", k " + std::to_string(k) + ", " + Step(offset));
        if (k == 1 && way.settings.similarity == Similarity::kFull) continue;
        way.settings.k = k;
        const ImageF image = Draw(way.settings, ViewFrom({offset, 0, 3}));
        for (int y = 0; y < image.height; ++y)
          for (int x = 0; x < image.width; ++x)
            for (int c = 0; c < 3; ++c) {
              ASSERT_EQ(image.At(x, y, 3), 1);
              if (way.settings.similarity == Similarity::kFull) continue;
              ASSERT_GE(image.At(x, y, c), 64.0F / 255 - 1e-5F) << x << " " << y;
              ASSERT_LE(image.At(x, y, c), 191.0F / 255 + 1e-5F) << x << " " << y;
            }
      }
}

TEST_F(GlHardCase, LeavesDownToNoSizeAndUpToOneSize) {
  LoadPainted(Over({{0.3, 0, 4}, {-0.5, 0.2, 4}, {0.1, -0.4, 4}, {0.2, 0.6, 4}, {-1, -1, 4}, {1.4, 0.3, 4}}));
  const RenderView view = ViewFrom({0.05, 0.1, 3});
  for (Way way : Ways()) {
    way.settings.correlation = Correlation::kFallingLeaves;
    const auto sound = [&](double r_min_deg, const char* what) {
      way.settings.r_min_rad = std::min(r_min_deg * kRadPerDeg, way.settings.r_max_rad);
      ExpectSound(way, view, what + (" " + Step(r_min_deg)), 0);
    };
    for (double r_min_deg = 1; r_min_deg > 1e-18; r_min_deg /= 1000) sound(r_min_deg, "towards 0");
    sound(0, "at");
    for (double d = 1e-1; d > 1e-16; d /= 1000) sound(5 / (1 + d), "towards 5");
    sound(5, "at");
    way.settings.r_max_rad = 1e-6 * kRadPerDeg;  // smaller than any angle here
    sound(0, "all tiny");
    sound(1e-6, "all tiny");
  }
}

// Angles far beyond 2 r_max: correlations are 0 and the sum of weights would be.
TEST_F(GlHardCase, FarFromAllCamerasWeightsAreSound) {
  LoadPainted(Over({{0, 0, 4}, {0.3, 0.1, 4}, {0.1, 0.4, 4}, {-0.5, 0, 4}, {-0.2, -0.4, 4}, {0.6, -0.1, 4}}));
  for (Way way : Ways())
    for (const WeightSum sum : {WeightSum::kLocalMean, WeightSum::kRenormalise, WeightSum::kConstrained})
      for (const int k : {4, 0}) {
        if (sum != WeightSum::kLocalMean && way.settings.similarity == Similarity::kIdentity) continue;
        way.settings.correlation = Correlation::kFallingLeaves;
        way.settings.sum = sum;
        way.settings.k = k;
        for (double a = 0; a < 1.2; a += 0.1)
          ExpectSound(way, ViewFrom({3 * std::sin(a), 0.01, 3 * std::cos(a)}),
                      std::to_string(a) + " rad, " + std::string(Name(sum)), 0.01);
      }
}

// Photos that see parts of the floor: holes where none does, and only there.
TEST_F(GlHardCase, WhereNoCameraSeesThePointAlphaIsZero) {
  World world = Over({{1, 0, 3}, {-1, 0.3, 3}, {0.2, 1.2, 3}, {0.1, -1.1, 3}, {-0.5, -0.5, 3}, {0.4, 0.6, 3}});
  world.scene.cameras = {Camera::Pinhole(32, 32, 120, 120, 16, 16)};
  LoadPainted(std::move(world));
  for (const Way& way : Ways()) {
    const RenderView view = ViewFrom({0.2, 0.1, 4});
    ExpectSound(way, view, "narrow photos", way.settings.Sparse() ? 0.02 : 0);
    const ImageF image = Draw(way.settings, view);
    EXPECT_EQ(image.At(0, 0, 3), 0);
    EXPECT_EQ(image.At(16, 12, 3), 1);
    ExpectSound(way, ViewFrom({3.5, 3.5, 2}, {3.9, 3.9, 0}), "beyond", 0);
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
