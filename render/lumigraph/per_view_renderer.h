// Pictures of which each has a proxy and a world of its own.
#pragma once

#include <memory>

#include "render/world/per_view_proxy.h"
#include "render/world/renderer.h"

namespace lumi {

// Pixels that no photo of the picture's window in time sees.
struct BorderOptions {
  bool fill = false;  // if pictures have their own proxy: from photos farther away in time, at most
  int reach = 30;     // so many to either side; the caller fills remaining holes (border_fill.h)
};

// Renders each picture in its own world over its own proxy; request.view and request.use refer to the scene. There is
// no occlusion, because which photos see a surface made for another view is unknown. Photos are read when a picture
// needs them; if all have one size, no more are kept than the largest reach needs. `proxy` and its scene must outlive
// the renderer. Statistics::plan_ms includes the triangulation. `reach`: photos to either side in time that a picture
// may use; -1: all.
std::unique_ptr<Renderer> MakePerViewRenderer(const Scene& scene, const PerViewProxy& proxy, WorldRendererMaker make,
                                              int reach, const BorderOptions& border = {});

}  // namespace lumi
