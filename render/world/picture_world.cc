#include "render/world/picture_world.h"

#include <numeric>

namespace lumi {

std::shared_ptr<const PictureWorld> WorldOf(const Scene& scene, const Mesh& proxy) {
  auto world = std::make_shared<PictureWorld>();
  world->photos.resize(scene.views.size());
  std::iota(world->photos.begin(), world->photos.end(), 0);
  world->sources = MakeSources(scene);
  world->proxy = proxy;
  world->occlusion = true;
  return world;
}

}  // namespace lumi
