// The proxy itself, flat-shaded by a lamp at the viewer's head (Fig. 5-14): what the photos are blended over.
#pragma once

#include "render/radiance/sources.h"
#include "scene/geometry/mesh.h"
#include "scene/model/image.h"

namespace lumi {

// RGBA in [0,1], premultiplied, transparent where the proxy is missed; backs of faces are red. `desired` in world.
ImageF DrawProxy(const Sources& sources, const Mesh& proxy, const RenderView& desired);

}  // namespace lumi
