#include "render/radiance/optimum/coherent_order.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace lumi {
namespace {

struct Key {
  Eigen::Vector3f p;
  std::uint32_t ray;
};

void Split(std::span<Key> keys, std::size_t group) {
  if (keys.size() <= group) return;
  Eigen::Vector3f lo = keys[0].p, hi = lo;
  for (const Key& k : keys) {
    lo = lo.cwiseMin(k.p);
    hi = hi.cwiseMax(k.p);
  }
  Eigen::Index axis = 0;
  (hi - lo).maxCoeff(&axis);
  const std::size_t groups = (keys.size() + group - 1) / group, half = groups / 2 * group;
  // Ties by index: the same order on every machine.
  std::nth_element(
      keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(half), keys.end(),
      [axis](const Key& a, const Key& b) { return a.p[axis] != b.p[axis] ? a.p[axis] < b.p[axis] : a.ray < b.ray; });
  Split(keys.first(half), group);
  Split(keys.subspan(half), group);
}

}  // namespace

std::vector<std::uint32_t> CoherentOrder(const RaySamples& rays, std::size_t group) {
  std::vector<Key> keys;
  keys.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    if (rays.t[i] > 0 && std::isfinite(rays.t[i]))
      keys.push_back({rays.t[i] * rays.direction[i], static_cast<std::uint32_t>(i)});
  Split(keys, group);
  std::vector<std::uint32_t> order;
  order.reserve(keys.size());
  for (const Key& k : keys) order.push_back(k.ray);
  return order;
}

}  // namespace lumi
