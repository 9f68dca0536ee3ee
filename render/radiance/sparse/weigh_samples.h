// The one place where the sparse plans ask for weights.
#pragma once

#include "render/radiance/sparse_plan.h"

namespace lumi {

// Weights at `rays`, in chunks that the caller's loop spreads. Replaces `table`; an entry's photos ascend. `counts` is added to.
void WeighSamples(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, const ForRanges& for_ranges,
                  WeightTable& table, OptimumCounts& counts);

}  // namespace lumi
