#include "render/gl/shader_parts.h"

namespace lumi {
namespace {

constexpr const char* kCull = R"(
uniform sampler2D depth_map;
uniform mat3 ray_from_pixel;   // to the plane at depth 1
uniform int tile_columns, tile_words; // a tile's list: length, then camera | bucket << 24 with buckets ascending
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

}  // namespace

std::string CullComputeShader(const BlendVariant& variant) {
  return shader::Defines(variant) + shader::kCameras + kCull;
}

}  // namespace lumi
