// What each photo sees of the proxy: a small depth map a source camera, so that a photo whose view of a point is
// blocked by another part of the proxy ranks after those that see it. Feathered in space and depth: every gate of the
// weights is continuous.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "render/radiance/measures/visibility.h"
#include "render/radiance/proxy_tracer.h"
#include "render/radiance/sources.h"

namespace lumi {

class VisibilityMaps {
 public:
  VisibilityMaps() = default;  // empty: everything is visible
  // All maps have one size; photos of another aspect are stretched over it. Not filled yet.
  VisibilityMaps(int count, int width, int height);

  // The longer side of maps for `count` cameras: 128, less where that took over 256 MB. A texel is the width of an
  // edge's feather: a finer map would be truer to the proxy than the proxy is to the scene, and steeper.
  static int SuggestedSide(int count);

  // Fills camera j's map (thread-safe for distinct j): depth along the optical axis in normalised units, +infinity
  // where there is no proxy. The map is not dilated at silhouettes: a photo would then count as blocked beside each
  // silhouette that it shows itself.
  void Fill(int camera, const RenderView& view, const ProxyTracer& proxy);

  bool empty() const { return count_ == 0; }
  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t bytes() const { return depth_.size() * sizeof(float); }
  std::span<const float> Map(int camera) const {
    return {depth_.data() + static_cast<std::size_t>(camera) * texels(), texels()};
  }

  // In [kBlockedVisibility, 1] for a point at this pixel (of a photo width_px x height_px) and depth.
  // In double where u_px and v_px are known that well: at an occluder's edge a float's pixel shows in the weights.
  float Visibility(int camera, float u_px, float v_px, float width_px, float height_px, float depth) const;
  double Visibility(int camera, double u_px, double v_px, double width_px, double height_px, double depth) const;

 private:
  template <typename T>
  T VisibilityAs(int camera, T u_px, T v_px, T width_px, T height_px, T depth) const;
  std::size_t texels() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }
  int count_ = 0, width_ = 0, height_ = 0;
  std::vector<float> depth_;
};

}  // namespace lumi
