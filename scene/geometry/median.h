// Medians and other quantiles, by selection.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace lumi {

// The value that has `place` others at or below it, place < values.size(); 0 for no values at all.
template <typename T = double>
T NthSmallest(std::vector<T> values, std::size_t place) {
  if (values.empty()) return T{};
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Of an even number the upper of the two in the middle; 0 for none.
template <typename T = double>
T Median(std::vector<T> values) {
  const std::size_t middle = values.size() / 2;
  return NthSmallest(std::move(values), middle);
}

// The value at or below which `fraction` (0 to 1) of the others lie; 0 for none. Quantile(v, 0.5) of an even number is
// the lower of the two in the middle.
template <typename T = double>
T Quantile(std::vector<T> values, double fraction) {
  const double last = values.empty() ? 0 : static_cast<double>(values.size() - 1);
  const auto place = static_cast<std::size_t>(std::clamp(fraction, 0.0, 1.0) * last);
  return NthSmallest(std::move(values), place);
}

}  // namespace lumi
