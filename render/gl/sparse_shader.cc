#include "render/gl/sparse_shader.h"

#include <fmt/format.h>

#include "render/gl/shader_parts.h"

namespace lumi {
namespace {

constexpr const char* kHead = R"(
layout(location = 0) out vec4 color;  // premultiplied
layout(location = 1) out float depth;

noperspective in vec3 corner;   // barycentric coordinates 0 and 1; alpha
flat in vec3 inverse_depth;
flat in uvec2 records;          // first, past the last
uniform usamplerBuffer layers;
)";

constexpr const char* kMain = R"(
void main() {
  vec3 p = vec3(gl_FragCoord.xy, 1.0);
  vec3 corners = max(vec3(corner.xy, 1.0 - corner.x - corner.y), vec3(0.0));
  depth = 1.0 / dot(inverse_depth, p);
  vec3 mean = vec3(0.0);
  float sum = 0.0, kept = 0.0;
  for (int i = int(records.x); i < int(records.y); ++i) {
    uvec4 r0 = texelFetch(layers, 3 * i), r1 = texelFetch(layers, 3 * i + 1), r2 = texelFetch(layers, 3 * i + 2);
    float w = dot(corners, vec3(unpackUnorm2x16(r0.w), float(r1.w & 0xffffu) / 65535.0));
    vec3 q = vec3(dot(uintBitsToFloat(r0.xyz), p), dot(uintBitsToFloat(r1.xyz), p), dot(uintBitsToFloat(r2.xyz), p));
    vec2 x = q.xy / q.z;
    int j = int(r1.w >> 16);
    sum += w;
#if defined(FEATHER) || defined(CUT)
    vec2 size_px = vec2(CAMERA(j, 0).w, CAMERA(j, 1).w);
    vec2 edge = min(x, 1.0 - x) * size_px;
    float e = min(edge.x, edge.y);
    bool inside = q.z > 0.0 && e >= 0.0;
#ifdef FEATHER
    w = inside ? w * min(1.0, FieldOfView(e, CAMERA(j, 2).w) / ALPHA_FULL_AT) : 0.0;
#else
    w = inside ? w : 0.0;
#endif
    // Outside its photo a place may be anything: nothing of it is used.
    x = inside ? x : vec2(0.5);
    kept += w;
#endif
    mean += w * Layer(j, x, q.z, r2.w);
  }
#if defined(CUT)
  color = sum > 0.0 ? vec4(mean, kept) * (corner.z / sum) : vec4(0.0);
#elif defined(FEATHER)
  // Where nothing is left but photos that end, so does the picture.
  float alpha = corner.z * min(1.0, kept / (ALPHA_FULL_AT * sum));
  color = kept > 0.0 ? vec4(mean * (alpha / kept), alpha) : vec4(0.0);
#else
  color = sum > 0.0 ? vec4(mean / sum, 1.0) * corner.z : vec4(0.0);
#endif
}
)";

// One bilinear look-up where nothing else is needed.
constexpr const char* kPlainLayer = R"(
uniform sampler2DArray photos[GROUPS];
vec3 Texel(int group, vec3 x) {
  switch (group) {
SAMPLE_CASES
  }
  return vec3(0.0);
}
vec3 Layer(int j, vec2 x01, float depth_ratio, uint place) {
  vec3 c = Texel(int(place >> 16), vec3(x01, float(place & 0xffffu)));
#ifdef EXPOSURE
  c *= CAMERA(j, 4).y;
#endif
  return c;
}
)";

constexpr const char* kAnyLayer = R"(
vec3 Layer(int j, vec2 x01, float depth_ratio, uint place) {
  return Radiance(j, x01 * vec2(CAMERA(j, 0).w, CAMERA(j, 1).w), depth_ratio);
}
)";

}  // namespace

const std::string& SparseVertexShader() {
  static const std::string text = R"(#version 430 core
layout(location = 0) in vec4 position;   // x and y in clip units, near / depth, alpha
layout(location = 1) in vec3 plane;
layout(location = 2) in uvec2 range;
uniform vec2 z_from_depth;
noperspective out vec3 corner;
flat out vec3 inverse_depth;
flat out uvec2 records;
void main() {
  int i = gl_VertexID % 3;
  gl_Position = vec4(position.xy, position.z * z_from_depth.x + z_from_depth.y, 1.0);
  corner = vec3(i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0, position.w);
  inverse_depth = plane;
  records = range;
}
)";
  return text;
}

std::string SparseFragmentShader(const SparseVariant& variant) {
  std::string text = shader::Defines(variant.blend);
  if (variant.ends == PhotoEnds::kFeather) text += "#define FEATHER\n";
  if (variant.ends == PhotoEnds::kCut) text += "#define CUT\n";
  text += shader::kCameras;
  text += kHead;
  if (variant.blend.false_color || variant.blend.prefilter || !variant.whole_layers) return text + shader::Photos(variant.blend) + kAnyLayer + kMain;
  std::string plain = kPlainLayer, cases;
  for (int g = 0; g < variant.blend.groups; ++g) cases += fmt::format("    case {0}: return textureLod(photos[{0}], x, 0.0).rgb;\n", g);
  plain.replace(plain.find("SAMPLE_CASES"), 12, cases);
  return text + plain + kMain;
}

const std::string& LineVertexShader() {
  static const std::string text = R"(#version 430 core
layout(location = 0) in vec3 position;   // x and y in clip units, near / depth
layout(location = 1) in vec3 rgb;
uniform vec2 z_from_depth;
flat out vec3 line_color;
void main() {
  gl_Position = vec4(position.xy, position.z * z_from_depth.x + z_from_depth.y, 1.0);
  line_color = rgb;
}
)";
  return text;
}

const std::string& LineFragmentShader() {
  static const std::string text = R"(#version 430 core
layout(location = 0) out vec4 color;
flat in vec3 line_color;
void main() { color = vec4(line_color, 1.0); }
)";
  return text;
}

}  // namespace lumi
