// The pixels of a view that at least two photos see: where the pixel's ray meets the proxy, that point lies in the
// fields of view of two of the photos in use, and the proxy hides it from neither. A picture blended from photos can be
// right there; elsewhere it shows one photo's word or a hole. What is seen depends on the proxy and the photos in use,
// and on no setting.
#pragma once

#include <cstdint>
#include <vector>

#include "render/radiance/proxy_tracer.h"
#include "render/world/picture_world.h"
#include "scene/model/image.h"

namespace lumi {

class SeenPixels {
 public:
  // Where the world says that its proxy hides nothing, fields of view alone count.
  explicit SeenPixels(const PictureWorld& world);

  // One channel of the view's size: 255 where two photos see the point, else 0. `view` is in the world's own frame, as
  // in RenderRequest; `use` has one entry a view of the scene (empty: all). A point is hidden from a photo where the
  // photo's own ray meets the proxy before it by more than visibility's feather to its middle (4 % of the depth): the
  // renderer then counts that photo as more blocked than not. Parallel; throws Interrupted.
  Image8 Mask(const RenderView& view, const std::vector<bool>& use) const;

 private:
  struct Rays;
  void MaskRow(const RenderView& normalized, const std::vector<std::int32_t>& cameras, int y, Rays& rays,
               Image8& mask) const;

  Sources sources_;
  std::vector<std::int32_t> photos_;  // of the scene, a camera
  std::vector<bool> use_;             // cameras that the world has at all; empty: every one
  bool occlusion_;
  ProxyTracer tracer_;
};

// In [0, 1]: pixels of the mask that are set.
double ShareOf(const Image8& mask);

}  // namespace lumi
