#include <fmt/format.h>

#include <cctype>

#include "render/gl/shader_parts.h"
#include "render/radiance/measures/prefilter.h"
#include "render/radiance/visibility.h"

namespace lumi {
namespace {

constexpr int kBuckets = 48;
// LeafWeight of render/radiance/weights.cc.
constexpr float kLeafTrace = 1e-6F;

}  // namespace

int CameraRows(const BlendVariant& variant) { return variant.photo_terms || variant.exposure ? 5 : 4; }

namespace shader {

namespace {

// A buffer's values: in buffer textures, which OpenGL ES 3.0 and WebGL 2 lack, or in rows of a texture.
constexpr const char* kBuffers = R"(
#define BUFFER samplerBuffer
#define UINT_BUFFER usamplerBuffer
#define FETCH(buffer, i) texelFetch(buffer, i)
#define FACE_NORMAL(at) normals[max(texelFetch(face_map, at, 0).r, 1u) - 1u].xyz
#define VISIBILITY_TEXEL(map, at) texelFetch(visibility_maps, ((map) * visibility_size.y + (at).y) * visibility_size.x + (at).x).r
)";
constexpr const char* kTextureRows = R"(
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
precision highp sampler2DArray;
precision highp usampler2DArray;
#define ES
#define BUFFER sampler2D
#define UINT_BUFFER usampler2D
#define FETCH(buffer, i) texelFetch(buffer, ivec2((i) & (ROW_TEXELS - 1), (i) / ROW_TEXELS), 0)
#define FACE_NORMAL(at) texelFetch(depth_map, at, 0).yzw
#define VISIBILITY_TEXEL(map, at) texelFetch(visibility_maps, ivec2((map) % MAP_COLUMNS, (map) / MAP_COLUMNS) * visibility_size + (at), 0).r
)";

}  // namespace

std::string Version(ShaderLanguage language) {
  return language == ShaderLanguage::kEs300
             ? fmt::format("#version 300 es\n#define ROW_TEXELS {}\n", kEsRowTexels) + kTextureRows
             : std::string("#version 430 core\n") + kBuffers;
}

std::string Constants() {
  std::string text;
  text += fmt::format("#define ALPHA_FULL_AT {:.6f}\n", kAlphaFullAt);
  text += fmt::format("#define TILE_PX {}\n#define TILES_PER_GROUP {}\n#define BUCKETS {}\n", kTilePx, kTilesPerGroup,
                      kBuckets);
  text += fmt::format("#define VISIBLE_UP_TO {:.6f}\n#define BLOCKED_FROM {:.6f}\n#define LOG2_BLOCKED {:.9f}\n",
                      kVisibleUpTo, kBlockedFrom, kLog2Blocked);
  text += fmt::format("#define LEAF_STEPS {}\n#define LEAF_TRACE {:.9e}\n", kLeafSteps, kLeafTrace);
  text += fmt::format("#define LEVEL_BIAS {:.6f}\n#define LEAST_FACING {:.9e}\n", kLevelBias, 1 / kMostFacing<float>);
  return text;
}

std::string Defines(const BlendVariant& variant) {
  std::string text = Version(ShaderLanguage::kDesktop430) + Constants();
  text += fmt::format("#define K {}\n#define GROUPS {}\n#define CAMERA_ROWS {}\n", variant.k, variant.groups,
                      CameraRows(variant));
  const auto define = [&](bool on, const char* name) {
    if (on) text += fmt::format("#define {}\n", name);
  };
  define(variant.false_color, "FALSE_COLOR");
  define(variant.whole_layers, "WHOLE_LAYERS");
  define(variant.lists == CameraLists::kCells, "CELLS");
  define(variant.correlation == Correlation::kFallingLeaves, "FALLING_LEAVES");
  define(variant.field_of_view, "FIELD_OF_VIEW");
  define(variant.visibility, "VISIBILITY");
  ForEachTerm([&]<typename M> {
    if constexpr (PixelTerm<M>) define(variant.terms.Has<M>(), TermOf(M::kName).c_str());
  });
  define(variant.stretch == Resolution::kDistance, "STRETCH_BY_DISTANCE");
  define(variant.stretch == Resolution::kJacobian, "STRETCH_BY_JACOBIAN");
  define(variant.photo_terms, "PHOTO_TERMS");
  define(variant.exposure, "EXPOSURE");
  define(variant.prefilter, "PREFILTER");
  if (variant.compute) text += fmt::format("#define COMPUTE\n#define BLEND_GROUP_PX {}\n", kBlendGroupPx);
  // On the plane of the proxy's face: reading it costs the driver a texture, so only where something asks.
  define(variant.Faces(), "FACES");
  if (variant.cameras_in_uniforms)
    text += fmt::format("#define CAMERAS_IN_UNIFORMS\n#define CAMERA_CAPACITY {}\n", variant.camera_capacity);
  return text;
}

const char* const kCameras = R"(
uniform int camera_count;
uniform UINT_BUFFER places; // size | size << 16, group | top level << 8 | shift << 16, layer, source view

// A camera is four vec4: D, width; M row by row with height, feather, focal length in the fourth places; a fifth where
// the variant wants it: those terms of h that are its own, its gain.
#ifdef CAMERAS_IN_UNIFORMS
layout(std140) uniform Cameras { vec4 cameras[CAMERA_ROWS * CAMERA_CAPACITY]; };
#define CAMERA(j, r) cameras[CAMERA_ROWS * (j) + (r)]
#else
uniform BUFFER cameras;
#define CAMERA(j, r) FETCH(cameras, CAMERA_ROWS * (j) + (r))
#endif

const float kInfinity = 3.0e38;
const float kPi = 3.14159265358979;

// atan2(s, c) for s >= 0, to a float's last digits (Cephes' atanf): drivers' own differ by 1e-4 and more.
float Atan(float s, float c) {
  float a = abs(c);
  float hi = max(s, a), lo = min(s, a);
  if (hi == 0.0) return 0.0;
  float x = lo / hi;
  float base = 0.0;
  if (x > 0.4142135623730950) {
    base = 0.25 * kPi;
    x = (lo - hi) / (lo + hi);
  }
  float z = x * x;
  float y = base + ((((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1) * z * x + x);
  if (s > a) y = 0.5 * kPi - y;
  return c < 0.0 ? kPi - y : y;
}

// Angles from which the buckets of a tile's list begin: finer towards 0, where most of the nearest are.
float BucketEdge(int bucket) {
  float b = float(bucket) / float(BUCKETS);
  return kPi * b * b;
}

// sin(pi/2 s) for s in [0,1] by its series: no driver's own, and a third of its cost on a CPU. Its square is the raised
// cosine, and keeps its digits at the border, where 1 - cos cancels.
float SineQuarter(float s) {
  float x = 0.5 * kPi * s, z = x * x;
  return min(1.0, x * (1.0 + z * (-1.6666667e-1 + z * (8.3333333e-3 + z * (-1.9841270e-4 + z * (2.7557319e-6 - z * 2.5052108e-8))))));
}
float RaisedCosine(float s) {
  float r = SineQuarter(clamp(s, 0.0, 1.0));
  return r * r;
}

// Field-of-view value of a place in photo j that lies within it.
float FieldOfView(float edge_px, float feather_px) { return RaisedCosine(edge_px / feather_px); }
)";

namespace {

constexpr const char* kSeen = R"(
uniform float alpha_weight, gamma;

// The pixel and its ray: set before anything is measured.
vec2 pixel;
float view_depth;   // along the optical axis
vec3 offset;        // of the proxy's point from the desired centre
vec3 d;             // unit
float t;

struct Seen {
  vec2 x_px;
  float depth;
  float f;      // field-of-view value
  bool inside;  // f can be 0 on the border itself
};

Seen Project(int j, float width_px) {
  vec3 q = offset - CAMERA(j, 0).xyz;
  vec4 r0 = CAMERA(j, 1), r1 = CAMERA(j, 2), r2 = CAMERA(j, 3);
  Seen s;
  s.depth = dot(r2.xyz, q);
  s.x_px = vec2(dot(r0.xyz, q), dot(r1.xyz, q)) / (s.depth > 0.0 ? s.depth : 1.0);
  vec2 size = vec2(width_px, r0.w);
  vec2 edge = min(s.x_px, size - s.x_px);
  float e = min(edge.x, edge.y);
  s.inside = s.depth > 0.0 && e >= 0.0;
#ifdef FIELD_OF_VIEW
  s.f = s.inside ? FieldOfView(e, r1.w) : 0.0;
#else
  s.f = 1.0;
#endif
  return s;
}

#ifdef FACES
#ifndef ES
uniform usampler2D face_map;   // of the proxy, from 1
layout(std430, binding = 1) readonly buffer Normals { vec4 normals[]; };
#endif
vec3 normal;  // of the pixel's face; 0 where it has no area
#endif

#ifdef PREFILTER
uniform float focal_px;        // of the desired camera

// From |det J| (render/radiance/measures/prefilter.h).
float PyramidLevel(vec4 D, float focal_source_px, float depth) {
  float a = abs(dot(normal, offset - D.xyz)), b = abs(dot(normal, offset));
  float facing = a > 0.0 || b > 0.0 ? min(max(a, b * LEAST_FACING) / max(b, a * LEAST_FACING), 1.0 / LEAST_FACING) : 1.0;
  float depth_ratio = view_depth / depth, frontal = focal_source_px / focal_px * depth_ratio;
  return 0.5 * log2(frontal * frontal * (facing * depth_ratio)) + LEVEL_BIAS;
}
#endif

#ifdef STRETCH_BY_JACOBIAN
uniform mat3 view_from_offset; // the desired camera's matrix

vec3 tangent_u, tangent_v;
mat2 view_jacobian;  // columns: steps in pixels for steps along the tangents, as long as the point is deep in the view

// depth: relative to that in the view. Areas of steps of unit length would underflow for far points.
vec2 Step(vec3 tangent, vec3 r0, vec3 r1, vec3 r2, vec2 x_px, float depth) {
  return (vec2(dot(r0, tangent), dot(r1, tangent)) - x_px * dot(r2, tangent)) / depth;
}

void PrepareStretch() {
  vec3 n = normal;
  vec3 a = abs(n);
  // Across the axis that n is farthest from.
  vec3 axis = a.x <= a.y && a.x <= a.z ? vec3(1.0, 0.0, 0.0) : a.y <= a.z ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
  tangent_u = normalize(cross(n, axis));
  tangent_v = cross(n, tangent_u);
  mat3 rows = transpose(view_from_offset);
  view_jacobian = mat2(Step(tangent_u, rows[0], rows[1], rows[2], pixel, 1.0),
                       Step(tangent_v, rows[0], rows[1], rows[2], pixel, 1.0));
}

// The largest singular value of J_view J_photo^-1 (errata of sec. 4.2.2), finite in its intermediates.
float Stretch(int j, vec4 D, Seen s) {
  if (s.depth <= 0.0) return 1e12;
  vec3 r0 = CAMERA(j, 1).xyz, r1 = CAMERA(j, 2).xyz, r2 = CAMERA(j, 3).xyz;
  float depth = s.depth / view_depth;
  vec2 pu = Step(tangent_u, r0, r1, r2, s.x_px, depth), pv = Step(tangent_v, r0, r1, r2, s.x_px, depth);
  vec2 vu = view_jacobian[0], vv = view_jacobian[1];
  float det = pu.x * pv.y - pv.x * pu.y;
  float a = vu.x * pv.y - vv.x * pu.y, b = vv.x * pu.x - vu.x * pv.x;
  float c = vu.y * pv.y - vv.y * pu.y, e = vv.y * pu.x - vu.y * pv.x;
  float size = 0.5 * (length(vec2(a + e, b - c)) + length(vec2(a - e, b + c)));
  return abs(det) > size * 1e-12 ? size / abs(det) : 1e12;
}
#endif

#ifdef STRETCH_BY_DISTANCE
uniform float view_focal_px;
float Stretch(int j, vec4 D, Seen s) { return length(offset - D.xyz) * view_focal_px / (t * CAMERA(j, 3).w); }
#endif
)";

// What the measures' own functions read: as sight in render/radiance/measures/record.h.
constexpr const char* kSight = R"(
#ifdef TERMS
struct Sight {
  float theta;    // rad
  vec2 x_px;      // the point in the photo
  vec2 size_px;   // of the photo
  float depth;    // of the point there; <= 0: behind it
  float stretch;  // of a photo's pixel in the view
  float field;    // the photo's own number there
};

uniform BUFFER photo_fields;
float FieldAt(int view, ivec3 field, vec2 x01) {
  if (field.y == 0) return 1.0;
  ivec2 last = field.yz - 1;
  vec2 x = clamp(x01 * vec2(field.yz) - 0.5, vec2(0.0), vec2(last));
  ivec2 x0 = ivec2(x), x1 = min(x0 + 1, last);
  vec2 a = x - vec2(x0);
  int first = field.x + view * field.y * field.z;
  float top = mix(FETCH(photo_fields, first + x0.y * field.y + x0.x).r, FETCH(photo_fields, first + x0.y * field.y + x1.x).r, a.x);
  float bottom = mix(FETCH(photo_fields, first + x1.y * field.y + x0.x).r, FETCH(photo_fields, first + x1.y * field.y + x1.x).r, a.x);
  return mix(top, bottom, a.y);
}
#endif
)";

// Twin of render/radiance/dissimilarity.h.
constexpr const char* kTogether = R"(
float WithTerm(float g, float scale, float own, float value) { return g + scale * abs(own - value); }
float Penalty(float gate) { return 1.0 + gamma * (1.0 / gate - 1.0); }
float Dissimilarity(float g, float gate) { return g > 0.0 ? (gate > 0.0 ? min(g * Penalty(gate), 1e37) : kInfinity) : 0.0; }
float WithGate(float h, float f, float v) { return min(h * Penalty(f * v) / Penalty(f), 1e37); }
)";

// Around the measures' terms.
constexpr const char* kDissimilarity = R"(
float Dissimilarity(int j, vec4 D, float theta, Seen s) {
#ifdef FIELD_OF_VIEW
  if (!s.inside) return kInfinity;
#endif
  float g = alpha_weight * theta;
#ifdef PHOTO_TERMS
  g += CAMERA(j, 4).x;
#endif
#ifdef TERMS
#if defined(STRETCH_BY_DISTANCE) || defined(STRETCH_BY_JACOBIAN)
  Sight at = Sight(theta, s.x_px, vec2(D.w, CAMERA(j, 1).w), s.depth, Stretch(j, D, s), 1.0);
#else
  Sight at = Sight(theta, s.x_px, vec2(D.w, CAMERA(j, 1).w), s.depth, 1.0, 1.0);
#endif
#endif
)";
constexpr const char* kDissimilarityEnds = R"(
  return Dissimilarity(g, s.f);
}
)";

constexpr const char* kVisibility = R"(
#ifdef VISIBILITY
uniform BUFFER visibility_maps; // depth that each source sees, map after map
uniform ivec2 visibility_size;         // of a map

// Visibility of render/radiance/visibility.h: the comparison of four texels, interpolated, geometric between its ends.
float Surface(int map, ivec2 at, float depth) {
  float r = depth / VISIBILITY_TEXEL(map, at);
  return 1.0 - smoothstep(1.0 + VISIBLE_UP_TO, 1.0 + BLOCKED_FROM, r);
}

float Visibility(int j, Seen s) {
  vec2 size = vec2(visibility_size);
  vec2 x = clamp(s.x_px / vec2(CAMERA(j, 0).w, CAMERA(j, 1).w) * size - 0.5, vec2(0.0), size - 1.0);
  ivec2 x0 = ivec2(x), x1 = min(x0 + 1, visibility_size - 1);
  vec2 a = x - vec2(x0);
  int map = int(FETCH(places, j).w);
  float top = mix(Surface(map, x0, s.depth), Surface(map, ivec2(x1.x, x0.y), s.depth), a.x);
  float bottom = mix(Surface(map, ivec2(x0.x, x1.y), s.depth), Surface(map, x1, s.depth), a.x);
  return exp2(LOG2_BLOCKED * (1.0 - min(1.0, mix(top, bottom, a.y))));
}

// h with visibility, from h without: v <= 1, so it only grows.
float WithVisibility(float h, int j, Seen s) {
  if (h <= 0.0 || h >= kInfinity || s.f <= 0.0 || s.depth <= 0.0) return h;
  return WithGate(h, s.f, Visibility(j, s));
}
#else
float WithVisibility(float h, int j, Seen s) { return h; }
#endif
)";

}  // namespace

std::string ScaleOf(std::string_view measure) { return fmt::format("{}_scale", measure); }
std::string ShapeOf(std::string_view measure) { return fmt::format("{}_shape", measure); }
std::string FieldOf(std::string_view measure) { return fmt::format("{}_field", measure); }

std::string TermOf(std::string_view measure) {
  std::string name = "TERM_";
  for (const char c : measure)
    name += c == '-' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return name;
}

std::string Measures() {
  std::string any, values, terms;
  ForEachTerm([&]<typename M> {
    if constexpr (PixelTerm<M>) {
      const std::string begin = fmt::format("#ifdef {}\n", TermOf(M::kName)), end = "#endif\n";
      any += begin + "#define TERMS\n" + end;
      values += begin + fmt::format("uniform float {};\nuniform vec4 {};\n", ScaleOf(M::kName), ShapeOf(M::kName)) +
                M::kGlsl;
      terms += begin;
      if constexpr (Estimated<M>) {
        values += fmt::format("uniform ivec3 {};\n", FieldOf(M::kName));
        terms += fmt::format("  at.field = FieldAt(int(FETCH(places, j).w), {}, at.x_px / at.size_px);\n",
                             FieldOf(M::kName));
      }
      values += end;
      terms += fmt::format("  g = WithTerm(g, {}, {:.9e}, {}(at, {}));\n", ScaleOf(M::kName), M::kOwn, M::kGlslValue,
                           ShapeOf(M::kName)) +
               end;
    }
  });
  return any + kSeen + kSight + kTogether + values + kDissimilarity + terms + kDissimilarityEnds + kVisibility;
}

}  // namespace shader
}  // namespace lumi
