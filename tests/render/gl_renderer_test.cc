// The GL backend against the CPU backend, and against worlds whose picture is known.
#include <gtest/gtest.h>

#include <cmath>

#include "render/picture/convert.h"
#include "render/world/renderer.h"
#include "scene/program/error.h"
#include "tests/render/gl_test_scene.h"
#include "tests/render/oblique_floor.h"

namespace lumi {
namespace {

using test::ArcView;
using test::ExpectFinite;
using test::MakeWorld;
using test::Photographed;
using test::PsnrDb;
using test::World;

// Eight bits of a texture's bilinear weights, and pixels at the proxy's silhouettes that fall either way.
constexpr double kAgreementDb = 45.0;

std::unique_ptr<Renderer> GlOrNull(const World& w, std::string& why) {
  try {
    return MakeGlRenderer(WorldOf(w.scene, w.proxy), w.photos);
  } catch (const MachineError& e) {
    why = e.what();
    return nullptr;
  }
}

#define MAKE_GL_OR_SKIP(name, world)                                  \
  std::string name##_why;                                             \
  const std::unique_ptr<Renderer> name = GlOrNull(world, name##_why); \
  if (!name) GTEST_SKIP() << "OpenGL 4.3 is not available: " << name##_why

TEST(GlRenderer, AgreesWithTheCpu) {
  const World w = Photographed(10, 160);
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  struct Case {
    const char* name;
    RenderView view;
    int k;
    double gamma;
    Show show;
    bool prefilter;
  };
  const RenderView between = ArcView(0.93, 200, 150, 210);
  for (const Case& c :
       {Case{"k 4", between, 4, 1, Show::kColor, true}, Case{"k 1", between, 1, 1, Show::kColor, true},
        Case{"k 16, more than there are", between, 16, 1, Show::kColor, true},
        Case{"all", between, 0, 1, Show::kColor, true}, Case{"no field of view", between, 4, 0, Show::kColor, true},
        Case{"false colour", between, 4, 1, Show::kFalseColor, true},
        Case{"false colour, all", between, 0, 1, Show::kFalseColor, true},
        Case{"from afar, pyramids", ArcView(0.5, 90, 70, 40, 1.3), 4, 1, Show::kColor, true},
        Case{"from afar, aliased", ArcView(0.5, 90, 70, 40, 1.3), 4, 1, Show::kColor, false},
        Case{"near", ArcView(1.4, 160, 160, 150, 0.4), 4, 1, Show::kColor, true},
        Case{"from behind", ArcView(4.6, 160, 120, 100), 4, 1, Show::kColor, true}}) {
    SCOPED_TRACE(c.name);
    RenderRequest request;
    request.view = c.view;
    request.settings.k = c.k;
    request.settings.gamma = c.gamma;
    request.settings.prefilter = c.prefilter;
    request.show = c.show;
    const ImageF a = gl->Render(request), b = cpu->Render(request);
    ExpectFinite(a);
    EXPECT_GT(Coverage(b), 0.2);
    const double psnr = PsnrDb(a, b);
    EXPECT_GE(psnr, kAgreementDb);
    RecordProperty(c.name, std::to_string(psnr));
    std::printf("  %-28s %.1f dB, coverage %.3f\n", c.name, psnr, Coverage(b));
  }
}

// A plane that the view sees obliquely and the photos do not: the pyramid's level is another than the depths' ratio
// says.
TEST(GlRenderer, PrefiltersAnObliquePlaneAsTheCpuDoes) {
  const test::ObliqueFloor f;
  const World w{f.c.scene, f.c.proxy, f.c.photos};
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  RenderRequest request;
  request.view = f.view;
  request.settings.prefilter = false;
  const ImageF aliased = cpu->Render(request);
  request.settings.prefilter = true;
  for (const char* way : {"pixels", "interpolated", "candidates"}) {
    if (way != std::string("pixels")) request.settings.grid_columns = request.settings.grid_rows = 17;
    request.settings.sampling = way == std::string("candidates") ? Sampling::kCandidates : Sampling::kInterpolated;
    const ImageF a = gl->Render(request), b = cpu->Render(request);
    std::printf("  %-28s %.1f dB; without a pyramid %.1f dB\n", way, PsnrDb(a, b), PsnrDb(aliased, b));
    // Between a level a pixel (GL) and one that is linear over a cell (CPU, sparse).
    EXPECT_GE(PsnrDb(a, b), 40) << way;
    EXPECT_LT(PsnrDb(aliased, b), 30) << way << ": nothing was to be prefiltered";
  }
}

// What photos of another exposure show is brought to the view's: in a constant world nothing is left of them.
TEST(GlRenderer, ExposureIsTakenOut) {
  World w = MakeWorld(8, 96);
  for (std::size_t i = 0; i < w.scene.views.size(); ++i) w.scene.views[i].gain = i % 2 == 0 ? 0.5 : 1.25;
  test::Paint(w, [&](std::size_t i) {
    const auto grey = static_cast<std::uint8_t>(std::lround(120 * w.scene.views[i].gain));
    return std::array<std::uint8_t, 3>{grey, grey, grey};
  });
  MAKE_GL_OR_SKIP(gl, w);
  RenderRequest request;
  request.view = ArcView(0.7, 150, 120, 140);
  request.view.gain = 0.8;
  request.settings.exposure = true;
  for (const bool sparse : {false, true}) {
    request.settings.grid_columns = request.settings.grid_rows = sparse ? 9 : 0;
    request.settings.sampling = Sampling::kInterpolated;
    const ImageF image = gl->Render(request);
    EXPECT_GT(Coverage(image), 0.5);
    for (std::size_t i = 0; i < image.data.size(); i += 4)
      ASSERT_NEAR(image.data[i], image.data[i + 3] * 120.0F * 0.8F / 255.0F, 1e-5F);
  }
}

TEST(GlRenderer, SaysWhatASparseFrameTook) {
  const World w = Photographed(6, 80);
  MAKE_GL_OR_SKIP(gl, w);
  RenderRequest request;
  request.view = ArcView(0.7, 100, 80, 90);
  gl->Render(request);
  EXPECT_EQ(gl->Statistics().samples, 0);
  EXPECT_GT(gl->Statistics().blend_ms, 0);
  request.settings.grid_columns = request.settings.grid_rows = 9;
  for (const Sampling sampling : {Sampling::kInterpolated, Sampling::kCandidates}) {
    request.settings.sampling = sampling;
    gl->Render(request);
    EXPECT_GE(gl->Statistics().samples, 81);
    EXPECT_GT(gl->Statistics().plan_ms, 0);
    EXPECT_EQ(gl->Statistics().triangles > 0, sampling == Sampling::kInterpolated);
  }
}

// Every effect, at every pixel and from sparse samples.
TEST(GlRenderer, EveryEffectAgreesWithTheCpu) {
  World w = MakeWorld();
  for (std::size_t i = 0; i < w.scene.views.size(); ++i) {
    w.scene.views[i].gain = 1 + 0.2 * std::sin(5.0 * static_cast<double>(i));
    w.scene.views[i].time_s = 0.1 * static_cast<double>(i);
  }
  test::Photograph(w);
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  RenderRequest base;
  base.view = ArcView(0.93, 200, 150, 210);
  RenderRequest sparse = base;
  sparse.settings.grid_columns = 13;
  sparse.settings.grid_rows = 11;
  sparse.settings.sampling = Sampling::kInterpolated;
  RenderRequest cells = sparse;
  cells.settings.sampling = Sampling::kCandidates;
  for (const auto& [name, request] : {std::pair{"pixels", base}, {"sparse", sparse}, {"cells", cells}}) {
    struct Case {
      std::string name;
      RenderRequest request;
    };
    std::vector<Case> cases;
    const auto add = [&](const char* what, auto change) {
      cases.push_back({std::string(name) + ", " + what, request});
      change(cases.back().request);
    };
    add("as it is", [](RenderRequest&) {});
    add("false colour", [](RenderRequest& r) { r.show = Show::kFalseColor; });
    add("no field of view", [](RenderRequest& r) { r.settings.field_of_view = false; });
    add("exposure", [](RenderRequest& r) { r.settings.exposure = true; });
    add("only the angle, weakly", [](RenderRequest& r) {
      r.settings.alpha = 0.3;
      r.settings.gamma = 0;
    });
    add("no visibility", [](RenderRequest& r) { r.settings.visibility = false; });
    add("resolution by distance", [](RenderRequest& r) { r.settings.resolution = Resolution::kDistance; });
    add("resolution by Jacobian", [](RenderRequest& r) { r.settings.resolution = Resolution::kJacobian; });
    add("time", [](RenderRequest& r) {
      r.settings.time = true;
      r.settings.time_s = 0.33;
    });
    add("falling leaves", [](RenderRequest& r) { r.settings.correlation = Correlation::kFallingLeaves; });
    add("no prefilter, from afar", [](RenderRequest& r) {
      r.settings.prefilter = false;
      r.view = ArcView(0.5, 90, 70, 40, 1.3);
    });
    add("from afar", [](RenderRequest& r) { r.view = ArcView(0.5, 90, 70, 40, 1.3); });
    add("a photo's own view", [&](RenderRequest& r) { r.view = MakeRenderView(w.scene, w.scene.views[3]); });
    if (request.settings.sampling == Sampling::kInterpolated && request.settings.Sparse()) {
      const auto optimum = [](RenderRequest& r) {
        r.settings.similarity = Similarity::kFull;
        r.settings.correlation = Correlation::kFallingLeaves;
      };
      // Smooth leaves and a division by the sum: much of it is taken away by negative weights.
      const auto negative = [optimum](RenderRequest& r) {
        optimum(r);
        r.show = Show::kFalseColor;  // photos differ
        r.settings.k = 0;
        r.settings.sum = WeightSum::kRenormalise;
        r.settings.r_min_rad = 6 * kRadPerDeg;
        r.settings.r_max_rad = 15 * kRadPerDeg;
      };
      add("the optimum", optimum);
      add("negative weights", negative);
      add("negative weights, no field of view", [negative](RenderRequest& r) {
        negative(r);
        r.settings.field_of_view = false;
      });
    }
    for (const Case& c : cases) {
      SCOPED_TRACE(c.name);
      const ImageF a = gl->Render(c.request), b = cpu->Render(c.request);
      for (const float v : a.data) ASSERT_TRUE(std::isfinite(v));
      EXPECT_GT(Coverage(b), 0.2);
      const double psnr = PsnrDb(a, b);
      EXPECT_GE(psnr, kAgreementDb);
      std::printf("  %-36s %.1f dB, coverage %.3f\n", c.name.c_str(), psnr, Coverage(b));
    }
  }
  base.settings.similarity = Similarity::kFull;
  base.settings.correlation = Correlation::kFallingLeaves;
  EXPECT_THROW(gl->Render(base), UsageError);
}

// A proxy of many small triangles is sampled at its vertices.
TEST(GlRenderer, AFineProxyAgreesWithTheCpu) {
  World w = Photographed(8, 120);
  constexpr int kSide = 30;
  w.proxy = {};
  for (int y = 0; y <= kSide; ++y)
    for (int x = 0; x <= kSide; ++x) {
      const double u = 6.0 * x / kSide - 3, v = 6.0 * y / kSide - 3;
      w.proxy.vertices.emplace_back(u, v, 0.4 * std::sin(2 * u) * std::cos(3 * v));
    }
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const int a = y * (kSide + 1) + x;
      w.proxy.faces.push_back({a, a + 1, a + kSide + 1});
      w.proxy.faces.push_back({a + 1, a + kSide + 2, a + kSide + 1});
    }
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  for (const auto& [samples, sampling] :
       {std::pair{0, Sampling::kCandidates}, {11, Sampling::kInterpolated}, {11, Sampling::kCandidates}}) {
    RenderRequest request;
    request.view = ArcView(0.93, 160, 120, 160);
    request.settings.grid_columns = request.settings.grid_rows = samples;
    request.settings.sampling = sampling;
    const double psnr = PsnrDb(gl->Render(request), cpu->Render(request));
    EXPECT_GE(psnr, kAgreementDb) << samples << " samples, " << Name(sampling);
    std::printf("  %d samples, %s: %.1f dB\n", samples, std::string(Name(sampling)).c_str(), psnr);
  }
}

TEST(GlRenderer, LeavesOutViewsThatAreNotUsed) {
  const World w = Photographed(6, 120);
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  RenderRequest request;
  request.view = ArcView(0.9, 120, 90, 120);
  request.use = {true, false, false, true, true, false};
  EXPECT_GE(PsnrDb(gl->Render(request), cpu->Render(request)), kAgreementDb);
  request.use.assign(6, false);
  EXPECT_EQ(Coverage(gl->Render(request)), 0);
}

TEST(GlRenderer, AConstantWorldRendersConstant) {
  World w = MakeWorld(8, 96);
  const std::array<std::uint8_t, 3> rgb = {37, 140, 211};
  test::Paint(w, [&](std::size_t) { return rgb; });
  MAKE_GL_OR_SKIP(gl, w);
  for (const int k : {1, 4, 0})
    for (const RenderView& view : {ArcView(0.7, 150, 120, 140), ArcView(1.6, 60, 60, 25, 1.4)}) {
      RenderRequest request;
      request.view = view;
      request.settings.k = k;
      const ImageF image = gl->Render(request);
      ExpectFinite(image);
      EXPECT_GT(Coverage(image), 0.1);
      constexpr float kTolerance = 1e-5F;  // sums of a few floats, normalised by their own sum
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(image.At(x, y, c),
                        image.At(x, y, 3) * static_cast<float>(rgb[static_cast<std::size_t>(c)]) / 255.0F, kTolerance)
                << x << " " << y;
    }
}

TEST(GlRenderer, ASourceViewGivesItsPhotoBack) {
  const World w = Photographed(10, 160);
  MAKE_GL_OR_SKIP(gl, w);
  for (const auto& [samples, sampling] :
       {std::pair{0, Sampling::kCandidates}, {11, Sampling::kInterpolated}, {11, Sampling::kCandidates}})
    for (std::size_t j = 0; j < w.scene.views.size(); ++j) {
      SCOPED_TRACE(std::to_string(samples) + " samples, " + std::string(Name(sampling)) + ", view " +
                   std::to_string(j));
      RenderRequest request;
      request.view = MakeRenderView(w.scene, w.scene.views[j]);
      request.settings.grid_columns = request.settings.grid_rows = samples;
      request.settings.sampling = sampling;
      const ImageF image = gl->Render(request);
      const Image8& photo = w.photos[j].levels[0];
      double sum = 0;
      int n = 0;
      for (int y = 0; y < photo.height; ++y)
        for (int x = 0; x < photo.width; ++x) {
          // A pixel that sees the floor's far edge or past it is no test.
          if (image.At(x, y, 3) == 0) continue;
          ASSERT_EQ(image.At(x, y, 3), 1.0F) << x << " " << y;  // to the photo's very border
          for (int c = 0; c < 3; ++c)
            sum += std::abs(255.0 * static_cast<double>(image.At(x, y, c)) - photo.At(x, y, c));
          n += 3;
        }
      EXPECT_GT(n, photo.width * photo.height);
      // Every pixel is the photo's own: far below one code value. A sample on the photo's very border may round to
      // outside it, and lends the border's cells other photos.
      EXPECT_LT(sum / n, samples > 0 && sampling == Sampling::kInterpolated ? 0.5 : 0.05);
    }
}

TEST(GlRenderer, MoreCamerasThanAUniformBlockHolds) {
  const World w = Photographed(1100, 16, 6.0);
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  RenderRequest request;
  request.view = ArcView(2.3331, 48, 40, 50);
  EXPECT_GE(PsnrDb(gl->Render(request), cpu->Render(request)), kAgreementDb);
}

TEST(GlRenderer, PhotosOfEverySizeShareTheTextures) {
  const World w = test::WorldOfManySizes(40);  // more than there are texture units
  MAKE_GL_OR_SKIP(gl, w);
  const auto cpu = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  RenderRequest request;
  request.view = ArcView(1.03, 120, 100, 110);
  EXPECT_GE(PsnrDb(gl->Render(request), cpu->Render(request)), kAgreementDb);
}

TEST(GlRenderer, PicturesOfDifferentSizesFollowEachOther) {
  const World w = Photographed(5, 80);
  MAKE_GL_OR_SKIP(gl, w);
  RenderRequest request;
  request.view = ArcView(1.1, 100, 80, 90);
  const ImageF first = gl->Render(request);
  RenderRequest other = request;
  other.view = ArcView(0.2, 180, 30, 60);
  EXPECT_EQ(gl->Render(other).width, 180);
  EXPECT_EQ(gl->Render(request).data, first.data);
}

}  // namespace
}  // namespace lumi
