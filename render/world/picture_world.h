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
  std::vector<std::int32_t> photos;  // the scene's view that each camera's photo is of; false colours are that view's
  Sources sources;                   // the cameras, in the world that the picture is rendered in
  std::vector<bool> use;             // one a camera, empty: all; false: it lies at or beyond the plane at infinity
  RenderView view;                   // in the same world, as
  Mesh proxy;                        // this
  bool occlusion = false;  // whether the proxy may hide a part of itself from a photo: maps are made when first wanted
};

// All of a scene's cameras over one mesh, for whatever view.
std::shared_ptr<const PictureWorld> WorldOf(const Scene& scene, const Mesh& proxy);

}  // namespace lumi
