// The text of the shaders that draw a SparsePlan: every triangle once, with all of its photos, their weights
// interpolated linearly in the image (thesis sec. 5.1.4, where a triangle is drawn once a photo).
#pragma once

#include <cstdint>
#include <string>

#include "render/gl/blend_shader.h"

namespace lumi {

// What a triangle's pixels do at a photo's border.
enum class PhotoEnds {
  kNever,    // every photo of the triangle contains all of it
  kFeather,  // its weight fades, the others take over
  kCut,      // its part of the pixel stays empty (field of view off)
};

struct SparseVariant {
  BlendVariant blend;  // false_color, groups, whole_layers, cameras_*, exposure and prefilter count
  PhotoEnds ends = PhotoEnds::kNever;
  bool negative = false;  // weights may be negative (the optimum's)
  int layers = 0;         // photos a triangle, at most; 0: any number, looked up pixel by pixel
  auto operator<=>(const SparseVariant&) const = default;
};

// The most photos whose interpolated values the rasteriser has room for.
constexpr int kMaxLayers = 12;
// The layers of the shader that draws a triangle of `photos`: few different shaders, few unused layers.
constexpr int LayersFor(int photos) {
  for (const int n : {2, 3, 4, 5, 6, 8, 10, kMaxLayers})
    if (photos <= n) return n;
  return 0;
}

// A triangle's corner: x and y in clip units, near / depth; 1 / depth; its records. A record is a photo of a triangle:
// at each of the three corners its projection, and its weight. The projection is homogeneous (the photo's sides 1),
// relative to the depth in the view, so that it is linear in the image and the rasteriser interpolates it exactly; and
// scaled so that its third coordinate is 1 where the photo is read at level 0 of its pyramid: -1.5 times its logarithm
// is the level, exactly, as the determinant of a plane's Jacobian falls with the third power of the depth. Beside them
// where the photo is: RecordPlace.
constexpr std::uint32_t RecordPlace(int camera, int group, int layer) {
  return static_cast<std::uint32_t>(layer) | static_cast<std::uint32_t>(group) << 11 |
         static_cast<std::uint32_t>(camera) << 16;
}
constexpr int kMaxRecordCameras = 1 << 16;
std::string SparseVertexShader(const SparseVariant& variant);
std::string SparseFragmentShader(const SparseVariant& variant);

// Lines over the picture: x and y in clip units, colour.
const std::string& LineVertexShader();
const std::string& LineFragmentShader();

}  // namespace lumi
