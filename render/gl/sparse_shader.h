// The text of the shaders that draw a SparsePlan: every triangle once, with all of its photos, their weights interpolated
// linearly in the image (thesis sec. 5.1.4, where a triangle is drawn once a photo).
#pragma once

#include <string>

#include "render/gl/blend_shader.h"

namespace lumi {

// What a triangle's pixels do with a photo that ends.
enum class PhotoEnds {
  kNever,    // every photo of the triangle contains all of it
  kFeather,  // its weight fades, the others take over
  kCut,      // its part of the pixel stays empty (field of view off)
};

struct SparseVariant {
  BlendVariant blend;       // false_color, groups, cameras_*, exposure and prefilter count
  PhotoEnds ends = PhotoEnds::kNever;
  bool whole_layers = false;  // every photo fills its texture: its edge is clamped by the sampler
  auto operator<=>(const SparseVariant&) const = default;
};

// A triangle's corners: x and y in clip units, near / depth; alpha; the triangle's plane as inverse depth over pixels; its
// records. A record is a photo of a triangle, three uvec4: the rows of the homography from pixels to the photo (its sides
// 1; the third: depth in the photo over depth in the view) as floats, and in the fourth places weights 0 and 1, weight 2
// and camera << 16, layer and group << 16.
const std::string& SparseVertexShader();
std::string SparseFragmentShader(const SparseVariant& variant);

// Lines over the picture: x and y in clip units, near / depth, colour.
const std::string& LineVertexShader();
const std::string& LineFragmentShader();

}  // namespace lumi
