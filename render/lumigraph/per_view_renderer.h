// Pictures of which each has a proxy and a world of its own.
#pragma once

#include <memory>

#include "render/world/per_view_proxy.h"
#include "render/world/renderer.h"

namespace lumi {

// Pixels that no photo of the picture's window in time sees.
struct BorderOptions {
  bool fill = false;  // where pictures have a proxy of their own: from photos farther away in time, as far as
  int reach = 30;     // so many to either side. What is a hole then, whoever shows the picture fills (border_fill.h)
};

// Renders each picture in its own world from its own proxy, request.view and request.use being the scene's; nothing
// hides anything: what a photo sees of a surface that was made for another view is not known. Photos are read when a
// picture wants them; where all are of one size, no more are kept than the largest reach has. `proxy` and its scene
// must outlive it. Statistics::plan_ms has the triangulation in it. `reach`: photos to either side in time that a
// picture may use; -1: all.
std::unique_ptr<Renderer> MakePerViewRenderer(const Scene& scene, const PerViewProxy& proxy, WorldRendererMaker make,
                                              int reach, const BorderOptions& border = {});

}  // namespace lumi
