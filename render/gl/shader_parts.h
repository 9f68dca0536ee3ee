// Pieces of shader text that the shaders of this folder share.
#pragma once

#include <string>
#include <string_view>

#include "render/gl/blend_shader.h"

namespace lumi::shader {

// "#version", and how buffers are read: BUFFER, UINT_BUFFER, FETCH(buffer, i), FACE_NORMAL(pixel),
// VISIBILITY_TEXEL(map, texel). In ES 3.00 a buffer is a texture of kEsRowTexels columns, maps stand MAP_COLUMNS side
// by side (defined by the page, which knows how wide a texture may be), and the depth map has the face's normal in its
// other three channels.
enum class ShaderLanguage { kDesktop430, kEs300 };
constexpr int kEsRowTexels = 1024;
std::string Version(ShaderLanguage language);
// The core's numbers, as the text of the other parts names them.
std::string Constants();
// All of these, and what the variant switches on and off. The parts below are the same text for every variant.
std::string Defines(const BlendVariant& variant);

// The cameras and their lists: CAMERA(j, row), Atan, BucketEdge. No stage's inputs or outputs.
extern const char* const kCameras;

// The measures between a pixel's ray and a photo, and h, assembled from the records of radiance/measures/list.h: a
// function NameValue(Sight, vec4) each, pure in its arguments, and what fetches these.
std::string Measures();
// The names of a measure's uniforms: its scale (factor 2 r_max), its shape, and where its PhotoField lies in
// photo_fields (first cell, columns, rows; no columns: it has none). TermOf: what is defined where the measure counts.
std::string ScaleOf(std::string_view measure);
std::string ShapeOf(std::string_view measure);
std::string FieldOf(std::string_view measure);
std::string TermOf(std::string_view measure);

// vec3 Radiance(int j, int group, int layer, vec2 x01, float level): the colour of photo j (or of its view, in false
// colours) at a place in it (its sides 1), from its pyramid at a level, 0 for its own pixels.
std::string Photos();

// bool OpenAt(vec2 pixel), which sets the ray that the measures read, false where it misses the proxy; float Theta(vec4
// D).
std::string Rays();
// The rest of a blend shader: the candidates, the search for the k nearest, main().
std::string Blending();

}  // namespace lumi::shader
