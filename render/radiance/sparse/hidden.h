// Triangles of a fine mesh that others hide need no weights.
#pragma once

#include "render/radiance/sparse/sparse_plan.h"

namespace lumi {

// Drops triangles that are behind others at every pixel, and vertices that no triangle is left of. What lies within a
// hundredth of the nearest depth stays, so that another rasteriser's rounding finds every triangle it wants.
void DropHidden(const ViewSetup& setup, const ForRanges& for_ranges, SparseGeometry& geometry);

}  // namespace lumi
