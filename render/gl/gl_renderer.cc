// MakeGlRenderer: the whole lumigraph in graphics memory, one picture at a time.
#include <epoxy/gl.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "render/gl/egl_context.h"
#include "render/gl/gl_lumigraph.h"
#include "render/world/renderer.h"
#include "scene/program/error.h"

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

class GlRenderer final : public Renderer {
 public:
  // own: a context of its own; else whatever is current, here and whenever it is called.
  GlRenderer(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos, bool own)
      : photos_(photos), context_(own ? std::make_unique<EglContext>() : nullptr) {
    const Context current(context_);
    std::vector<Eigen::Vector2i> sizes;
    // What is not there yet may come (PhotoReplaced).
    for (std::size_t i = 0; i < photos.size(); ++i)
      sizes.push_back(photos[i].levels.empty() ? SizePx(scene, scene.views[i]) : Eigen::Vector2i(photos[i].levels[0].width, photos[i].levels[0].height));
    // Into members only when complete: what goes on failure goes while the context is current.
    auto lumigraph = std::make_unique<GlLumigraph>(scene, sizes);
    lumigraph->SetProxy(proxy);
    for (std::size_t i = 0; i < photos.size(); ++i)
      if (!photos[i].levels.empty()) lumigraph->Upload({static_cast<int>(i)}, photos[i]);
    target_ = std::make_unique<GlTarget>();
    device_ = GlDeviceName();
    lumigraph_ = std::move(lumigraph);
  }

  ~GlRenderer() override {
    const Context current(context_);
    lumigraph_.reset();
    target_.reset();
  }

  ImageF Render(const RenderRequest& request) override {
    const Context current(context_);
    const Eigen::Vector2i size = request.view.size_px;
    const auto start = std::chrono::steady_clock::now();
    lumigraph_->Begin(request, *target_);
    lumigraph_->Blend(*target_, 0, size.y());
    glFinish();
    statistics_ = lumigraph_->statistics();
    statistics_.blend_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count() - statistics_.plan_ms;
    return lumigraph_->ReadColor(*target_, size);
  }

  void ReplaceProxy(const Mesh& proxy) override {
    const Context current(context_);
    lumigraph_->SetProxy(proxy, std::make_shared<const VisibilityMaps>());
  }

  void ReplaceCameras(const Sources& cameras) override { lumigraph_->SetCameras(cameras); }

  void PhotoReplaced(ViewId place, int color) override {
    const Context current(context_);
    const auto i = static_cast<std::size_t>(place.value);
    if (colors_.empty())
      for (std::size_t j = 0; j < photos_.size(); ++j) colors_.push_back(SourceColor(static_cast<int>(j)));
    colors_.at(i) = SourceColor(color);
    lumigraph_->SetSourceColors(colors_);
    if (!photos_[i].levels.empty()) lumigraph_->Upload(place, photos_[i]);
  }

  std::string Device() const override { return device_; }
  RenderStatistics Statistics() const override { return statistics_; }

 private:
  const std::vector<Photo>& photos_;
  std::vector<Eigen::Vector3f> colors_;  // empty: each place's own
  std::unique_ptr<EglContext> context_;  // before all that lives in it
  std::unique_ptr<GlLumigraph> lumigraph_;
  std::unique_ptr<GlTarget> target_;
  std::string device_;
  RenderStatistics statistics_;
};

}  // namespace

void RequireDrawnByGl(const RadianceSettings& s) {
  if (s.similarity == Similarity::kFull && !s.Sparse())
    throw UsageError("OpenGL draws the optimum from sparse samples only", "add --grid 25x25 --sampling interpolated, or use lumi-render --backend cpu");
}

std::unique_ptr<Renderer> MakeGlRenderer(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos) {
  return std::make_unique<GlRenderer>(scene, proxy, photos, true);
}

std::unique_ptr<Renderer> MakeGlRendererHere(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos) {
  return std::make_unique<GlRenderer>(scene, proxy, photos, false);
}

}  // namespace lumi
