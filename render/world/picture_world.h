// All that one picture is blended from: cameras, their photos, and a proxy, in one world.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "render/radiance/sources.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

struct PictureWorld {
  std::vector<std::int32_t> photos;  // of each camera: the scene's view whose photo and false colour it has
  Sources sources;                   // the cameras, in the world that the picture is rendered in
  std::vector<bool> use;             // one a camera, empty: all; false: it lies at or beyond the plane at infinity
  RenderView view;                   // in the same world
  Mesh proxy;                        // in the same world
  bool occlusion = false;  // whether the proxy may hide a part of itself from a photo: maps are made when first wanted
};

// All of a scene's cameras over one mesh, for whatever view.
std::shared_ptr<const PictureWorld> WorldOf(const Scene& scene, const Mesh& proxy);

}  // namespace lumi
