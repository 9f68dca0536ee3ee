// Rays ordered so that consecutive ones meet the proxy close together.
#pragma once

#include <cstdint>
#include <vector>

#include "render/radiance/rays.h"

namespace lumi {

// The rays that meet the proxy, such that every run of `group` (starting at a multiple of it) is a cell of a k-d tree
// over the proxy points, and so are runs of twice, four times ... as many.
std::vector<std::uint32_t> CoherentOrder(const RaySamples& rays, std::size_t group);

}  // namespace lumi
