// Photos in the order of how near their whole view is to the one that is wanted: for methods that choose photos once a
// picture, not once a ray.
#pragma once

#include <vector>

#include "render/radiance/frame_plan.h"

namespace lumi {

// Of the proxy along the view's axis, the median over the view's rays, normalised units; 1 where all miss it.
double MedianDepth(const ViewSetup& setup, const ProxyTracer& proxy);

struct RankedPhoto {
  std::int32_t photo = 0;
  double distance = 0;  // the angle that the baseline subtends at the median depth, and between the axes, rad
};
// All photos in use, nearest first; equal ones by their number.
std::vector<RankedPhoto> RankPhotos(const Sources& sources, const ViewSetup& setup, double median_depth);

// Of a view, unit, in the world's frame.
Eigen::Vector3d AxisOf(const RenderView& view);

}  // namespace lumi
