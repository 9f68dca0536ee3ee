#include "render/photos/most_used.h"

#include <algorithm>
#include <functional>
#include <map>

namespace lumi {

std::vector<std::int32_t> MostUsedFirst(std::span<const std::int32_t> cameras) {
  std::map<std::int32_t, long> often;
  for (const std::int32_t c : cameras) ++often[c];
  std::vector<std::int32_t> order;
  for (const auto& [c, n] : often) order.push_back(c);
  std::ranges::stable_sort(order, std::greater<>(), [&](std::int32_t c) { return often[c]; });
  return order;
}

}  // namespace lumi
