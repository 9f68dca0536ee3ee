// Photos sorted by how near their view as a whole is to the desired one, for methods that choose photos once for each
// picture, not for each ray.
#pragma once

#include <vector>

#include "render/radiance/frame_plan.h"

namespace lumi {

// Median depth of the proxy along the view's axis, over the view's rays; normalised units; 1 if all rays miss it.
double MedianDepth(const ViewSetup& setup, const ProxyTracer& proxy);

struct RankedPhoto {
  std::int32_t photo = 0;
  double distance = 0;  // the baseline's angle at the median depth plus the angle between the axes, rad
};
// All photos in use, nearest first; equal ones by their number.
std::vector<RankedPhoto> RankPhotos(const Sources& sources, const ViewSetup& setup, double median_depth);

// The view's optical axis: unit, in the world's frame.
Eigen::Vector3d AxisOf(const RenderView& view);

}  // namespace lumi
