// Builds the visibility maps of all source cameras, in parallel.
#pragma once

#include "render/radiance/visibility.h"
#include "render/world/picture_world.h"
#include "scene/geometry/mesh.h"

namespace lumi {

// False for a proxy that cannot hide a part of itself from anywhere: all its vertices in one plane.
bool CanOcclude(const Mesh& proxy);

VisibilityMaps MakeVisibilityMaps(const Sources& sources, const ProxyTracer& proxy);

// The maps of a proxy; none (width 0) where it hides nothing.
VisibilityMaps ProxyVisibility(const Sources& sources, const Mesh& proxy, const ProxyTracer& tracer);

// Cameras, and a proxy to trace rays against: for computing weights outside a renderer.
struct TracedProxy {
  TracedProxy(const Scene& scene, const Mesh& proxy);
  explicit TracedProxy(const PictureWorld& world);  // which hides nothing

  Sources sources;
  ProxyTracer tracer;
  VisibilityMaps maps;
};

}  // namespace lumi
