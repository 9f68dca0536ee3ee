// The weights of the photos at any rays of a view, by any settings: the k nearest, all, or the optimum.
#pragma once

#include "render/radiance/frame_plan.h"
#include "render/radiance/optimum/optimum.h"
#include "render/radiance/rays.h"

namespace lumi {

// Replaces what `table` holds. For the optimum, `counts` is added to.
void Reconstruct(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                 OptimumCounts& counts, WeighScratch& scratch);

}  // namespace lumi
