// Pieces of shader text that the shaders of this folder share.
#pragma once

#include <string>
#include <string_view>

#include "render/gl/blend_shader.h"

namespace lumi::shader {

// "#version" and what the variant switches on and off.
std::string Defines(const BlendVariant& variant);

// The cameras and their lists: CAMERA(j, row), Atan, BucketEdge. No stage's inputs or outputs.
extern const char* const kCameras;

// The measures between a pixel's ray and a photo, and h, assembled from the records of radiance/measures/list.h: a
// function NameValue(Sight, vec4) each, pure in its arguments, and what fetches these.
std::string Measures(const BlendVariant& variant);
// The names of a measure's uniforms: its scale (factor 2 r_max), its shape, and where its PhotoField lies in
// photo_fields (first cell, columns, rows; no columns: it has none).
std::string ScaleOf(std::string_view measure);
std::string ShapeOf(std::string_view measure);
std::string FieldOf(std::string_view measure);

// vec3 Radiance(int j, int group, int layer, vec2 x01, float level): the colour of photo j (or of its view, in false
// colours) at a place in it (its sides 1), from its pyramid at a level, 0 for its own pixels.
std::string Photos(const BlendVariant& variant);

}  // namespace lumi::shader
