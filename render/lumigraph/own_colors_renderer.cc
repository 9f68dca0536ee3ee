#include "render/lumigraph/own_colors_renderer.h"

#include <utility>

#include "render/photos/photo_correction.h"

namespace lumi {
namespace {

class OwnColorsRenderer final : public Renderer {
 public:
  explicit OwnColorsRenderer(std::unique_ptr<Renderer> renderer) : renderer_(std::move(renderer)) {}

  ImageF Render(const RenderRequest& request) override {
    ImageF picture = renderer_->Render(request);
    if (request.view.correction && request.show != Show::kFalseColor) GiveBack(*request.view.correction, picture);
    return picture;
  }
  std::string Device() const override { return renderer_->Device(); }
  RenderStatistics Statistics() const override { return renderer_->Statistics(); }

 private:
  const std::unique_ptr<Renderer> renderer_;
};

}  // namespace

std::unique_ptr<Renderer> MakeOwnColorsRenderer(std::unique_ptr<Renderer> renderer) {
  return std::make_unique<OwnColorsRenderer>(std::move(renderer));
}

}  // namespace lumi
