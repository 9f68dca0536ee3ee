#include "render/per_view.h"

#include <chrono>
#include <utility>

#include "scene/program/error.h"

namespace lumi {
namespace {

class PerViewRenderer final : public Renderer {
 public:
  PerViewRenderer(const PerViewProxy& proxy, std::unique_ptr<Renderer> renderer) : proxy_(proxy), renderer_(std::move(renderer)) {}

  ImageF Render(const RenderRequest& request) override {
    const auto start = std::chrono::steady_clock::now();
    mesh_ = proxy_.For(request.view);
    renderer_->ReplaceProxy(mesh_);
    proxy_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return renderer_->Render(request);
  }
  void ReplaceProxy(const Mesh&) override {}  // each picture has its own
  std::string Device() const override { return renderer_->Device(); }
  RenderStatistics Statistics() const override {
    RenderStatistics s = renderer_->Statistics();
    s.plan_ms += proxy_ms_;
    return s;
  }

 private:
  const PerViewProxy& proxy_;
  const std::unique_ptr<Renderer> renderer_;
  Mesh mesh_;
  double proxy_ms_ = 0;
};

}  // namespace

PerViewProxy::PerViewProxy(const Scene& scene, const ViewTriangulationOptions& options)
    : options_(options), X_(StructurePoints(scene)), plane_at_infinity_(PlaneAtInfinity(scene)) {
  if (X_.empty()) throw DataError("the scene has no reliable points to triangulate in each view", "use a proxy: lumi-proxy plane makes one without points", scene.folder);
}

Mesh PerViewProxy::For(const RenderView& view) const { return MeshOf(TriangulateView(view.P, view.size_px, X_, plane_at_infinity_, options_)); }

std::unique_ptr<Renderer> MakePerViewRenderer(const PerViewProxy& proxy, std::unique_ptr<Renderer> renderer) {
  return std::make_unique<PerViewRenderer>(proxy, std::move(renderer));
}

}  // namespace lumi
