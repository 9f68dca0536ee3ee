// Probes of a cell of the view's grid, 5 x 5 with those on its borders.
#define PROBES 5
#define UNEVEN 1.1

// The texel that a probe stands on. Both arguments from 0; a probe's middle counts.
ivec2 ProbeTexelOf(ivec2 cell, vec2 probe, ivec2 cells, ivec2 size) {
  vec2 at = (vec2(cell) + probe / float(PROBES - 1)) * vec2(size) / vec2(cells);
  return clamp(ivec2(at), ivec2(0), size - 1);
}
#define ProbeTexel(cell, probe) ProbeTexelOf(cell, vec2(probe), cell_count, size_px)
