#include "reconstruct/near_pairs.h"

#include <algorithm>
#include <array>

namespace lumi {

std::vector<std::pair<int, int>> NearPairs(const std::vector<KnownStand>& cameras) {
  constexpr double kLeastCosine = 0.5;
  constexpr std::size_t kNearest = 12;
  constexpr std::array<std::size_t, 5> kFarther{15, 23, 35, 53, 79};
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    std::vector<std::pair<double, int>> others;
    for (std::size_t b = 0; b < cameras.size(); ++b)
      if (b != a && cameras[a].axis_in_world.dot(cameras[b].axis_in_world) >= kLeastCosine)
        others.emplace_back((cameras[a].centre_in_world - cameras[b].centre_in_world).norm(), static_cast<int>(b));
    std::ranges::sort(others);
    const auto add = [&](std::size_t rank) {
      if (rank < others.size()) pairs.emplace_back(std::minmax(static_cast<int>(a), others[rank].second));
    };
    for (std::size_t rank = 0; rank < kNearest; ++rank) add(rank);
    for (const std::size_t rank : kFarther) add(rank);
  }
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace lumi
