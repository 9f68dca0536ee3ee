#include "render/gl/blend_shader.h"

#include "render/gl/shader_parts.h"

namespace lumi {
namespace {

// A pixel's ray.
constexpr const char* kRays = R"(
uniform sampler2D depth_map;
uniform mat3 ray_from_pixel;   // to the plane at depth 1

// Sets the pixel's ray; false where it misses the proxy.
bool OpenAt(vec2 at_px) {
  pixel = at_px;
  view_depth = texelFetch(depth_map, ivec2(pixel), 0).r;
  if (view_depth <= 0.0) return false;
  vec3 ray = ray_from_pixel * vec3(pixel, 1.0);
  float slant = length(ray);  // of the offset itself it overflows at 1e19
  offset = view_depth * ray;
  t = view_depth * slant;
  d = ray / slant;
#ifdef FACES
  normal = FACE_NORMAL(ivec2(pixel));
#endif
#ifdef STRETCH_BY_JACOBIAN
  PrepareStretch();
#endif
  return true;
}

float Theta(vec4 D) { return Atan(length(cross(D.xyz, d)), t - dot(D.xyz, d)); }
)";

// The cameras that a pixel looks at, and R(h).
constexpr const char* kHead = R"(
#ifdef COMPUTE
layout(local_size_x = BLEND_GROUP_PX, local_size_y = BLEND_GROUP_PX) in;
layout(rgba32f, binding = 0) writeonly uniform image2D picture;
uniform ivec3 picture_rows;  // first, the one after the last, columns
vec4 color;
#else
layout(location = 0) out vec4 color;  // premultiplied
#endif

// One after the other: the list of the pixel's tile or cell, else all in order.
struct Candidates {
  int first, count;  // in lists; first < 0: no list
};
#ifdef ES
// Of each cell a texel: in layer i the candidates 4 i to 4 i + 3, each from 1, 0 past the last.
uniform usampler2DArray lists;
uniform ivec2 cell_count;
uniform vec2 cells_per_px;
Candidates CandidatesHere() {
  ivec2 at = min(ivec2(pixel * cells_per_px), cell_count - 1);
  return Candidates(at.y * cell_count.x + at.x, 4 * textureSize(lists, 0).z);
}
ivec2 Candidate(Candidates c, int i) {
  ivec2 at = ivec2(c.first % cell_count.x, c.first / cell_count.x);
  return ivec2(int(texelFetch(lists, ivec3(at, i >> 2), 0)[i & 3]) - 1, 0);
}
#else
uniform UINT_BUFFER lists;
// x: camera, y: bucket.
ivec2 Candidate(Candidates c, int i) {
  if (c.first < 0) return ivec2(i, 0);
  uint entry = FETCH(lists, c.first + i).r;
  return ivec2(int(entry & 0xffffffu), int(entry >> 24));
}

#ifdef CELLS
// Where each cell's list begins, then the lists' cameras.
uniform ivec2 cell_count;
uniform vec2 cells_per_px;
Candidates CandidatesHere() {
  ivec2 at = min(ivec2(pixel * cells_per_px), cell_count - 1);
  int cell = at.y * cell_count.x + at.x;
  int first = int(FETCH(lists, cell).r);
  return Candidates(cell_count.x * cell_count.y + 1 + first, int(FETCH(lists, cell + 1).r) - first);
}
#else
uniform int tile_columns, tile_words;  // tile_words 0: no lists
Candidates CandidatesHere() {
  if (tile_words == 0) return Candidates(-1, camera_count);
  ivec2 tile = ivec2(pixel) / TILE_PX;
  int base = (tile.y * tile_columns + tile.x) * tile_words;
  return Candidates(base + 1, int(FETCH(lists, base).r));
}
#endif
#endif

// h_1/h_j, with h_1/h_1 = 1 also at 0.
float Ratio(float h1, float h) { return h == h1 ? 1.0 : h1 / h; }

#ifdef FALLING_LEAVES
// R(h), P_same of render/radiance/correlation.h: its 2/5th power, which falls to 0 linearly, at steps of log h; and the trace
// of 1/h by which a photo leads where nothing correlates (render/radiance/weights.cc).
#ifdef ES
uniform sampler2D leaves;
#define LEAF(i) FETCH(leaves, i).r
#else
layout(std430, binding = 2) readonly buffer Leaves { float leaves[]; };
#define LEAF(i) leaves[i]
#endif
uniform vec2 leaf_place;  // of h in the table: x log2(h) + y
uniform float r_max;
float Correlation(float h) {
  if (h <= 0.0) return 1.0 + LEAF_TRACE;
  float at = clamp(leaf_place.x * log2(h) + leaf_place.y, 0.0, float(LEAF_STEPS));
  int i = min(int(at), LEAF_STEPS - 1);
  float root = mix(LEAF(i), LEAF(i + 1), at - float(i));
  return root * root * sqrt(root) + LEAF_TRACE * r_max / (r_max + h);
}
#endif

// R(h) windowed at h_end, the k + 1st h (kInfinity: there is none). For R = 1/h in units of the nearest photo's.
struct Window {
  float h1, edge, end;
  bool tied;
};
Window WindowAt(float h1, float h_end) {
  Window w;
  w.h1 = h1;
  w.end = h_end;
  w.edge = h_end >= kInfinity ? 0.0 : Ratio(h1, h_end);
  // At a (k+1)-way tie all windowed weights vanish: the tied share.
  w.tied = w.edge >= 1.0;
  return w;
}
float Weight(Window w, float h) {
  if (w.tied) return 1.0;
#ifdef FALLING_LEAVES
  // 1 - h / end, which rounds to 0 for all of them where they are nearly tied; their difference does not.
  return Correlation(h) * (w.end >= kInfinity ? 1.0 : (w.end - h) / w.end);
#else
  return Ratio(w.h1, h) - w.edge;
#endif
}

// What was blended so far.
vec3 mean = vec3(0.0);
float sum = 0.0;       // of the weights
float within = 0.0;    // of those whose photo contains the point

void Add(float w, int j, Seen s) {
  sum += w;
#ifndef FIELD_OF_VIEW
  if (!s.inside) return;
  within += w;
#endif
#ifdef FALSE_COLOR
  mean += w * Radiance(j, 0, 0, vec2(0.0), 0.0);
#else
  uvec4 place = FETCH(places, j);
  float level = 0.0;
#ifdef PREFILTER
  if (s.depth > 0.0) level = max(0.0, PyramidLevel(CAMERA(j, 0), CAMERA(j, 3).w, s.depth) - float(place.y >> 16));
#endif
  mean += w * Radiance(j, int(place.y & 0xffu), int(place.z), s.x_px / vec2(CAMERA(j, 0).w, CAMERA(j, 1).w), level);
#endif
}

void Close(float h1, float f_largest) {
  if (!(sum > 0.0)) return;
#ifdef FIELD_OF_VIEW
  float alpha = h1 == 0.0 ? 1.0 : min(1.0, f_largest / ALPHA_FULL_AT);
  color = vec4(mean * (alpha / sum), alpha);
#else
  // A photo that ends leaves its part of the pixel empty.
  color = vec4(mean, within) / sum;
#endif
}
)";

constexpr const char* kNearest = R"(
#if K > 0
void BlendAt(vec2 at_px) {
  color = vec4(0.0);
  if (!OpenAt(at_px)) return;
  Candidates candidates = CandidatesHere();

  // The k + 1 smallest h, ascending.
  float h[K + 1];
  int camera[K + 1];
  for (int i = 0; i <= K; ++i) {
    h[i] = kInfinity;
    camera[i] = camera_count;
  }
  float f_largest = 0.0;
#ifndef CELLS
  float cut_sin = 0.0, cut_cos = -1.0;  // h >= alpha theta: beyond this angle a camera cannot be among them
#endif
  for (int n = 0; n < candidates.count; ++n) {
    ivec2 candidate = Candidate(candidates, n);
    int j = candidate.x;
    if (j < 0) break;
    vec4 D = CAMERA(j, 0);
#ifndef CELLS
    // Neither this one nor those after it can be among them.
    if (f_largest >= ALPHA_FULL_AT && alpha_weight * BucketEdge(candidate.y) > h[K]) break;
    float s = length(cross(D.xyz, d));
    float c = t - dot(D.xyz, d);
    if (s * cut_cos > c * cut_sin && cut_sin > 0.0 && f_largest >= ALPHA_FULL_AT) continue;
    float theta = Atan(s, c);
#else
    float theta = Theta(D);
#endif
    Seen seen = Project(j, D.w);
    f_largest = max(f_largest, seen.f);
    float hj = Dissimilarity(j, D, theta, seen);
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
#ifndef CELLS
    if (h[K] < kPi * alpha_weight) {
      cut_sin = sin(h[K] / alpha_weight);
      cut_cos = cos(h[K] / alpha_weight);
    }
#endif
  }
  float h1 = h[0];
  if (h1 >= kInfinity) return;
  Window window = WindowAt(h1, h[K]);
  for (int i = 0; i < K; ++i) {
    if (h[i] >= kInfinity) break;
    float w = Weight(window, h[i]);
    if (w <= 0.0) break;
    Seen seen;
    seen.x_px = vec2(0.0);
#if !defined(FALSE_COLOR) || !defined(FIELD_OF_VIEW)
    seen = Project(camera[i], CAMERA(camera[i], 0).w);
#endif
    Add(w, camera[i], seen);
  }
  Close(h1, f_largest);
}
#else
)";

// Of all photos.
constexpr const char* kAll = R"(
float Everything(int j, Seen seen) {
  vec4 D = CAMERA(j, 0);
  return WithVisibility(Dissimilarity(j, D, Theta(D), seen), j, seen);
}
void BlendAt(vec2 at_px) {
  color = vec4(0.0);
  if (!OpenAt(at_px)) return;
  Candidates candidates = CandidatesHere();
  float f_largest = 0.0, h1 = kInfinity;
  for (int n = 0; n < candidates.count; ++n) {
    int j = Candidate(candidates, n).x;
    if (j < 0) break;
    Seen seen = Project(j, CAMERA(j, 0).w);
    f_largest = max(f_largest, seen.f);
    h1 = min(h1, Everything(j, seen));
  }
  if (h1 >= kInfinity) return;
  Window window = WindowAt(h1, kInfinity);
  for (int n = 0; n < candidates.count; ++n) {
    int j = Candidate(candidates, n).x;
    if (j < 0) break;
    Seen seen = Project(j, CAMERA(j, 0).w);
    float h = Everything(j, seen);
    if (h >= kInfinity) continue;
    float w = Weight(window, h);
    if (w <= 0.0) continue;
    Add(w, j, seen);
  }
  Close(h1, f_largest);
}
#endif
)";

constexpr const char* kMain = R"(
#ifdef COMPUTE
void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, picture_rows.x);
  if (at.x >= picture_rows.z || at.y >= picture_rows.y) return;
  BlendAt(vec2(at) + 0.5);
  imageStore(picture, at, color);
}
#else
void main() { BlendAt(gl_FragCoord.xy); }
#endif
)";

std::string BlendShader(const BlendVariant& variant) {
  return shader::Defines(variant) + shader::kCameras + shader::Measures() + shader::Rays() + shader::Photos() +
         shader::Blending();
}

}  // namespace

namespace shader {

std::string Rays() { return kRays; }
std::string Blending() { return std::string(kHead) + kNearest + kAll + kMain; }

}  // namespace shader

std::string BlendFragmentShader(const BlendVariant& variant) {
  BlendVariant fragment = variant;
  fragment.compute = false;
  return BlendShader(fragment);
}
std::string BlendComputeShader(const BlendVariant& variant) {
  BlendVariant compute = variant;
  compute.compute = true;
  return BlendShader(compute);
}

}  // namespace lumi
