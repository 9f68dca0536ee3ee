#include "render/gl/sparse_shader.h"

#include <fmt/format.h>

#include "render/gl/shader_parts.h"
#include "render/radiance/sparse/sparse_plan.h"

namespace lumi {
namespace {

constexpr const char* kSparseHead = R"(
layout(location = 0) out vec4 color;  // premultiplied
layout(location = 1) out float depth;
)";

constexpr const char* kAdd = R"(
vec3 mean = vec3(0.0);
float sum = 0.0;   // of the weights
#ifdef NEGATIVE
vec4 taken = vec4(0.0);  // by the negative ones: colour, sum
#endif
float best = 0.0;  // view of the point among the photos that count

// q: the photo's projection and weight.
void Add(vec4 q, uint place) {
#ifdef NEGATIVE
  float w = q.w;
#else
  float w = max(q.w, 0.0);
#endif
  vec2 x = q.xy / q.z;
  int j = int(place >> 16);
#if defined(FEATHER) || defined(CUT)
  vec4 D = CAMERA(j, 0);
  vec2 edge = min(x, 1.0 - x) * vec2(D.w, CAMERA(j, 1).w);
  float e = min(edge.x, edge.y);
  float gate = q.z > 0.0 && e >= 0.0 ? 1.0 : 0.0;
  // Outside its photo a place may be anything: nothing of it is used.
  x = gate > 0.0 ? x : vec2(0.5);
#ifdef FEATHER
  // From its own place a photo is seen to its very border.
  if (D.xyz != vec3(0.0)) gate *= min(1.0, FieldOfView(e, CAMERA(j, 2).w) / ALPHA_FULL_AT);
  if (w > 0.0) best = max(best, gate);
#endif
  w *= gate;
#endif
#ifdef PREFILTER
  // q is scaled so that a plane's Jacobian, whose determinant falls as the third power of the depth, is 1 at level 0.
  float level = max(0.0, -1.5 * log2(max(q.z, 1e-20)));
#else
  float level = 0.0;
#endif
  vec3 c = Radiance(j, int(place >> 11) & 31, int(place & 2047u), x, level);
#ifdef NEGATIVE
  taken -= min(w, 0.0) * vec4(c, 1.0);
  w = max(w, 0.0);
#endif
  sum += w;
  mean += w * c;
}

void Close() {
#ifdef NEGATIVE
  // kMostTaken of sparse_plan.h.
  float share = taken.a > MOST_TAKEN * sum ? MOST_TAKEN * sum / taken.a : 1.0;
  mean -= share * taken.rgb;
  sum -= share * taken.a;
#endif
#if defined(CUT)
  // The weights summed to 1: what is missing stays empty.
  color = vec4(mean, sum) / max(1.0, sum);
#elif defined(FEATHER)
  color = sum > 0.0 ? vec4(mean / sum, 1.0) * best : vec4(0.0);
#else
  color = sum > 0.0 ? vec4(mean / sum, 1.0) : vec4(0.0);
#endif
}
)";

// Any number of photos.
constexpr const char* kLoop = R"(
noperspective in vec3 corner;   // 1 / depth, barycentric coordinates 0 and 1
flat in uvec2 records;          // first, past the last
uniform samplerBuffer projections;
uniform usamplerBuffer record_places;
void main() {
  depth = 1.0 / corner.x;
  vec3 b = vec3(corner.yz, 1.0 - corner.y - corner.z);
  for (int i = int(records.x); i < int(records.y); ++i)
    Add(b.x * texelFetch(projections, 3 * i) + b.y * texelFetch(projections, 3 * i + 1) + b.z * texelFetch(projections, 3 * i + 2),
        texelFetch(record_places, i).x);
  Close();
}
)";

}  // namespace

std::string SparseVertexShader(const SparseVariant& variant) {
  std::string text = R"(#version 430 core
layout(location = 0) in vec3 position;   // x and y in clip units, near / depth
layout(location = 1) in float inverse_depth;
layout(location = 2) in uvec2 range;
uniform vec2 z_from_depth;
noperspective out vec3 corner;
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
    text += R"(
bool Has(int n) { return range.x + uint(n) < range.y; }
vec4 Projection(int n, int i) { return Has(n) ? texelFetch(projections, 3 * (int(range.x) + n) + i) : vec4(0.5, 0.5, 1.0, 0.0); }
uint Place(int n) { return Has(n) ? texelFetch(record_places, int(range.x) + n).x : 0u; }
)";
  }
  return text + R"(
void main() {
  int i = gl_VertexID % 3;
  gl_Position = vec4(position.xy, position.z * z_from_depth.x + z_from_depth.y, 1.0);
  corner = vec3(inverse_depth, i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0);
)" + body +
         "}\n";
}

std::string SparseFragmentShader(const SparseVariant& variant) {
  std::string text = shader::Defines(variant.blend);
  if (variant.ends == PhotoEnds::kFeather) text += "#define FEATHER\n";
  if (variant.ends == PhotoEnds::kCut) text += "#define CUT\n";
  if (variant.negative) text += fmt::format("#define NEGATIVE\n#define MOST_TAKEN {:.6f}\n", kMostTaken);
  text += shader::kCameras;
  text += kSparseHead;
  text += shader::Photos();
  text += kAdd;
  if (variant.layers == 0) return text + kLoop;
  text += "noperspective in vec3 corner;\n";
  std::string body = "void main() {\n  depth = 1.0 / corner.x;\n";
  for (int i = 0; i < variant.layers; ++i) {
    text += fmt::format("noperspective in vec4 layer{};\n", i);
    if (i % 4 == 0) text += fmt::format("flat in uvec4 places{};\n", i / 4);
    body += fmt::format("  Add(layer{}, places{}[{}]);\n", i, i / 4, i % 4);
  }
  return text + body + "  Close();\n}\n";
}

const std::string& LineVertexShader() {
  static const std::string text = R"(#version 430 core
layout(location = 0) in vec2 position;   // clip units
layout(location = 1) in vec4 rgba;
flat out vec4 line_color;
void main() {
  gl_Position = vec4(position, 0.0, 1.0);
  line_color = rgba;
}
)";
  return text;
}

const std::string& LineFragmentShader() {
  static const std::string text = R"(#version 430 core
layout(location = 0) out vec4 color;
flat in vec4 line_color;
void main() { color = line_color; }
)";
  return text;
}

}  // namespace lumi
