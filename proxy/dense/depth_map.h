// What stereo finds for a photo: at each pixel a plane, as inverse depth and its change to the next pixel. Seen from a
// camera the inverse depth of a plane is affine in the pixel, so a neighbour's plane is carried over by adding.
#pragma once

#include <cstddef>
#include <vector>

namespace lumi {

struct DepthMap {
  int width = 0, height = 0;
  std::vector<float> w;       // inverse depth at the pixel's centre, 1 / world units; 0: none
  std::vector<float> gx, gy;  // its change a pixel to the right, and down
  std::vector<float> cost;    // 1 - correlation over the sources that count, 0 (the same) .. 2

  DepthMap() = default;
  DepthMap(int width_px, int height_px) : width(width_px), height(height_px) {
    for (std::vector<float>* plane : {&w, &gx, &gy, &cost}) plane->assign(Pixels(), 0.0F);
  }
  std::size_t Pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  std::size_t Bytes() const { return 4 * sizeof(float) * Pixels(); }
};

// The same planes in another size: each pixel has the plane of the one that it lies in.
DepthMap Resized(const DepthMap& map, int width, int height);

}  // namespace lumi
