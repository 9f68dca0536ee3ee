#include <fmt/format.h>

#include "render/gl/photo_textures.h"
#include "render/gl/shader_parts.h"

namespace lumi::shader {
namespace {

constexpr const char* kFalseColors = R"(
#ifdef FALSE_COLOR
uniform BUFFER source_colors;
vec3 Radiance(int j, int group, int layer, vec2 x01, float level) {
  return FETCH(source_colors, int(FETCH(places, j).w)).rgb;
}
#else
)";

// An array of samplers may be indexed by a value that is the same for all pixels only: a case each.
constexpr const char* kTexel = R"(
uniform sampler2DArray photos[GROUPS];
vec3 Texel(int group, vec3 x, float level) {
  switch (group) {
SAMPLE_CASES
  }
  return vec3(0.0);
}
)";

// The sampler clamps to the centres of the border pixels and to the last level, and mixes levels.
constexpr const char* kWhole = R"(
#ifdef WHOLE_LAYERS
vec3 Look(int j, int group, int layer, vec2 x01, float level) { return Texel(group, vec3(x01, float(layer)), level); }
)";

// A photo in a corner of its layer: clamped here, level by level.
constexpr const char* kPart = R"(
#else
uniform ivec2 group_size[GROUPS];
vec3 SampleLevel(int group, float layer, ivec2 size0, vec2 x01, int level) {
  vec2 size = vec2(max(size0 >> level, ivec2(1)));
  vec2 texture_px = vec2(max(group_size[group] >> level, ivec2(1)));
  vec2 x = clamp(x01 * size, vec2(0.5), size - 0.5);
  return Texel(group, vec3(x / texture_px, layer), float(level));
}
vec3 Look(int j, int group, int layer, vec2 x01, float level) {
  uvec4 place = FETCH(places, j);
  ivec2 size0 = ivec2(place.x & 0xffffu, place.x >> 16);
#ifdef PREFILTER
  level = clamp(level, 0.0, float((place.y >> 8) & 0xffu));
  int l = int(level);
  vec3 c = SampleLevel(group, float(layer), size0, x01, l);
  float up = level - float(l);
  if (up > 0.0) c = mix(c, SampleLevel(group, float(layer), size0, x01, l + 1), up);
  return c;
#else
  return SampleLevel(group, float(layer), size0, x01, 0);
#endif
}
#endif
)";

constexpr const char* kRadiance = R"(
vec3 Radiance(int j, int group, int layer, vec2 x01, float level) {
  vec3 c = Look(j, group, layer, x01, level);
#ifdef EXPOSURE
  c *= CAMERA(j, 4).y;
#endif
  return c;
}
#endif
)";

}  // namespace

std::string Photos() {
  std::string texel = kTexel, cases;
  for (int g = 0; g < kMaxPhotoGroups; ++g)
    cases += fmt::format("#if GROUPS > {0}\n    case {0}: return textureLod(photos[{0}], x, level).rgb;\n#endif\n", g);
  texel.replace(texel.find("SAMPLE_CASES\n"), 13, cases);
  return kFalseColors + texel + kWhole + kPart + kRadiance;
}

}  // namespace lumi::shader
