// The photos that the pixel of a sample would be blended from, and SPARE more: its LISTED nearest, each from 1.
// LATTICE: samples at the cells' corners, and between them where a cell is uneven. Else four of a cell: the nearest and
// the farthest probe, and two more in cells with holes.
layout(location = 0) out uvec4 listed0;  // bit 15 of the first: the sample is seen by no photo to the full
#if LISTED > 4
layout(location = 1) out uvec4 listed1;
#endif
#if LISTED > 8
layout(location = 2) out uvec4 listed2;
#endif
#if LISTED > 12
layout(location = 3) out uvec4 listed3;
#endif
uniform ivec2 cell_count, size_px;
uniform usampler2D spreads;
#ifndef LATTICE
uniform usampler2D lattice;  // the first of its textures
#endif

// The texel to sample; (-1, -1): none.
ivec2 SampleTexel(ivec2 at) {
#ifdef LATTICE
  ivec2 odd = at & 1, cell = at >> 1;
  if (odd == ivec2(0)) return ProbeTexel(min(cell, cell_count - 1), vec2(cell - min(cell, cell_count - 1)) * float(PROBES - 1));
  // Between the corners only where one of the cells beside is uneven.
  bool wanted = false;
  for (int i = 0; i < 4; ++i) {
    ivec2 beside = cell - (1 - odd) * ivec2(i & 1, i >> 1);
    if (all(greaterThanEqual(beside, ivec2(0))) && all(lessThan(beside, cell_count))) {
      uvec4 s = texelFetch(spreads, beside, 0);
      wanted = wanted || s.z + s.w > 0u;
    }
  }
  if (!wanted) return ivec2(-1);
  ivec2 inside = min(cell, cell_count - 1);
  return ProbeTexel(inside, (vec2(cell - inside) + 0.5 * vec2(odd)) * float(PROBES - 1));
#else
  ivec2 cell = at >> 1, which = at & 1;
  uvec4 s = texelFetch(spreads, cell, 0);
  if (which.y == 0) {
    uint probe = which.x == 0 ? s.x : s.y;
    if (probe == 0u || (s.z == 0u && s.w == 0u)) return ivec2(-1);
    return ProbeTexel(cell, vec2(int(probe - 1u) % PROBES, int(probe - 1u) / PROBES));
  }
  bool hole = false;
  for (int i = 0; i < 9; ++i)
    hole = hole || (texelFetch(lattice, 2 * cell + ivec2(i % 3, i / 3), 0).x & 0x8000u) != 0u;
  return hole ? ProbeTexel(cell, vec2(which.x == 0 ? 1.0 : 3.0, which.x == 0 ? 3.0 : 1.0)) : ivec2(-1);
#endif
}

void main() {
  listed0 = uvec4(0u);
#if LISTED > 4
  listed1 = uvec4(0u);
#endif
#if LISTED > 8
  listed2 = uvec4(0u);
#endif
#if LISTED > 12
  listed3 = uvec4(0u);
#endif
  ivec2 texel = SampleTexel(ivec2(gl_FragCoord.xy));
  if (texel.x < 0 || !OpenAt(vec2(texel) + 0.5)) return;
  float h[LISTED];
  int camera[LISTED];
  for (int i = 0; i < LISTED; ++i) {
    h[i] = kInfinity;
    camera[i] = -1;
  }
  float f_largest = 0.0;
  for (int j = 0; j < camera_count; ++j) {
    if (FETCH(places, j).x == 0u) continue;  // not loaded
    vec4 D = CAMERA(j, 0);
    Seen seen = Project(j, D.w);
    f_largest = max(f_largest, seen.f);
    float hj = Dissimilarity(j, D, Theta(D), seen);
    if (hj >= h[LISTED - 1]) continue;
    hj = WithVisibility(hj, j, seen);
    if (hj >= h[LISTED - 1]) continue;
    int cj = j;
    for (int i = 0; i < LISTED; ++i) {
      bool less = hj < h[i];
      float hi = h[i];
      int ci = camera[i];
      h[i] = less ? hj : hi;
      camera[i] = less ? cj : ci;
      hj = less ? hi : hj;
      cj = less ? ci : cj;
    }
  }
  uint ids[16];
  for (int i = 0; i < 16; ++i) ids[i] = 0u;
  for (int i = 0; i < LISTED; ++i) ids[i] = uint(camera[i] + 1);
  if (f_largest < ALPHA_FULL_AT) ids[0] |= 0x8000u;
  listed0 = uvec4(ids[0], ids[1], ids[2], ids[3]);
#if LISTED > 4
  listed1 = uvec4(ids[4], ids[5], ids[6], ids[7]);
#endif
#if LISTED > 8
  listed2 = uvec4(ids[8], ids[9], ids[10], ids[11]);
#endif
#if LISTED > 12
  listed3 = uvec4(ids[12], ids[13], ids[14], ids[15]);
#endif
}
