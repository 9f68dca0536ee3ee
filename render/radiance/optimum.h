// The optimal weights at rays (thesis chapter 4, corrected as docs/optimum.md says): S w = y over the photos within
// settings.cutoff_rad of the ray.
#pragma once

#include "render/radiance/rays.h"
#include "render/radiance/settings.h"
#include "render/radiance/visibility.h"

namespace lumi {

struct ViewSetup;

// What happened, for the summary.
struct OptimumCounts {
  long samples = 0;
  long cameras = 0;         // correlated photos, over all samples
  long nugget_raised = 0;   // S needed more than the standard nugget on its diagonal
  long indefinite = 0;      // eigenvalues were clipped
  long small_sums = 0;      // sum of the weights below kSmallSum before it was made 1
  OptimumCounts& operator+=(const OptimumCounts& o);
};

// Appends nothing, replaces `table`. Neighbouring rays should be neighbours in `rays`: they share work.
void WeighOptimal(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                  OptimumCounts& counts);

}  // namespace lumi
