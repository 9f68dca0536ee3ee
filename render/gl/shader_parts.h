// Pieces of shader text that the shaders of this folder share.
#pragma once

#include <string>

#include "render/gl/blend_shader.h"

namespace lumi::shader {

// "#version" and what the variant switches on and off.
std::string Defines(const BlendVariant& variant);

// The cameras and their lists: CAMERA(j, row), Atan, BucketEdge. No stage's inputs or outputs.
extern const char* const kCameras;

// The measures between a pixel's ray and a photo, and h: the shader's side of render/radiance/measures.h.
extern const char* const kMeasures;

// vec3 Radiance(int j, int group, int layer, vec2 x01, float level): the colour of photo j (or of its view, in false
// colours) at a place in it (its sides 1), from its pyramid at a level, 0 for its own pixels.
std::string Photos(const BlendVariant& variant);

}  // namespace lumi::shader
