#include <fmt/format.h>

#include "render/gl/shader_parts.h"

namespace lumi::shader {
namespace {

constexpr const char* kFalseColors = R"(
uniform samplerBuffer source_colors;
vec3 Radiance(int j, vec2 x_px, float depth_ratio) { return texelFetch(source_colors, int(texelFetch(places, j).w)).rgb; }
)";

// An array of samplers may be indexed by a value that is the same for all pixels only: a case each.
constexpr const char* kPhotos = R"(
uniform float focal_px;        // of the desired camera
uniform sampler2DArray photos[GROUPS];
uniform ivec2 group_size[GROUPS];

vec3 Texel(int group, vec3 x, float level) {
  switch (group) {
SAMPLE_CASES
  }
  return vec3(0.0);
}

// Clamped to the centres of the border pixels: no colour from outside a photo.
vec3 SampleLevel(int group, float layer, ivec2 size0, vec2 x01, int level) {
  vec2 size = vec2(max(size0 >> level, ivec2(1)));
  vec2 texture_px = vec2(max(group_size[group] >> level, ivec2(1)));
  vec2 x = clamp(x01 * size, vec2(0.5), size - 0.5);
  return Texel(group, vec3(x / texture_px, layer), float(level));
}

// depth_ratio: of the point in the photo over that in the desired view.
vec3 Radiance(int j, vec2 x_px, float depth_ratio) {
  uvec4 place = texelFetch(places, j);
  ivec2 size0 = ivec2(place.x & 0xffffu, place.x >> 16);
  int group = int(place.y & 0xffu);
  vec2 x01 = x_px / vec2(CAMERA(j, 0).w, CAMERA(j, 1).w);
#ifdef PREFILTER
  float top = float((place.y >> 8) & 0xffu);
  float shift = float(place.y >> 16);
  // Photo pixels a desired pixel, along a side.
  float level = clamp(log2(max(CAMERA(j, 3).w / (depth_ratio * focal_px), 1.0)) - shift, 0.0, top);
  int l = int(level);
  vec3 c = SampleLevel(group, float(place.z), size0, x01, l);
  float up = level - float(l);
  if (up > 0.0) c = mix(c, SampleLevel(group, float(place.z), size0, x01, l + 1), up);
#else
  vec3 c = SampleLevel(group, float(place.z), size0, x01, 0);
#endif
#ifdef EXPOSURE
  c *= CAMERA(j, 4).y;
#endif
  return c;
}
)";

}  // namespace

std::string Photos(const BlendVariant& variant) {
  if (variant.false_color) return kFalseColors;
  std::string text = kPhotos, cases;
  for (int g = 0; g < variant.groups; ++g)
    cases += fmt::format("    case {0}: return textureLod(photos[{0}], x, level).rgb;\n", g);
  if (const auto at = text.find("SAMPLE_CASES"); at != std::string::npos) text.replace(at, 12, cases);
  return text;
}

}  // namespace lumi::shader
