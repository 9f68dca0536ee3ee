// Field-of-view value (thesis sec. 4.2.1): 1 inside a photo, 0 outside, a raised cosine between over the feather at its
// border. `edge_px`: distance of the point's image to the nearest border, negative outside.
#pragma once

#include "render/radiance/kernel.h"

namespace lumi {

LUMI_INLINE float FieldOfView(float edge_px, float feather_px) { return RaisedCosine(edge_px / feather_px); }

}  // namespace lumi
