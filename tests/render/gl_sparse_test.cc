// SparsePlan and CandidatePlan on the graphics processor, against a rasteriser of a few lines in double, and against
// worlds whose picture is known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "render/cpu/blend.h"
#include "render/picture/convert.h"
#include "render/radiance/measures/prefilter.h"
#include "render/radiance/weights.h"
#include "tests/render/gl_test_scene.h"

namespace lumi {
namespace {

using test::ArcView;
using test::ExpectFinite;
using test::Photographed;
using test::PsnrDb;
using test::World;

// Eight bits of a texture's bilinear weights, and pixels at edges that fall either way.
constexpr double kAgreementDb = 45.0;

struct Projected {
  Eigen::Vector2d x01;  // sides of the photo 1
  double depth, edge_px;
};
Projected Project(const RelativeSources& s, std::size_t j, const Eigen::Vector3d& offset) {
  const Eigen::Vector3d q = offset - Eigen::Vector3f(s.dx[j], s.dy[j], s.dz[j]).cast<double>();
  Eigen::Matrix3d M;
  for (int i = 0; i < 9; ++i) M(i / 3, i % 3) = static_cast<double>(s.m[i][j]);
  const Eigen::Vector3d x = M * q;
  const double w = static_cast<double>(s.width_px[j]), h = static_cast<double>(s.height_px[j]), u = x.x() / x.z(),
               v = x.y() / x.z();
  return {{u / w, v / h}, x.z(), x.z() > 0 ? std::min({u, w - u, v, h - v}) : -1};
}
// What is left of a weight: f over the value at which a photo fades, at most 1.
double Gate(const RelativeSources& s, std::size_t j, const Projected& p) {
  if (p.edge_px < 0) return 0;
  if (s.dx[j] == 0 && s.dy[j] == 0 && s.dz[j] == 0) return 1;  // from its own place a photo is seen to its border
  const double f =
      std::pow(std::sin(std::numbers::pi / 2 * std::min(1.0, p.edge_px / static_cast<double>(s.feather_px[j]))), 2);
  return std::min(1.0, f / static_cast<double>(kAlphaFullAt));
}

// The mesh's own triangles, each cut into n x n, weighed at their corners. Those that reach behind the view are left
// out.
SparsePlan PlanOfMesh(const ViewSetup& setup, const Mesh& mesh, const Similarity3& normalized_from_world, int n) {
  SparsePlan plan;
  WeighScratch scratch;
  const Eigen::Matrix3d M = setup.desired.P.leftCols<3>();
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    std::array<Eigen::Vector3d, 3> corner;
    for (std::size_t i = 0; i < 3; ++i)
      corner[i] =
          normalized_from_world * mesh.vertices[static_cast<std::size_t>(mesh.faces[face][i])] - setup.desired.centre;
    const auto first_vertex = static_cast<std::int32_t>(plan.x_px.size());
    std::vector<RayWeights> weights;
    std::vector<bool> in_front;
    const auto index = [&](int i, int j) { return i * (n + 1) - i * (i - 1) / 2 + j; };
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Eigen::Vector3d x = corner[0] + (corner[1] - corner[0]) * i / n + (corner[2] - corner[0]) * j / n;
        const Eigen::Vector3d c = M * x;
        in_front.push_back(c.z() > 0.02);
        plan.x_px.push_back((c.head<2>() / c.z()).cast<float>());
        plan.offset.push_back(x.cast<float>());
        weights.push_back(Weigh({setup.sources, nullptr, setup.settings},
                                {x.normalized().cast<float>(), static_cast<float>(x.norm())}, scratch));
        plan.alpha.push_back(weights.back().alpha);
      }
    const auto add = [&](int a, int b, int c) {
      SparseTriangle t;
      const std::array<int, 3> v{a, b, c};
      t.face = static_cast<std::int32_t>(face);
      t.first = static_cast<std::int32_t>(plan.camera.size());
      t.inside = true;
      std::vector<std::array<float, 3>> of(setup.sources.dx.size(), {0, 0, 0});
      for (std::size_t i = 0; i < 3; ++i) {
        if (!in_front[static_cast<std::size_t>(v[i])]) return;
        t.vertex[i] = first_vertex + v[i];
        const RayWeights& w = weights[static_cast<std::size_t>(v[i])];
        for (std::size_t m = 0; m < static_cast<std::size_t>(w.count); ++m)
          of[static_cast<std::size_t>(w.camera[m])][i] = w.weight[m];
      }
      for (std::size_t j = 0; j < of.size(); ++j) {
        if (of[j] == std::array<float, 3>{0, 0, 0}) continue;
        plan.camera.push_back(static_cast<std::int32_t>(j));
        plan.weight.push_back(of[j]);
        for (const auto vertex : t.vertex)
          t.inside &=
              Gate(setup.sources, j,
                   Project(setup.sources, j, plan.offset[static_cast<std::size_t>(vertex)].cast<double>())) == 1;
      }
      t.count = static_cast<std::int32_t>(plan.camera.size()) - t.first;
      plan.triangles.push_back(t);
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add(index(i, j), index(i + 1, j), index(i, j + 1));
        if (i + j + 2 <= n) add(index(i + 1, j), index(i + 1, j + 1), index(i, j + 1));
      }
  }
  return plan;
}

// The plan's picture, pixel by pixel.
ImageF Picture(const SparsePlan& plan, const ViewSetup& setup, const std::vector<Photo>& photos, bool false_color) {
  const Eigen::Vector2i size = setup.desired.size_px;
  ImageF image(size.x(), size.y(), 4), nearest(size.x(), size.y(), 1);
  const Eigen::Vector3d axis = setup.desired.P.row(2).head<3>();
  const RelativeSources& s = setup.sources;
  for (const SparseTriangle& t : plan.triangles) {
    Eigen::Matrix3d of_px;  // barycentric coordinates
    Eigen::Vector3d inverse_depth;
    for (int i = 0; i < 3; ++i) {
      const auto v = static_cast<std::size_t>(t.vertex[static_cast<std::size_t>(i)]);
      of_px.col(i) << plan.x_px[v].cast<double>(), 1;
      inverse_depth[i] = 1 / axis.dot(plan.offset[v].cast<double>());
    }
    const auto corner = [&](std::size_t i) -> Eigen::Vector3d {
      return plan.offset[static_cast<std::size_t>(t.vertex[i])].cast<double>();
    };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    const Eigen::Array2d lo = of_px.topRows<2>().rowwise().minCoeff(), hi = of_px.topRows<2>().rowwise().maxCoeff();
    if (std::abs(of_px.determinant()) < 1e-6) continue;
    of_px = of_px.inverse().eval();
    for (int y = std::max(0, static_cast<int>(lo.y()) - 1); y < std::min(size.y(), static_cast<int>(hi.y()) + 2); ++y)
      for (int x = std::max(0, static_cast<int>(lo.x()) - 1); x < std::min(size.x(), static_cast<int>(hi.x()) + 2);
           ++x) {
        const Eigen::Vector3d px(x + 0.5, y + 0.5, 1), b = of_px * px;
        if (b.minCoeff() < 0) continue;
        const double inverse = inverse_depth.dot(b);
        if (inverse <= static_cast<double>(nearest.At(x, y, 0))) continue;
        nearest.At(x, y, 0) = static_cast<float>(inverse);
        const Eigen::Vector3d offset = setup.ray_from_pixel * px / inverse;
        Eigen::Array3d mean = Eigen::Array3d::Zero();
        double best = 0, kept = 0;
        for (std::int32_t e = t.first; e < t.first + t.count; ++e) {
          const auto j = static_cast<std::size_t>(plan.camera[static_cast<std::size_t>(e)]);
          const auto& w3 = plan.weight[static_cast<std::size_t>(e)];
          double w = b.dot(Eigen::Map<const Eigen::Vector3f>(w3.data()).cast<double>());
          const Projected p = Project(s, j, offset);
          const double gate = setup.settings.field_of_view ? Gate(s, j, p) : p.edge_px >= 0;
          if (w > 0) best = std::max(best, gate);
          w *= gate;
          kept += w;
          if (w <= 0) continue;
          const double facing = FacingRatio(
              normal.dot(offset - Eigen::Vector3f(s.dx[j], s.dy[j], s.dz[j]).cast<double>()), normal.dot(offset));
          const double footprint =
              Footprint(static_cast<double>(s.focal_px[j] / setup.focal_px), facing, 1 / (inverse * p.depth));
          const float level = setup.settings.prefilter ? static_cast<float>(PyramidLevel(footprint)) : 0;
          const double gain = setup.settings.exposure ? static_cast<double>(s.gain[j]) : 1.0;
          mean +=
              w * (false_color
                       ? SourceColor(static_cast<int>(j)).cast<double>().array().eval()
                       : (gain *
                          SamplePhoto(photos[j], static_cast<float>(p.x01.x()), static_cast<float>(p.x01.y()), level)
                              .cast<double>() /
                          255)
                             .eval());
        }
        Eigen::Array4d out = Eigen::Array4d::Zero();
        if (setup.settings.field_of_view && kept > 0)
          out << mean * best / kept, best;
        else if (!setup.settings.field_of_view)
          out << mean, kept;
        for (int c = 0; c < 4; ++c) image.At(x, y, c) = static_cast<float>(out[c]);
      }
  }
  return image;
}

class GlSparse : public test::GlTest {
 protected:
  SparsePlan Plan(const ViewSetup& setup, int n) const {
    return PlanOfMesh(setup, world_.proxy, lumigraph_->sources().normalized_from_world, n);
  }
};

TEST_F(GlSparse, DrawsAPlanAsItIsDefined) {
  World world = Photographed(10, 160);
  for (std::size_t i = 0; i < world.scene.views.size(); ++i)
    world.scene.views[i].gain = 1 + 0.1 * std::sin(5.0 * static_cast<double>(i));
  Load(std::move(world));
  RenderRequest base;
  base.view = ArcView(0.93, 200, 150, 210);
  struct Case {
    const char* name;
    RenderRequest request;
  };
  std::vector<Case> cases{{"k 4", base}};
  const auto vary = [&](const char* name, auto change) {
    cases.push_back({name, base});
    change(cases.back().request);
  };
  vary("k 1", [](RenderRequest& r) { r.settings.k = 1; });
  vary("k 16", [](RenderRequest& r) { r.settings.k = 16; });
  vary("no field of view", [](RenderRequest& r) { r.settings.field_of_view = false; });
  vary("wide feather", [](RenderRequest& r) { r.settings.fov_feather = 0.4; });
  vary("false colour", [](RenderRequest& r) { r.show = Show::kFalseColor; });
  vary("false colour, no field of view", [](RenderRequest& r) {
    r.show = Show::kFalseColor;
    r.settings.field_of_view = false;
  });
  vary("exposure", [](RenderRequest& r) { r.settings.exposure = true; });
  vary("from afar, pyramids", [](RenderRequest& r) { r.view = ArcView(0.5, 90, 70, 40, 1.3); });
  vary("from afar, aliased", [](RenderRequest& r) {
    r.view = ArcView(0.5, 90, 70, 40, 1.3);
    r.settings.prefilter = false;
  });
  vary("some left out",
       [](RenderRequest& r) { r.use = {true, false, false, true, true, false, true, true, false, true}; });
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const ViewSetup setup = SetupOf(c.request);
    const SparsePlan plan = Plan(setup, 12);
    const ImageF gl = Draw(c.request, plan);
    ExpectFinite(gl);
    const ImageF wanted = Picture(plan, setup, world_.photos, c.request.show == Show::kFalseColor);
    EXPECT_GT(Coverage(wanted), 0.15);
    EXPECT_NEAR(Coverage(gl), Coverage(wanted), 2e-3);
    const double psnr = PsnrDb(gl, wanted);
    EXPECT_GE(psnr, kAgreementDb);
    const auto gated =
        std::count_if(plan.triangles.begin(), plan.triangles.end(), [](const SparseTriangle& t) { return !t.inside; });
    std::printf("  %-32s %.1f dB, coverage %.3f, %zu triangles, %d gated\n", c.name, psnr, Coverage(wanted),
                plan.triangles.size(), static_cast<int>(gated));
  }
}

TEST_F(GlSparse, TheDepthBufferDecidesWhateverTheOrder) {
  Load(Photographed(6, 100));
  RenderRequest request;
  request.view = ArcView(1.1, 120, 90, 110);
  const ViewSetup setup = SetupOf(request);
  SparsePlan plan = Plan(setup, 6);
  const ImageF first = Draw(request, plan);
  std::shuffle(plan.triangles.begin(), plan.triangles.end(), std::mt19937_64(5));
  const ImageF shuffled = Draw(request, plan);
  int differ = 0;
  for (std::size_t i = 0; i < first.data.size(); ++i) differ += std::abs(first.data[i] - shuffled.data[i]) > 1e-4F;
  EXPECT_LT(differ, 40);  // where two faces meet they are equally deep
  for (const auto& [x, y] : {std::pair{60, 45}, {30, 60}, {100, 70}}) {
    const float sparse = lumigraph_->ReadDepth(*target_, x, y);
    EXPECT_GT(sparse, 0);
    lumigraph_->Begin(request, *target_);
    EXPECT_NEAR(lumigraph_->ReadDepth(*target_, x, y), sparse, 1e-4F * sparse) << x << " " << y;
    Draw(request, plan);
  }
}

TEST_F(GlSparse, AConstantWorldIsConstant) {
  World w = test::MakeWorld(8, 96);
  const std::array<std::uint8_t, 3> rgb = {37, 140, 211};
  test::Paint(w, [&](std::size_t) { return rgb; });
  Load(std::move(w));
  for (const bool field_of_view : {true, false})
    for (const RenderView& view : {ArcView(0.7, 150, 120, 140), ArcView(1.6, 60, 60, 25, 1.4)}) {
      RenderRequest request;
      request.view = view;
      request.settings.field_of_view = field_of_view;
      const ImageF image = Draw(request, Plan(SetupOf(request), 10));
      EXPECT_GT(Coverage(image), 0.02);
      for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
          for (int c = 0; c < 3; ++c)
            ASSERT_NEAR(image.At(x, y, c),
                        image.At(x, y, 3) * static_cast<float>(rgb[static_cast<std::size_t>(c)]) / 255.0F, 1e-5F)
                << x << " " << y;
    }
}

TEST_F(GlSparse, PhotosOfEverySizeAndMoreThanAUniformBlockHolds) {
  for (World& world : std::array{test::WorldOfManySizes(40), Photographed(1100, 16, 6.0)}) {
    Load(std::move(world));
    RenderRequest request;
    request.view = ArcView(1.03, 100, 80, 90);
    const ViewSetup setup = SetupOf(request);
    const SparsePlan plan = Plan(setup, 8);
    const ImageF wanted = Picture(plan, setup, world_.photos, false);
    EXPECT_GT(Coverage(wanted), 0.05);
    EXPECT_GE(PsnrDb(Draw(request, plan), wanted), kAgreementDb) << world_.scene.views.size();
  }
}

TEST_F(GlSparse, TheTessellationIsDrawnOverTheColour) {
  Load(Photographed(6, 100));
  RenderRequest request;
  request.view = ArcView(1.1, 200, 150, 180);
  const SparsePlan plan = Plan(SetupOf(request), 3);
  const ImageF color = Draw(request, plan);
  request.show = Show::kTessellation;
  const ImageF lines = Draw(request, plan);
  int same = 0, drawn = 0, once = 0;
  for (int y = 0; y < lines.height; ++y)
    for (int x = 0; x < lines.width; ++x) {
      const bool equal = lines.At(x, y, 0) == color.At(x, y, 0) && lines.At(x, y, 1) == color.At(x, y, 1);
      (equal ? same : drawn)++;
      if (!equal) {
        // White, see-through; more of it where lines cross.
        const float once_over = 0.35F * color.At(x, y, 0) + 0.65F;
        ASSERT_GE(lines.At(x, y, 0), once_over - 1e-5F);
        once += lines.At(x, y, 0) < once_over + 1e-5F;
      }
    }
  EXPECT_GT(drawn, 300);
  EXPECT_GT(once, drawn * 3 / 4);
  EXPECT_GT(same, 20000);
}

// Every cell lists all photos: the picture of a weight a pixel.
TEST_F(GlSparse, CellsWithAllPhotosGiveThePixelsPicture) {
  Load(Photographed(9, 100));
  for (const int k : {3, 0}) {
    RenderRequest request;
    request.view = ArcView(1.1, 131, 97, 120);
    request.settings.k = k;
    request.use = {true, true, false, true, true, true, true, true, true};
    lumigraph_->SetCulling(false);
    lumigraph_->Begin(request, *target_);
    lumigraph_->Blend(*target_, 0, 97);
    const ImageF wanted = lumigraph_->ReadColor(*target_, request.view.size_px);
    CandidatePlan plan;
    plan.cell_columns = 7;
    plan.cell_rows = 5;
    plan.cell_width_px = 131.0 / 7;
    plan.cell_height_px = 97.0 / 5;
    for (int cell = 0; cell <= 35; ++cell) plan.first.push_back(9 * cell);
    for (int i = 0; i < 9 * 35; ++i) plan.camera.push_back(i % 9);
    EXPECT_GE(PsnrDb(Draw(request, plan), wanted), 110) << k;  // sums in another order
    // Each cell its own: one photo, and no other pixel sees it.
    plan.first.clear();
    plan.camera.clear();
    for (int cell = 0; cell <= 35; ++cell) plan.first.push_back(cell);
    for (int cell = 0; cell < 35; ++cell) plan.camera.push_back(3 + cell % 2);
    request.show = Show::kFalseColor;
    const ImageF one = Draw(request, plan);
    int seen = 0;
    for (int y = 0; y < 97; ++y)
      for (int x = 0; x < 131; ++x) {
        if (one.At(x, y, 3) < 1) continue;
        const int cell = std::min(static_cast<int>((y + 0.5) / plan.cell_height_px), 4) * 7 +
                         std::min(static_cast<int>((x + 0.5) / plan.cell_width_px), 6);
        ASSERT_NEAR(one.At(x, y, 0), SourceColor(3 + cell % 2).x(), 1e-6F);
        ++seen;
      }
    EXPECT_GT(seen, 3000);
  }
}

}  // namespace
}  // namespace lumi
