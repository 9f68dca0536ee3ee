// A cell's photos: those of its samples, each once, the nearest of every sample first, so that what does not fit is what
// ranks last.
layout(location = 0) out uvec4 gathered0;
layout(location = 1) out uvec4 gathered1;
layout(location = 2) out uvec4 gathered2;
layout(location = 3) out uvec4 gathered3;
#if GATHERED > 16
layout(location = 4) out uvec4 gathered4;
layout(location = 5) out uvec4 gathered5;
layout(location = 6) out uvec4 gathered6;
layout(location = 7) out uvec4 gathered7;
#endif
uniform ivec2 cell_count;
uniform usampler2D epipoles;  // of each cell: photos whose centres lie in it, before or behind the view, each from 1
uniform usampler2D lattice0, between0;
#if LISTED > 4
uniform usampler2D lattice1, between1;
#endif
#if LISTED > 8
uniform usampler2D lattice2, between2;
#endif
#if LISTED > 12
uniform usampler2D lattice3, between3;
#endif

uint ids[GATHERED];
int count = 0;

void Take(uint id) {
  id &= 0x7fffu;
  if (id == 0u || count >= GATHERED) return;
  for (int i = 0; i < count; ++i)
    if (ids[i] == id) return;
  ids[count++] = id;
}

#define TAKE_RANKS(lattice, between) \
  for (int rank = 0; rank < 4; ++rank) { \
    for (int i = 0; i < 9; ++i) Take(texelFetch(lattice, 2 * cell + ivec2(i % 3, i / 3), 0)[rank]); \
    for (int i = 0; i < 4; ++i) Take(texelFetch(between, 2 * cell + ivec2(i & 1, i >> 1), 0)[rank]); \
  }

void main() {
  ivec2 cell = ivec2(gl_FragCoord.xy);
  for (int i = 0; i < GATHERED; ++i) ids[i] = 0u;
  uvec4 here = texelFetch(epipoles, cell, 0);
  for (int i = 0; i < 4; ++i) Take(here[i]);
  TAKE_RANKS(lattice0, between0)
#if LISTED > 4
  TAKE_RANKS(lattice1, between1)
#endif
#if LISTED > 8
  TAKE_RANKS(lattice2, between2)
#endif
#if LISTED > 12
  TAKE_RANKS(lattice3, between3)
#endif
  gathered0 = uvec4(ids[0], ids[1], ids[2], ids[3]);
  gathered1 = uvec4(ids[4], ids[5], ids[6], ids[7]);
  gathered2 = uvec4(ids[8], ids[9], ids[10], ids[11]);
  gathered3 = uvec4(ids[12], ids[13], ids[14], ids[15]);
#if GATHERED > 16
  gathered4 = uvec4(ids[16], ids[17], ids[18], ids[19]);
  gathered5 = uvec4(ids[20], ids[21], ids[22], ids[23]);
  gathered6 = uvec4(ids[24], ids[25], ids[26], ids[27]);
  gathered7 = uvec4(ids[28], ids[29], ids[30], ids[31]);
#endif
}
