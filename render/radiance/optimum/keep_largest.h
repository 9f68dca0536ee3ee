// Fewer photos a sample, without a jump where one enters or leaves: every weight shrinks towards 0 by the same amount.
#pragma once

#include "render/radiance/rays.h"

namespace lumi {

// Keeps the k weights of largest magnitude in each row (k >= 1), each less the k+1st's magnitude (as Eq. 5.1 windows at
// the k+1st); what is then missing from 1 is shared among them in proportion to their magnitudes. A row of k or fewer
// stays as it is. Where k+1 tie for the largest, the first k share: the limit depends on the direction of approach.
void KeepLargest(WeightTable& table, int k);

// Shrinks all weights by `threshold` (>= 0, well below 1 / the photos of a row), which drops those below it; what is
// then missing from 1 is shared likewise. No weight changes by more than the threshold and its share of what all of
// them lost.
void DropSmall(WeightTable& table, float threshold);

}  // namespace lumi
