// Of each cell: where the proxy is nearest and farthest among 5 x 5 probes, and whether their depths differ much or some
// probes miss it (render/radiance/sparse/candidate_plan.cc, FromRays).
layout(location = 0) out uvec4 spread;  // probe of the nearest and of the farthest, from 1; 1: uneven; 1: a miss
uniform sampler2D depth_map;
uniform ivec2 cell_count, size_px;

void main() {
  ivec2 cell = ivec2(gl_FragCoord.xy);
  float nearest = kInfinity, farthest = 0.0;
  uint near = 0u, far = 0u, missed = 0u;
  for (int i = 0; i < PROBES * PROBES; ++i) {
    float depth = texelFetch(depth_map, ProbeTexel(cell, ivec2(i % PROBES, i / PROBES)), 0).r;
    if (depth <= 0.0) {
      missed = 1u;
      continue;
    }
    if (depth < nearest) { nearest = depth; near = uint(i) + 1u; }
    if (depth > farthest) { farthest = depth; far = uint(i) + 1u; }
  }
  spread = uvec4(near, far, farthest > UNEVEN * nearest ? 1u : 0u, missed);
}
