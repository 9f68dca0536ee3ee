#include "render/gl/blend_shader.h"

#include <fmt/format.h>

#include "render/radiance/settings.h"
#include "render/radiance/visibility.h"

namespace lumi {

const std::string& DepthVertexShader() {
  // z = w - 2 near clips at w = near exactly and never behind; the depth that is tested is written by the fragments.
  static const std::string text = fmt::format(R"(#version 430 core
layout(location = 0) in vec3 x_normalized;
uniform vec3 centre;           // of the desired camera, normalised
uniform mat3 clip_from_offset; // rows: x and y in clip units, depth
void main() {{
  vec3 c = clip_from_offset * (x_normalized - centre);
  gl_Position = vec4(c.xy, c.z - 2.0 * {:.9e}, c.z);
}}
)",
                                              kNearDepth);
  return text;
}

const std::string& DepthFragmentShader() {
  // 1/depth is linear on the screen. As a float depth near/depth has the same relative precision at every distance.
  static const std::string text = fmt::format(R"(#version 430 core
layout(location = 0) out float depth;
void main() {{
  depth = 1.0 / gl_FragCoord.w;
  gl_FragDepth = min(1.0, {:.9e} * gl_FragCoord.w);
}}
)",
                                              kNearDepth);
  return text;
}

const std::string& FullScreenVertexShader() {
  static const std::string text = R"(#version 430 core
void main() {
  gl_Position = vec4(vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID & 2) * 2 - 1), 0.0, 1.0);
}
)";
  return text;
}

namespace {

// What the blend and the cull share.
constexpr const char* kCommon = R"(
uniform sampler2D depth_map;
uniform mat3 ray_from_pixel;   // to the plane at depth 1
uniform int camera_count;
uniform float gamma;
uniform usamplerBuffer places; // size | size << 16, group | top level << 8 | shift << 16, layer, source view
uniform samplerBuffer visibility_maps; // depth that each source sees, map after map
uniform ivec2 visibility_size;         // of a map; 0: off

// Lists of cameras, tile_words a tile: length, then camera | bucket << 24 with buckets ascending.
uniform int tile_columns, tile_words;  // tile_words 0: no lists

// A camera is four vec4: D, width; M row by row with height, feather, focal length in the fourth places.
#ifdef CAMERAS_IN_UNIFORMS
layout(std140) uniform Cameras { vec4 cameras[4 * CAMERA_CAPACITY]; };
#define CAMERA(j, r) cameras[4 * (j) + (r)]
#else
uniform samplerBuffer cameras;
#define CAMERA(j, r) texelFetch(cameras, 4 * (j) + (r))
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

// Angles from which the buckets begin: finer towards 0, where most of the nearest are.
float BucketEdge(int bucket) {
  float b = float(bucket) / float(BUCKETS);
  return kPi * b * b;
}

// Visibility of render/radiance/visibility.h: the comparison of four texels, interpolated.
int VisibilityMap(int j) { return int(texelFetch(places, j).w) * visibility_size.x * visibility_size.y; }
float Surface(int map, ivec2 at, float depth) {
  float r = depth / texelFetch(visibility_maps, map + at.y * visibility_size.x + at.x).r;
  return 1.0 - smoothstep(1.0 + VISIBLE_UP_TO, 1.0 + BLOCKED_FROM, r);
}
)";

// Interface and helpers of the blend.
constexpr const char* kHead = R"(
layout(location = 0) out vec4 color;  // premultiplied

uniform float focal_px;        // of the desired camera; 0: no prefilter
uniform samplerBuffer source_colors;
uniform sampler2DArray photos[GROUPS];
uniform ivec2 group_size[GROUPS];
layout(std430, binding = 0) readonly buffer Lists { uint lists[]; };

// sin(pi/2 s) for s in [0,1] by its series: no driver's own, and a third of its cost on a CPU. Its square is the raised
// cosine, and keeps its digits at the border, where 1 - cos cancels.
float SineQuarter(float s) {
  float x = 0.5 * kPi * s, z = x * x;
  return min(1.0, x * (1.0 + z * (-1.6666667e-1 + z * (8.3333333e-3 + z * (-1.9841270e-4 + z * (2.7557319e-6 - z * 2.5052108e-8))))));
}

// The cameras that a pixel looks at, one after the other: its tile's list, else all in order.
struct Candidates {
  int first, count;  // in lists; first < 0: no list
};
Candidates CandidatesHere() {
  if (tile_words == 0) return Candidates(-1, camera_count);
  ivec2 tile = ivec2(gl_FragCoord.xy) / TILE_PX;
  int base = (tile.y * tile_columns + tile.x) * tile_words;
  return Candidates(base + 1, int(lists[base]));
}
// x: camera, y: bucket.
ivec2 Candidate(Candidates c, int i) {
  if (c.first < 0) return ivec2(i, 0);
  uint entry = lists[c.first + i];
  return ivec2(int(entry & 0xffffffu), int(entry >> 24));
}

struct Seen {
  vec2 x_px;
  float depth;
  float f;      // field-of-view value
  bool inside;  // f can be 0 on the border itself
};

Seen Project(int j, vec3 offset, float width_px) {
  vec3 q = offset - CAMERA(j, 0).xyz;
  vec4 r0 = CAMERA(j, 1), r1 = CAMERA(j, 2), r2 = CAMERA(j, 3);
  Seen s;
  s.depth = dot(r2.xyz, q);
  s.x_px = vec2(dot(r0.xyz, q), dot(r1.xyz, q)) / (s.depth > 0.0 ? s.depth : 1.0);
  vec2 size = vec2(width_px, r0.w);
  vec2 edge = min(s.x_px, size - s.x_px);
  float e = min(edge.x, edge.y);
  s.inside = s.depth > 0.0 && e >= 0.0;
  float r = SineQuarter(clamp(e / r1.w, 0.0, 1.0));
  s.f = s.inside ? r * r : 0.0;
  return s;
}

float Dissimilarity(float theta, Seen s) {
  if (!s.inside) return kInfinity;
  if (theta == 0.0) return 0.0;
  return s.f > 0.0 ? min(theta * (1.0 + gamma * (1.0 / s.f - 1.0)), 1e37) : kInfinity;
}

float Visibility(int j, Seen s) {
  vec2 size = vec2(visibility_size);
  vec2 x = clamp(s.x_px / vec2(CAMERA(j, 0).w, CAMERA(j, 1).w) * size - 0.5, vec2(0.0), size - 1.0);
  ivec2 x0 = ivec2(x), x1 = min(x0 + 1, visibility_size - 1);
  vec2 a = x - vec2(x0);
  int map = VisibilityMap(j);
  float top = mix(Surface(map, x0, s.depth), Surface(map, ivec2(x1.x, x0.y), s.depth), a.x);
  float bottom = mix(Surface(map, ivec2(x0.x, x1.y), s.depth), Surface(map, x1, s.depth), a.x);
  return mix(BLOCKED_VISIBILITY, 1.0, mix(top, bottom, a.y));
}

// h with visibility, from h without: v <= 1, so it only grows.
float WithVisibility(float h, int j, Seen s) {
  if (visibility_size.x == 0 || h <= 0.0 || h >= kInfinity || s.f <= 0.0) return h;
  return min(1e37, h * (1.0 + gamma * (1.0 / (s.f * Visibility(j, s)) - 1.0)) / (1.0 + gamma * (1.0 / s.f - 1.0)));
}

// w_j = h_1/h_j - edge, with h_1/h_1 = 1 also at 0.
float Ratio(float h1, float h) { return h == h1 ? 1.0 : h1 / h; }

#ifdef FALSE_COLOR
vec3 Radiance(int j, Seen s) {
  return texelFetch(source_colors, int(texelFetch(places, j).w)).rgb;
}
#else
vec3 Texel(int group, vec3 x, float level) {
  switch (group) {
SAMPLE_CASES
  }
  return vec3(0.0);
}

vec3 SampleLevel(int group, float layer, ivec2 size0, vec2 x01, int level) {
  vec2 size = vec2(max(size0 >> level, ivec2(1)));
  vec2 texture_px = vec2(max(group_size[group] >> level, ivec2(1)));
  vec2 x = clamp(x01 * size, vec2(0.5), size - 0.5);
  return Texel(group, vec3(x / texture_px, layer), float(level));
}

vec3 Radiance(int j, Seen s) {
  uvec4 place = texelFetch(places, j);
  ivec2 size0 = ivec2(place.x & 0xffffu, place.x >> 16);
  int group = int(place.y & 0xffu);
  float top = float((place.y >> 8) & 0xffu);
  float shift = float(place.y >> 16);
  float level = 0.0;
  if (focal_px > 0.0) {
    // Photo pixels a desired pixel, along a side.
    float ratio = CAMERA(j, 3).w * view_depth / (s.depth * focal_px);
    level = clamp(log2(max(ratio, 1.0)) - shift, 0.0, top);
  }
  vec2 x01 = s.x_px / vec2(CAMERA(j, 0).w, CAMERA(j, 1).w);
  int l = int(level);
  vec3 c = SampleLevel(group, float(place.z), size0, x01, l);
  float up = level - float(l);
  if (up > 0.0) c = mix(c, SampleLevel(group, float(place.z), size0, x01, l + 1), up);
  return c;
}
#endif
)";

constexpr const char* kNearest = R"(
void main() {
  view_depth = texelFetch(depth_map, ivec2(gl_FragCoord.xy), 0).r;
  color = vec4(0.0);
  if (view_depth <= 0.0) return;
  vec3 offset = view_depth * (ray_from_pixel * vec3(gl_FragCoord.xy, 1.0));
  float t = length(offset);
  vec3 d = offset / t;

  Candidates candidates = CandidatesHere();

  // The k + 1 smallest h, ascending.
  float h[K + 1];
  int camera[K + 1];
  for (int i = 0; i <= K; ++i) {
    h[i] = kInfinity;
    camera[i] = camera_count;
  }
  float f_largest = 0.0;
  float cut_sin = 0.0, cut_cos = -1.0;  // h >= theta: beyond this angle a camera cannot be among them
  for (int n = 0; n < candidates.count; ++n) {
    ivec2 candidate = Candidate(candidates, n);
    int j = candidate.x;
    // h >= theta: neither this one nor those after it can be among them.
    if (f_largest >= ALPHA_FULL_AT && BucketEdge(candidate.y) > h[K]) break;
    vec4 D = CAMERA(j, 0);
    float s = length(cross(D.xyz, d));
    float c = t - dot(D.xyz, d);
    if (s * cut_cos > c * cut_sin && cut_sin > 0.0 && f_largest >= ALPHA_FULL_AT) continue;
    Seen seen = Project(j, offset, D.w);
    f_largest = max(f_largest, seen.f);
    float hj = Dissimilarity(Atan(s, c), seen);
    if (hj > h[K]) continue;
    hj = WithVisibility(hj, j, seen);
    if (hj > h[K]) continue;
    int cj = j;
    for (int i = 0; i <= K; ++i) {
      bool less = hj < h[i] || (hj == h[i] && cj < camera[i]);  // ties by index: in any order the same picture
      float hi = h[i];
      int ci = camera[i];
      h[i] = less ? hj : hi;
      camera[i] = less ? cj : ci;
      hj = less ? hi : hj;
      cj = less ? ci : cj;
    }
    if (h[K] < kPi) {
      cut_sin = sin(h[K]);
      cut_cos = cos(h[K]);
    }
  }
  float h1 = h[0];
  if (h1 >= kInfinity) return;

  float edge = h[K] >= kInfinity ? 0.0 : Ratio(h1, h[K]);
  // At a (k+1)-way tie all windowed weights vanish: the tied share.
  bool tied = edge >= 1.0;
  float sum = 0.0;
  vec3 mean = vec3(0.0);
  for (int i = 0; i < K; ++i) {
    if (h[i] >= kInfinity) break;
    float w = tied ? 1.0 : Ratio(h1, h[i]) - edge;
    if (w <= 0.0) break;
    Seen seen;
    seen.x_px = vec2(0.0);
#ifndef FALSE_COLOR
    seen = Project(camera[i], offset, CAMERA(camera[i], 0).w);
#endif
    mean += w * Radiance(camera[i], seen);
    sum += w;
  }
  float alpha = h1 == 0.0 ? 1.0 : min(1.0, f_largest / ALPHA_FULL_AT);
  color = vec4(mean * (alpha / sum), alpha);
}
)";

constexpr const char* kAll = R"(
void main() {
  view_depth = texelFetch(depth_map, ivec2(gl_FragCoord.xy), 0).r;
  color = vec4(0.0);
  if (view_depth <= 0.0) return;
  vec3 offset = view_depth * (ray_from_pixel * vec3(gl_FragCoord.xy, 1.0));
  float t = length(offset);
  vec3 d = offset / t;
  Candidates candidates = CandidatesHere();
  float f_largest = 0.0, h1 = kInfinity;
  for (int n = 0; n < candidates.count; ++n) {
    ivec2 candidate = Candidate(candidates, n);
    int j = candidate.x;
    vec4 D = CAMERA(j, 0);
    Seen seen = Project(j, offset, D.w);
    f_largest = max(f_largest, seen.f);
    h1 = min(h1, WithVisibility(Dissimilarity(Atan(length(cross(D.xyz, d)), t - dot(D.xyz, d)), seen), j, seen));
  }
  if (h1 >= kInfinity) return;
  float sum = 0.0;
  vec3 mean = vec3(0.0);
  for (int n = 0; n < candidates.count; ++n) {
    ivec2 candidate = Candidate(candidates, n);
    int j = candidate.x;
    vec4 D = CAMERA(j, 0);
    Seen seen = Project(j, offset, D.w);
    float h = WithVisibility(Dissimilarity(Atan(length(cross(D.xyz, d)), t - dot(D.xyz, d)), seen), j, seen);
    if (h >= kInfinity) continue;
    float w = Ratio(h1, h);
    if (w <= 0.0) continue;
    mean += w * Radiance(j, seen);
    sum += w;
  }
  float alpha = h1 == 0.0 ? 1.0 : min(1.0, f_largest / ALPHA_FULL_AT);
  color = vec4(mean * (alpha / sum), alpha);
}
)";

constexpr const char* kCull = R"(
layout(local_size_x = TILES_PER_GROUP) in;
layout(std430, binding = 0) writeonly buffer Lists { uint lists[]; };
uniform ivec2 size_px;
uniform int tile_count;

// Margins over the rounding of the bounds below: of the radius, and of angles (radians).
const float kRadiusSlack = 1e-3;
const float kAngleSlack = 1e-4;

// Drivers' own asin can be off by 1e-3.
float Asin(float s) { return Atan(s, sqrt(max(0.0, 1.0 - s * s))); }

// Whether a sphere lies on the negative side of a plane through the origin.
bool Outside(vec3 n, vec3 q, float radius) { return dot(n, q) < -radius * length(n); }

void main() {
  int tile = int(gl_GlobalInvocationID.x);
  if (tile >= tile_count) return;
  ivec2 first = ivec2(tile % tile_columns, tile / tile_columns) * TILE_PX;
  ivec2 last = min(first + TILE_PX, size_px);
  int base = tile * tile_words;
  float nearest = kInfinity, farthest = 0.0;
  for (int y = first.y; y < last.y; ++y)
    for (int x = first.x; x < last.x; ++x) {
      float depth = texelFetch(depth_map, ivec2(x, y), 0).r;
      if (depth > 0.0) nearest = min(nearest, depth);
      farthest = max(farthest, depth);
    }
  lists[base] = 0u;
  if (farthest == 0.0) return;

  // A sphere around the proxy's points in the tile: a frustum's section is as far out as its corners.
  vec2 middle_px = 0.5 * vec2(first + last);
  vec3 c = 0.5 * (nearest + farthest) * (ray_from_pixel * vec3(middle_px, 1.0));
  float radius = 0.0;
  for (int i = 0; i < 8; ++i) {
    vec2 corner = vec2((i & 1) == 0 ? first.x : last.x, (i & 2) == 0 ? first.y : last.y);
    vec3 p = ((i & 4) == 0 ? nearest : farthest) * (ray_from_pixel * vec3(corner, 1.0));
    radius = max(radius, length(p - c));
  }
  radius *= 1.0 + kRadiusSlack;
  float t = length(c);
  vec3 d = c / t;
  // The direction to the desired camera turns by no more than this over the sphere.
  float turn = radius < t ? Asin(radius / t) : kPi;

  // Sorted by counting: how many to a bucket, then where each goes.
  int next[BUCKETS];
  for (int b = 0; b < BUCKETS; ++b) next[b] = 0;
  for (int pass = 0; pass < 2; ++pass) {
    for (int j = 0; j < camera_count; ++j) {
      vec4 D = CAMERA(j, 0), m0 = CAMERA(j, 1), m1 = CAMERA(j, 2), m2 = CAMERA(j, 3);
      vec3 q = c - D.xyz;
      if (Outside(m2.xyz, q, radius) || Outside(m0.xyz, q, radius) || Outside(D.w * m2.xyz - m0.xyz, q, radius) ||
          Outside(m1.xyz, q, radius) || Outside(m0.w * m2.xyz - m1.xyz, q, radius))
        continue;  // blind everywhere in the tile
      // The least theta, from its value at the centre. The two directions turn by `turn` and by as much seen from camera
      // j. They turn together where the cameras are near each other: with a, b the unit vectors to the two and t, s the
      // distances, d(a - b)/dp = (I - aa')/t - (I - bb')/s, of norm <= 2 |1/t - 1/s| + sin theta / max(t, s);
      // |t - s| <= |D| and sin theta <= |D| / max(t, s).
      float s = length(q), apart = length(D.xyz);
      float theta = Atan(length(cross(D.xyz, d)), t - dot(D.xyz, d));
      float least = theta - turn - (radius < s ? Asin(radius / s) : kPi);
      if (radius < min(s, t)) {
        float far_side = max(s, t) - radius;
        float reach = radius * apart * (2.0 / ((s - radius) * (t - radius)) + 1.0 / (far_side * far_side));
        least = max(least, 2.0 * Asin(clamp(sin(0.5 * theta) - 0.5 * reach, 0.0, 1.0)));
      }
      least = least * (1.0 - kAngleSlack) - kAngleSlack;
      int bucket = clamp(int(sqrt(max(0.0, least) / kPi) * float(BUCKETS)), 0, BUCKETS - 1);
      if (bucket > 0 && BucketEdge(bucket) > least) --bucket;
      if (K == 0) bucket = 0;  // all take part: in their own order
      if (pass == 0)
        ++next[bucket];
      else
        lists[base + 1 + next[bucket]++] = uint(j) | uint(bucket) << 24;
    }
    if (pass == 1) break;
    int sum = 0;
    for (int b = 0; b < BUCKETS; ++b) {
      int n = next[b];
      next[b] = sum;
      sum += n;
    }
    lists[base] = uint(sum);
  }
}
)";

constexpr int kBuckets = 48;

std::string Defines(const BlendVariant& variant) {
  std::string text = "#version 430 core\n";
  text += fmt::format("#define K {}\n#define GROUPS {}\n#define ALPHA_FULL_AT {:.6f}\n", variant.k, variant.groups,
                      kAlphaFullAt);
  text += fmt::format("#define TILE_PX {}\n#define TILES_PER_GROUP {}\n#define BUCKETS {}\n", kTilePx, kTilesPerGroup, kBuckets);
  text += fmt::format("#define VISIBLE_UP_TO {:.6f}\n#define BLOCKED_FROM {:.6f}\n#define BLOCKED_VISIBILITY {:.6f}\n", kVisibleUpTo,
                      kBlockedFrom, kBlockedVisibility);
  if (variant.false_color) text += "#define FALSE_COLOR\n";
  if (variant.cameras_in_uniforms)
    text += fmt::format("#define CAMERAS_IN_UNIFORMS\n#define CAMERA_CAPACITY {}\n", variant.camera_capacity);
  return text;
}

}  // namespace

std::string CullComputeShader(const BlendVariant& variant) { return Defines(variant) + kCommon + kCull; }

std::string BlendFragmentShader(const BlendVariant& variant) {
  std::string head = std::string(kCommon) + "float view_depth;\n" + kHead;
  std::string cases;
  // An array of samplers may be indexed by a value that is the same for all pixels only: a case each.
  for (int g = 0; g < variant.groups; ++g)
    cases += fmt::format("    case {0}: return textureLod(photos[{0}], x, level).rgb;\n", g);
  if (const auto at = head.find("SAMPLE_CASES"); at != std::string::npos) head.replace(at, 12, cases);
  return Defines(variant) + head + (variant.k == 0 ? kAll : kNearest);
}

}  // namespace lumi
