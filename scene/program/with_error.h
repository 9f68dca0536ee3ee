// A measured value beside its standard deviation.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

namespace lumi {

// Both to the deviation's second digit: "15.370012 +- 0.000031". Without a deviation (0, not finite) the value alone.
inline std::string WithError(double value, double sigma, std::string_view between = " +- ") {
  if (!(sigma > 0) || !std::isfinite(sigma)) return fmt::format("{:.6g}", value);
  constexpr int kMostDecimals = 9;
  const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(sigma))), 0, kMostDecimals);
  return fmt::format("{:.{}f}{}{:.{}f}", value, decimals, between, sigma, decimals);
}

}  // namespace lumi
