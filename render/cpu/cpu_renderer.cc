#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

#include "render/cpu/blend.h"
#include "render/cpu/candidate_blend.h"
#include "render/cpu/layers.h"
#include "render/cpu/pixels.h"
#include "render/cpu/sparse_blend.h"
#include "render/cpu/tessellation_overlay.h"
#include "render/photos/most_used.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/sparse/sparse_plan.h"
#include "render/world/photos_wanted.h"
#include "render/world/renderer.h"
#include "render/world/visibility_maps.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"

namespace lumi {

namespace {

class CpuRenderer final : public WorldRenderer {
 public:
  CpuRenderer(std::shared_ptr<const PictureWorld> world, const std::vector<Photo>& photos, PhotoSupply supply)
      : photos_(photos), bring_(std::move(supply.bring)), coarsest_(supply.coarsest) {
    Enter(std::move(world));
  }

  ImageF Render(const RenderRequest& request) override {
    const ViewSetup setup =
        MakeViewSetup(world_->sources, request.view, request.settings, request.use.empty() ? world_->use : request.use);
    const VisibilityMaps* visibility = request.settings.visibility && occlusion_ ? &Visibility() : nullptr;
    const int width = request.view.size_px.x(), height = request.view.size_px.y();
    ImageF image(width, height, 4);
    statistics_ = {};
    const RadianceSettings& settings = request.settings;
    const bool candidates = settings.Sparse() && settings.sampling == Sampling::kCandidates && settings.k > 0;
    if (candidates && !CanBlendCandidates(settings))
      RenderCells(request, setup, visibility, image);
    else if (candidates || (settings.Sparse() && settings.sampling == Sampling::kInterpolated))
      RenderSparse(request, setup, visibility, image);
    else
      RenderEveryPixel(request, setup, visibility, image);
    CheckInterrupted();
    return image;
  }

  void Enter(std::shared_ptr<const PictureWorld> world) override {
    if (world_ && world->sources.views.size() != world_->sources.views.size())
      throw std::invalid_argument("Enter: as many cameras as before are wanted");
    world_ = std::move(world);
    proxy_.emplace(world_->proxy, world_->sources.normalized_from_world);
    occlusion_ = world_->occlusion && CanOcclude(world_->proxy);
    sparse_proxy_.reset();
    visibility_ = {};
    colors_.clear();
    for (const std::int32_t view : world_->photos) colors_.push_back(SourceColor(view));
  }

  std::string Device() const override {
    const char* simd = __builtin_cpu_supports("avx512f") ? "AVX-512" : __builtin_cpu_supports("avx2") ? "AVX2" : "SSE2";
    return "CPU, " + std::to_string(ThreadCount()) + " threads, " + simd;
  }

  RenderStatistics Statistics() const override { return statistics_; }

 private:
  void RenderEveryPixel(const RenderRequest& request, const ViewSetup& setup, const VisibilityMaps* visibility,
                        ImageF& image) {
    const ViewSetup weighed = Weighed(world_->sources, setup, *proxy_);
    if (bring_ && request.show != Show::kFalseColor)
      Bring(Whole(
          CamerasOfPixels(world_->sources, weighed, *proxy_, visibility, InterruptRequested, request.view.size_px)));
    const Stopwatch watch;
    statistics_.optimum =
        RenderPixels(world_->sources, weighed, *proxy_, visibility,
                     {&photos_, request.show == Show::kFalseColor ? &colors_ : nullptr}, InterruptRequested, image);
    statistics_.blend_ms = 1000 * watch.Seconds();
  }

  // Candidates with settings that BlendCandidates does not support: each pixel weighs its cell's photos with the
  // general weights.
  void RenderCells(const RenderRequest& request, const ViewSetup& setup, const VisibilityMaps* visibility,
                   ImageF& image) {
    if (!sparse_proxy_) sparse_proxy_.emplace(world_->proxy, world_->sources.normalized_from_world);
    const std::vector<float> gains = RelativeGains(world_->sources, setup);
    Stopwatch watch;
    PlanCandidates(setup, *sparse_proxy_, *proxy_, visibility, ParallelFor, candidates_);
    statistics_.plan_ms = 1000 * watch.Lap();
    if (request.show != Show::kFalseColor) BringCandidates(setup);
    watch.Lap();
    ParallelFor(static_cast<std::size_t>(candidates_.cell_columns) * static_cast<std::size_t>(candidates_.cell_rows), 1,
                [&](std::size_t begin, std::size_t end) {
                  ViewSetup cell_setup;
                  FramePlan plan;
                  WeighScratch scratch;
                  for (std::size_t cell = begin; cell < end; ++cell) {
                    if (InterruptRequested()) return;
                    PlanCellPixels(setup, *proxy_, visibility, candidates_, static_cast<int>(cell), cell_setup, plan,
                                   scratch);
                    if (request.show == Show::kFalseColor)
                      BlendConstants(plan, setup, colors_, image);
                    else
                      BlendColor(plan, setup, photos_, gains, image, seen_);
                  }
                });
    statistics_.samples = candidates_.samples;
    statistics_.blend_ms = 1000 * watch.Seconds();
    if (request.show == Show::kTessellation)
      DrawGrid(request.settings.grid_columns, request.settings.grid_rows, candidates_.geometry.epipoles_px, image);
  }

  void RenderSparse(const RenderRequest& request, const ViewSetup& setup, const VisibilityMaps* visibility,
                    ImageF& image) {
    if (!sparse_proxy_) sparse_proxy_.emplace(world_->proxy, world_->sources.normalized_from_world);
    std::optional<PhotoLevels> levels;
    BlendSources sources;
    sources.gains = RelativeGains(world_->sources, setup);
    if (request.show == Show::kFalseColor) sources.colors = &colors_;
    const bool colors = request.show != Show::kFalseColor;
    Stopwatch watch;
    const SparseGeometry* geometry = &plan_;
    if (request.settings.sampling == Sampling::kCandidates) {
      PlanCandidates(setup, *sparse_proxy_, *proxy_, visibility, ParallelFor, candidates_);
      statistics_.plan_ms = 1000 * watch.Lap();
      if (colors) BringCandidates(setup);
      if (colors) sources.photos = &levels.emplace(photos_, seen_);
      watch.Lap();
      BlendCandidates(candidates_, setup, *proxy_, visibility, sources, image);
      geometry = &candidates_.geometry;
      statistics_.samples = candidates_.samples;
    } else {
      PlanSparse(setup, *sparse_proxy_, visibility, ParallelFor, plan_);
      statistics_.plan_ms = 1000 * watch.Lap();
      if (colors) Bring(Whole(plan_.camera));
      if (colors) sources.photos = &levels.emplace(photos_, std::span<const int>());
      watch.Lap();
      BlendSparse(plan_, setup, sources, image);
      statistics_.samples = plan_.samples;
      statistics_.optimum = plan_.optimum;
    }
    statistics_.blend_ms = 1000 * watch.Seconds();
    statistics_.triangles = static_cast<long>(geometry->triangles.size());
    if (request.show != Show::kTessellation) return;
    if (request.settings.sampling == Sampling::kCandidates)
      DrawGrid(request.settings.grid_columns, request.settings.grid_rows, geometry->epipoles_px, image);
    else
      DrawTessellation(*geometry, image);
  }

  // `cameras` may repeat; those that occur most often matter most.
  static std::vector<WantedPhoto> Whole(const std::vector<std::int32_t>& cameras) {
    std::vector<WantedPhoto> wanted;
    for (const std::int32_t c : MostUsedFirst(cameras)) wanted.push_back({c, 0});
    return wanted;
  }
  void BringCandidates(const ViewSetup& setup) {
    if (!bring_) return;
    const std::vector<WantedPhoto> wanted = PhotosWanted(candidates_, setup, *proxy_);
    seen_.assign(photos_.size(), 0);
    for (const WantedPhoto& w : wanted) seen_[static_cast<std::size_t>(w.photo)] = std::min(w.halvings, coarsest_);
    Bring(wanted);
  }
  void Bring(const std::vector<WantedPhoto>& wanted) {
    if (!bring_) return;
    const Stopwatch watch;
    statistics_.halved = bring_(wanted);
    statistics_.bring_ms = 1000 * watch.Seconds();
  }

  const VisibilityMaps& Visibility() {
    if (visibility_.empty()) visibility_ = MakeVisibilityMaps(world_->sources, *proxy_);
    return visibility_;
  }

  std::shared_ptr<const PictureWorld> world_;
  std::optional<ProxyTracer> proxy_;
  const std::vector<Photo>& photos_;
  std::function<int(std::span<const WantedPhoto>)> bring_;  // none: all photos are there
  int coarsest_;
  std::vector<int>
      seen_;  // how often each photo is halved in the picture, though it may be held larger; empty: none is
  bool occlusion_ = false;
  VisibilityMaps visibility_;  // made when first wanted
  std::vector<Eigen::Vector3f> colors_;
  std::optional<SparseProxy> sparse_proxy_;  // made when first wanted
  SparsePlan plan_;
  CandidatePlan candidates_;
  RenderStatistics statistics_;
};

}  // namespace

std::unique_ptr<WorldRenderer> MakeCpuRenderer(std::shared_ptr<const PictureWorld> world,
                                               const std::vector<Photo>& photos, PhotoSupply supply) {
  return std::make_unique<CpuRenderer>(std::move(world), photos, std::move(supply));
}

}  // namespace lumi
