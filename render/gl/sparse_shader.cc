#include "render/gl/sparse_shader.h"

#include <fmt/format.h>

#include "render/gl/shader_parts.h"

namespace lumi {
namespace {

constexpr const char* kHead = R"(
layout(location = 0) out vec4 color;  // premultiplied
layout(location = 1) out float depth;
)";

constexpr const char* kAdd = R"(
vec3 mean = vec3(0.0);
float sum = 0.0, kept = 0.0;  // of the weights, of what is left of them

// q: the photo's projection and weight.
void Add(vec4 q, uint place) {
  float w = max(q.w, 0.0);
  vec2 x = q.xy / q.z;
  sum += w;
#if defined(FEATHER) || defined(CUT)
  int j = int(place);
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
  mean += w * Layer(x, q.z, place);
}

void Close(float alpha) {
#if defined(CUT)
  color = sum > 0.0 ? vec4(mean, kept) * (alpha / sum) : vec4(0.0);
#elif defined(FEATHER)
  // Where nothing is left but photos that end, so does the picture.
  float opaque = alpha * min(1.0, kept / (ALPHA_FULL_AT * sum));
  color = kept > 0.0 ? vec4(mean * (opaque / kept), opaque) : vec4(0.0);
#else
  color = sum > 0.0 ? vec4(mean / sum, 1.0) * alpha : vec4(0.0);
#endif
}
)";

// Any number of photos.
constexpr const char* kLoop = R"(
noperspective in vec4 corner;   // alpha, 1 / depth, barycentric coordinates 0 and 1
flat in uvec2 records;          // first, past the last
uniform samplerBuffer projections;
uniform usamplerBuffer record_places;
void main() {
  depth = 1.0 / corner.y;
  vec3 b = vec3(corner.zw, 1.0 - corner.z - corner.w);
  for (int i = int(records.x); i < int(records.y); ++i)
    Add(b.x * texelFetch(projections, 3 * i) + b.y * texelFetch(projections, 3 * i + 1) + b.z * texelFetch(projections, 3 * i + 2),
        texelFetch(record_places, i).PLACE);
  Close(corner.x);
}
)";

bool Plain(const SparseVariant& v) {
  return v.ends == PhotoEnds::kNever && v.whole_layers && !v.blend.prefilter && !v.blend.exposure && !v.blend.false_color;
}
// What a pixel wants to know of a record: where its texels are, or its camera.
const char* Place(const SparseVariant& v) { return Plain(v) ? "y" : "x"; }

// One bilinear look-up where nothing else is needed.
constexpr const char* kPlainLayer = R"(
uniform sampler2DArray photos[GROUPS];
vec3 Texel(int group, vec3 x) {
  switch (group) {
SAMPLE_CASES
  }
  return vec3(0.0);
}
vec3 Layer(vec2 x01, float depth_ratio, uint place) { return Texel(int(place >> 16), vec3(x01, float(place & 0xffffu))); }
)";

constexpr const char* kAnyLayer = R"(
vec3 Layer(vec2 x01, float depth_ratio, uint place) {
  int j = int(place);
  return Radiance(j, x01 * vec2(CAMERA(j, 0).w, CAMERA(j, 1).w), depth_ratio);
}
)";

}  // namespace

std::string SparseVertexShader(const SparseVariant& variant) {
  std::string text = R"(#version 430 core
layout(location = 0) in vec4 position;   // x and y in clip units, near / depth, alpha
layout(location = 1) in float inverse_depth;
layout(location = 2) in uvec2 range;
uniform vec2 z_from_depth;
noperspective out vec4 corner;
)";
  std::string body;
  if (variant.layers == 0) {
    text += "flat out uvec2 records;\n";
    body = "  records = range;\n";
  } else {
    text += "uniform samplerBuffer projections;\nuniform usamplerBuffer record_places;\n";
    for (int i = 0; i < variant.layers; ++i) {
      text += fmt::format("noperspective out vec4 layer{};\n", i);
      if (i % 4 == 0) text += fmt::format("flat out uvec4 places{};\n", i / 4);
      body += fmt::format("  layer{0} = Projection({0}, i);\n  places{1}[{2}] = Place({0});\n", i, i / 4, i % 4);
    }
    text += fmt::format(R"(
bool Has(int n) {{ return range.x + uint(n) < range.y; }}
vec4 Projection(int n, int i) {{ return Has(n) ? texelFetch(projections, 3 * (int(range.x) + n) + i) : vec4(0.5, 0.5, 1.0, 0.0); }}
uint Place(int n) {{ return Has(n) ? texelFetch(record_places, int(range.x) + n).{} : 0u; }}
)",
                        Place(variant));
  }
  return text + R"(
void main() {
  int i = gl_VertexID % 3;
  gl_Position = vec4(position.xy, position.z * z_from_depth.x + z_from_depth.y, 1.0);
  corner = vec4(position.w, inverse_depth, i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0);
)" + body + "}\n";
}

std::string SparseFragmentShader(const SparseVariant& variant) {
  std::string text = shader::Defines(variant.blend);
  if (variant.ends == PhotoEnds::kFeather) text += "#define FEATHER\n";
  if (variant.ends == PhotoEnds::kCut) text += "#define CUT\n";
  text += fmt::format("#define PLACE {}\n", Place(variant));
  text += shader::kCameras;
  text += kHead;
  if (Plain(variant)) {
    std::string plain = kPlainLayer, cases;
    for (int g = 0; g < variant.blend.groups; ++g) cases += fmt::format("    case {0}: return textureLod(photos[{0}], x, 0.0).rgb;\n", g);
    plain.replace(plain.find("SAMPLE_CASES"), 12, cases);
    text += plain;
  } else {
    text += shader::Photos(variant.blend) + kAnyLayer;
  }
  text += kAdd;
  if (variant.layers == 0) return text + kLoop;
  text += "noperspective in vec4 corner;\n";
  std::string body = "void main() {\n  depth = 1.0 / corner.y;\n";
  for (int i = 0; i < variant.layers; ++i) {
    text += fmt::format("noperspective in vec4 layer{};\n", i);
    if (i % 4 == 0) text += fmt::format("flat in uvec4 places{};\n", i / 4);
    body += fmt::format("  Add(layer{}, places{}[{}]);\n", i, i / 4, i % 4);
  }
  return text + body + "  Close(corner.x);\n}\n";
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
