// MakeGlRenderer: a lumigraph in graphics memory, one picture at a time.
#include <epoxy/gl.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/gl/egl_context.h"
#include "render/gl/gl_lumigraph.h"
#include "render/photos/photo_cache.h"
#include "render/world/renderer.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Its own context, current for a while.
class Context {
 public:
  explicit Context(const std::unique_ptr<EglContext>& own) {
    if (own) current_.emplace(*own);
  }

 private:
  std::optional<EglContext::Current> current_;
};

class GlRenderer final : public WorldRenderer {
 public:
  // own: make a context of its own; else use the context that is current, here and at every later call.
  GlRenderer(std::shared_ptr<const PictureWorld> world, const std::vector<Photo>& photos, PhotoSupply supply, bool own)
      : photos_(photos), supply_(std::move(supply)), context_(own ? std::make_unique<EglContext>() : nullptr) {
    const Context current(context_);
    std::vector<Eigen::Vector2i> sizes;
    for (std::size_t i = 0; i < photos.size(); ++i)
      sizes.push_back(photos[i].levels.empty() || supply_.bring
                          ? world->sources.views[i].size_px
                          : Eigen::Vector2i(photos[i].levels[0].width, photos[i].levels[0].height));
    // Moved into members only when complete: on failure, GL objects must be destroyed while the context is current.
    auto lumigraph = supply_.bring ? std::make_unique<GlLumigraph>(world->sources, sizes, supply_.graphics_bytes,
                                                                   supply_.small_halvings)
                                   : std::make_unique<GlLumigraph>(world->sources, sizes);
    // Each is in the vector of photos, or a level of the photo that is there.
    if (lumigraph->slots() != nullptr && supply_.small_halvings >= 0)
      for (std::size_t i = 0; i < photos.size(); ++i)
        lumigraph->UploadSmallCopy({static_cast<std::int32_t>(i)}, HalvedTo(photos[i], supply_.small_halvings));
    Show(std::move(world), *lumigraph);
    target_ = std::make_unique<GlTarget>();
    device_ = GlDeviceName();
    lumigraph_ = std::move(lumigraph);
  }

  ~GlRenderer() override {
    const Context current(context_);
    lumigraph_.reset();
    target_.reset();
  }

  ImageF Render(const RenderRequest& wanted) override {
    const Context current(context_);
    RenderRequest request = wanted;
    if (request.use.empty()) request.use = world_->use;
    const Eigen::Vector2i size = request.view.size_px;
    Stopwatch watch;
    const int halved = supply_.bring && request.show != Show::kFalseColor ? BringPhotos(request) : 0;
    const double bring_ms = 1000 * watch.Lap();
    lumigraph_->Begin(request, *target_);
    lumigraph_->Blend(*target_, 0, size.y());
    glFinish();
    statistics_ = lumigraph_->statistics();
    statistics_.blend_ms = 1000 * watch.Seconds() - statistics_.plan_ms;
    if (supply_.bring) {
      statistics_.bring_ms = bring_ms;
      statistics_.halved = halved;
      statistics_.photo_bytes = lumigraph_->photo_bytes();
    }
    return lumigraph_->ReadColor(*target_, size);
  }

  void Enter(std::shared_ptr<const PictureWorld> world) override {
    const Context current(context_);
    Show(std::move(world), *lumigraph_);
  }

  std::string Device() const override { return device_; }
  RenderStatistics Statistics() const override { return statistics_; }

 private:
  void Show(std::shared_ptr<const PictureWorld> world, GlLumigraph& lumigraph) {
    lumigraph.SetCameras(world->sources);
    if (world->occlusion)
      lumigraph.SetProxy(world->proxy);
    else
      lumigraph.SetProxy(world->proxy, std::make_shared<const VisibilityMaps>());
    std::vector<Eigen::Vector3f> colors;
    for (const std::int32_t view : world->photos) colors.push_back(SourceColor(view));
    lumigraph.SetSourceColors(colors);
    for (std::size_t i = 0; i < photos_.size(); ++i)
      if (!supply_.bring && (!world_ || world_->photos[i] != world->photos[i]) && !photos_[i].levels.empty())
        lumigraph.Upload({static_cast<std::int32_t>(i)}, photos_[i]);
    world_ = std::move(world);
  }

  // Returns how often photos of the picture are halved beyond what they may be, at most.
  int BringPhotos(const RenderRequest& request) {
    const std::vector<WantedPhoto> wanted = lumigraph_->PhotosWanted(request);
    const PhotoSlots* slots = lumigraph_->slots();
    if (slots == nullptr) {
      std::vector<PhotoSlots::Wish> missing;
      for (const WantedPhoto& w : wanted)
        if (!lumigraph_->Has({w.photo})) missing.push_back({w.photo, 0});
      Bring(missing);
      return 0;
    }
    lumigraph_->WantPhotos(wanted);
    for (auto missing = slots->missing(); !missing.empty(); missing = slots->missing()) Bring(missing);
    int halved = 0;
    for (const WantedPhoto& w : wanted) {
      if (const auto held = slots->held(w.photo))
        halved = std::max(halved, *held - w.halvings);
      else if (lumigraph_->Has({w.photo}))
        halved = std::max(halved, supply_.small_halvings - w.halvings);
      else
        halved = std::max(halved, kSlotSizes);  // it is left out
    }
    return halved;
  }

  // As many at a time as fit into memory.
  void Bring(const std::vector<PhotoSlots::Wish>& missing) {
    for (std::size_t from = 0; from < missing.size();) {
      std::vector<WantedPhoto> batch;
      std::size_t bytes = 0;
      for (std::size_t i = from; i < missing.size(); ++i) {
        bytes += PhotoCache::BytesOf(world_->sources.views[static_cast<std::size_t>(missing[i].photo)].size_px);
        if (!batch.empty() && bytes > supply_.at_once_bytes) break;
        batch.push_back({missing[i].photo, 0});
      }
      supply_.bring(batch);
      for (const WantedPhoto& w : batch) {
        const Photo& photo = photos_[static_cast<std::size_t>(w.photo)];
        if (lumigraph_->slots() != nullptr)
          lumigraph_->Offer({w.photo}, photo, missing[from].halvings);
        else
          lumigraph_->Upload({w.photo}, photo);
        ++from;
      }
    }
  }

  const std::vector<Photo>& photos_;
  PhotoSupply supply_;
  std::shared_ptr<const PictureWorld> world_;
  std::unique_ptr<EglContext> context_;  // before all that lives in it
  std::unique_ptr<GlLumigraph> lumigraph_;
  std::unique_ptr<GlTarget> target_;
  std::string device_;
  RenderStatistics statistics_;
};

}  // namespace

void RequireDrawnByGl(const RadianceSettings& s) {
  if (s.method != Algorithm::kUlr)
    throw UsageError("OpenGL draws this renderer's own weights only, not --method " + std::string(Name(s.method)),
                     "use --backend cpu");
  if (s.similarity == Similarity::kFull && !s.Sparse())
    throw UsageError("OpenGL draws the optimum from sparse samples only",
                     "add --grid 25x25 --sampling interpolated, or use lumi-render --backend cpu");
}

std::unique_ptr<WorldRenderer> MakeGlRenderer(std::shared_ptr<const PictureWorld> world,
                                              const std::vector<Photo>& photos, PhotoSupply supply) {
  return std::make_unique<GlRenderer>(std::move(world), photos, std::move(supply), true);
}

std::unique_ptr<WorldRenderer> MakeGlRendererHere(std::shared_ptr<const PictureWorld> world,
                                                  const std::vector<Photo>& photos, PhotoSupply supply) {
  return std::make_unique<GlRenderer>(std::move(world), photos, std::move(supply), false);
}

}  // namespace lumi
