// Pictures of photos' own views as these photos show colours: with their white balance and their lens's vignetting,
// where these were taken out of the photos that were blended.
#pragma once

#include <memory>

#include "render/world/renderer.h"

namespace lumi {

// Gives the pictures of `renderer` what RenderView::correction says; those of views without one stay as they are.
std::unique_ptr<Renderer> MakeOwnColorsRenderer(std::unique_ptr<Renderer> renderer);

}  // namespace lumi
