// The proxy itself, flat-shaded by a lamp at the viewer's head (Fig. 5-14): what the photos are blended over.
#pragma once

#include "scene/geometry/mesh.h"
#include "scene/model/image.h"
#include "scene/model/scene.h"

namespace lumi {

// RGBA in [0,1], premultiplied, transparent where the proxy is missed; backs of faces are red. `desired` in world.
ImageF DrawProxy(const Scene& scene, const Mesh& proxy, const RenderView& desired);

}  // namespace lumi
