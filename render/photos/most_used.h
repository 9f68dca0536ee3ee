// Orders photos by how often they are used.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace lumi {

// Each of `cameras` once, those that occur most often first; of equals the lower number.
std::vector<std::int32_t> MostUsedFirst(std::span<const std::int32_t> cameras);

}  // namespace lumi
