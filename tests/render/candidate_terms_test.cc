// The candidates' kernel against the general path, which weighs each pixel on its cell's photos by weights.h.
#include <gtest/gtest.h>

#include <map>

#include "render/cpu/blend.h"
#include "render/cpu/candidate_blend.h"
#include "render/world/visibility_maps.h"
#include "sparse_test_scene.h"

namespace lumi {
namespace {

constexpr int kPhotos = 9;
constexpr int kColors = kPhotos / 3;

// Photos from distances, with focal lengths and at times of their own. What they show is not of the scene: here it need
// not be.
test::Capture UnlikePhotos(bool fine) {
  test::Capture c = test::MakeCapture(kPhotos, 64);
  if (fine) {
    c.proxy = test::Sheet(24);
    Mesh near = test::Sheet(8);  // hides a part of the other
    for (Eigen::Vector3d& x : near.vertices) x = 0.2 * x + Eigen::Vector3d(0.4, 0.1, -0.6);
    Append(c.proxy, near);
  }
  const Camera first = c.scene.cameras[0];
  for (const double focal : {0.6, 1.5})
    c.scene.cameras.push_back(Camera::Pinhole(64, 48, focal * 64, focal * 64, 32, 24));
  for (int i = 0; i < kPhotos; ++i) {
    View& v = c.scene.views[static_cast<std::size_t>(i)];
    v.camera = {i % 3};
    const Eigen::Vector3d at(0, 0, 0.5), eye = at + (0.6 + 0.2 * ((i * 4) % 5)) * (v.CentreInWorld() - at);
    v.cam_from_world = LookAt(eye, at, {0, -1, 0});
    if (i != 4) v.time_s = 0.1 * ((i * 5) % kPhotos);
  }
  UpdateFrameOfReference(c.scene);
  return c;
}

// Photos three at a time in red, green and blue: pictures whose channels are weights times alpha.
std::vector<Eigen::Vector3f> Primaries(int which) {
  std::vector<Eigen::Vector3f> colors(kPhotos, Eigen::Vector3f::Zero());
  for (int i = 0; i < 3; ++i) colors[static_cast<std::size_t>(3 * which + i)][i] = 1;
  return colors;
}

struct Pictures {
  std::array<ImageF, kColors> weights;
  ImageF color;
};

class Terms {
 public:
  explicit Terms(bool fine)
      : capture_(UnlikePhotos(fine)),
        sources_(MakeSources(capture_.scene)),
        tracer_(capture_.proxy, capture_.scene.normalized_from_world),
        sparse_proxy_(capture_.proxy, capture_.scene.normalized_from_world),
        maps_(MakeVisibilityMaps(sources_, tracer_)),
        levels_(capture_.photos) {}

  const test::Capture& capture() const { return capture_; }

  // Pixels that lie on one facet, whichever way it is rasterised: those on a border between two belong to either.
  std::vector<bool> WithinFacets(const RenderView& view) const {
    const ViewSetup setup = MakeViewSetup(sources_, view, {});
    constexpr double kLatticePx = 1.0 / 64;  // four steps of the tessellation's
    const std::array<Eigen::Vector2d, 5> shifts{{{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    std::vector<bool> within;
    for (int y = 0; y < view.size_px.y(); ++y)
      for (int x = 0; x < view.size_px.x(); ++x) {
        std::array<Eigen::Vector3f, 5> directions, normals;
        std::array<float, 5> t;
        for (std::size_t i = 0; i < 5; ++i) {
          const Eigen::Vector2d x_px = Eigen::Vector2d(x + 0.5, y + 0.5) + kLatticePx * shifts[i];
          directions[i] = (setup.ray_from_pixel * x_px.homogeneous()).normalized().cast<float>();
        }
        tracer_.Trace(setup.desired.centre.cast<float>(), directions, t, normals);
        bool same = true;
        for (std::size_t i = 1; i < 5; ++i)
          same = same && normals[i].isApprox(normals[0], 1e-4F) && std::abs(t[i] - t[0]) < 0.01F * t[0];
        within.push_back(same || !std::isfinite(t[0]));
      }
    return within;
  }

  void Render(const RenderView& view, const RadianceSettings& settings, Pictures& kernel, Pictures& general) {
    const ViewSetup setup = MakeViewSetup(sources_, view, settings);
    const VisibilityMaps* visibility = settings.visibility ? &maps_ : nullptr;
    ASSERT_TRUE(CanBlendCandidates(settings));
    CandidatePlan plan;
    PlanCandidates(setup, sparse_proxy_, tracer_, visibility, test::InTurn, plan);
    const ImageF empty(view.size_px.x(), view.size_px.y(), 4);
    kernel.weights.fill(empty);
    general.weights.fill(empty);
    kernel.color = general.color = empty;
    BlendSources blend;
    blend.photos = &levels_;
    BlendCandidates(plan, setup, tracer_, visibility, blend, kernel.color);
    blend.photos = nullptr;
    for (int i = 0; i < kColors; ++i) {
      const auto colors = Primaries(i);
      blend.colors = &colors;
      BlendCandidates(plan, setup, tracer_, visibility, blend, kernel.weights[static_cast<std::size_t>(i)]);
    }
    ViewSetup cell_setup;
    FramePlan pixels;
    WeighScratch scratch;
    for (int cell = 0; cell < plan.cell_columns * plan.cell_rows; ++cell) {
      PlanCellPixels(setup, tracer_, visibility, plan, cell, cell_setup, pixels, scratch);
      BlendColor(pixels, setup, capture_.photos, {}, general.color);
      for (int i = 0; i < kColors; ++i)
        BlendConstants(pixels, setup, Primaries(i), general.weights[static_cast<std::size_t>(i)]);
    }
  }

 private:
  const test::Capture capture_;
  const Sources sources_;
  const ProxyTracer tracer_;
  const SparseProxy sparse_proxy_;
  const VisibilityMaps maps_;
  const PhotoLevels levels_;
};

// Over the pixels that `counts` marks.
double Largest(const std::array<ImageF, kColors>& a, const std::array<ImageF, kColors>& b,
               const std::vector<bool>& counts) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t e = 0; e < a[i].data.size(); ++e) {
      const double d = std::abs(static_cast<double>(a[i].data[e]) - static_cast<double>(b[i].data[e]));
      if (counts[e / 4]) largest = d <= largest ? largest : d;  // a NaN, too
    }
  return largest;
}

double Psnr(const ImageF& a, const ImageF& b, const std::vector<bool>& counts) {
  double sum = 0, n = 0;
  for (std::size_t e = 0; e < a.data.size(); ++e)
    if (counts[e / 4]) {
      sum += std::pow(static_cast<double>(a.data[e]) - static_cast<double>(b.data[e]), 2);
      ++n;
    }
  return 10 * std::log10(n / sum);
}

RadianceSettings Settings(Resolution resolution, bool time, bool field_of_view, bool visibility) {
  RadianceSettings s = test::SparseRequest({}, 3, 9, Sampling::kCandidates).settings;
  s.alpha = 0.7;
  s.beta = 0.8;
  s.gamma = 1.3;
  s.epsilon = 0.6;
  s.resolution = resolution;
  s.resolution_low = 0.3;
  s.time = time;
  s.time_s = 0.35;
  s.field_of_view = field_of_view;
  s.visibility = visibility;
  s.prefilter = false;  // levels are chosen a cell here, a pixel there
  return s;
}

TEST(CandidateTerms, EveryCombinationWeighsAsPixelsDo) {
  constexpr double kPsnr = 60, kShows = 0.05;
  for (const bool fine : {false, true}) {
    // Of weights: floats against doubles. A facet's depth comes from its triangle's corners, floats themselves, and
    // where visibility ends it is steep in the depth: with and without terms alike. Floats; at an occluder's edge,
    // where v goes from 1/50 to 1 within a texel, a float's pixel shows ten times as much.
    // A coordinate's rounding counts over the feather: 1e-4 where a photo fades over a twentieth of its side.
    const double feather = 0.05 / RadianceSettings().fov_feather;
    const auto rounding = [&](bool visibility) { return !fine ? 5e-3 : visibility ? 1e-3 : 1e-4 * feather; };
    Terms terms(fine);
    const RenderView view = test::ViewOf(terms.capture(), {0.7, 0.3, -3});
    // A fine mesh is traced both ways.
    const std::vector<bool> counts = fine ? std::vector<bool>(64 * 48, true) : terms.WithinFacets(view);
    ASSERT_GT(std::count(counts.begin(), counts.end(), true), 64 * 48 * 9 / 10);
    for (const bool field_of_view : {true, false})
      for (const bool visibility : {false, true}) {
        std::map<std::pair<Resolution, bool>, Pictures> drawn;
        for (const Resolution resolution : {Resolution::kOff, Resolution::kDistance, Resolution::kJacobian})
          for (const bool time : {false, true}) {
            const std::string what = std::string(fine ? "fine" : "facets") + ", resolution " +
                                     std::string(Name(resolution)) + ", time " + std::to_string(time) + ", fov " +
                                     std::to_string(field_of_view) + ", visibility " + std::to_string(visibility);
            Pictures general, &kernel = drawn[{resolution, time}];
            terms.Render(view, Settings(resolution, time, field_of_view, visibility), kernel, general);
            EXPECT_LT(Largest(kernel.weights, general.weights, counts), rounding(visibility)) << what;
            EXPECT_GT(Psnr(kernel.color, general.color, counts), kPsnr) << what;
          }
        // Each term shows: a kernel without it would not have passed.
        for (auto a = drawn.begin(); a != drawn.end(); ++a)
          for (auto b = drawn.begin(); b != a; ++b)
            EXPECT_GT(Largest(a->second.weights, b->second.weights, counts), kShows);
      }
  }
}

TEST(CandidateTerms, AtAPhotosOwnCentreItLeadsOnlyWhereItsOtherTermsAreNoneToo) {
  constexpr std::size_t kOwn = 3;
  for (const bool fine : {false, true}) {
    Terms terms(fine);
    const Scene& scene = terms.capture().scene;
    const RenderView view = MakeRenderView(scene, scene.views[kOwn]);
    const std::vector<bool> counts = terms.WithinFacets(view);
    for (const Resolution resolution : {Resolution::kOff, Resolution::kDistance, Resolution::kJacobian})
      for (const bool in_time : {true, false}) {
        RadianceSettings settings = Settings(resolution, true, true, true);
        settings.time_s = *scene.views[kOwn].time_s - (in_time ? 0.0 : 0.25);
        Pictures kernel, general;
        terms.Render(view, settings, kernel, general);
        EXPECT_LT(Largest(kernel.weights, general.weights, counts), fine ? 1e-4 : 5e-3) << Name(resolution) << in_time;
        const ImageF& own = kernel.weights[kOwn / 3];
        int seen = 0, leads = 0;
        for (std::size_t i = 0; i < counts.size(); ++i) {
          if (!counts[i] || own.data[4 * i + 3] == 0) continue;
          ++seen;
          leads += own.data[4 * i + kOwn % 3] > 0.999F;
        }
        EXPECT_GT(seen, 500);
        EXPECT_EQ(leads, in_time ? seen : 0) << Name(resolution);
      }
  }
}

}  // namespace
}  // namespace lumi
