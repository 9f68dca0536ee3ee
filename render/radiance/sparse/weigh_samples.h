// The one place where the sparse plans ask for weights.
#pragma once

#include "render/radiance/sparse/sparse_plan.h"

namespace lumi {

// How far inside the view a sample on its border is weighed, px: a photo taken from here contains it for certain,
// whatever the rounding of its border.
constexpr double kInsidePx = 1.0 / 64;

// The vertices of a tessellation as rays.
RaySamples VertexRays(const ViewSetup& setup, const SparseGeometry& geometry);

// Weights at `rays`, in chunks that the caller's loop spreads. Replaces `table`; an entry's photos ascend. `counts` is
// added to.
void WeighSamples(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays,
                  const ForRanges& for_ranges, WeightTable& table, OptimumCounts& counts);

}  // namespace lumi
