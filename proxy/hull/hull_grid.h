// Where the hull is: a box around it, and the cubes that its surface may enter, by bounds of the silhouettes' distances
// that hold for whole cubes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "proxy/hull/agreement_ray.h"
#include "proxy/hull/contour.h"
#include "proxy/hull/silhouette_cone.h"

namespace lumi {

// The part of `start` that no more than `misses` of the silhouettes, dilated, carve; nullopt: nothing is left.
std::optional<Box> BoundHull(const std::vector<const SilhouetteCone*>& cones, const Box& start, double dilation_px,
                             int misses);

// Cubes that the surface of the dilated silhouettes' hull may enter, neighbours near each other, and for each the cones
// whose border may pass through it: all others hold the whole cube.
struct SurfaceCubes {
  std::vector<std::array<int, 3>> cubes;
  std::vector<std::vector<std::uint16_t>> cones;
};
// nullopt beyond `most` cubes; *too_many then has about how many times as many there are, above 1.
std::optional<SurfaceCubes> FindSurfaceCubes(const std::vector<const SilhouetteCone*>& cones, const GridFrame& grid,
                                             double dilation_px, std::size_t most, double* too_many = nullptr);

}  // namespace lumi
