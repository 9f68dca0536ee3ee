#include "scene/program/with_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lumi {

std::string WithError(double value, double sigma, std::string_view between) {
  if (!(sigma > 0) || !std::isfinite(sigma)) return fmt::format("{:.6g}", value);
  constexpr int kMostDecimals = 9;
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(sigma)));
  if (decimals > kMostDecimals) return fmt::format("{:.{}f}{}{:.2g}", value, kMostDecimals, between, sigma);
  return fmt::format("{:.{}f}{}{:.{}f}", value, std::max(decimals, 0), between, sigma, std::max(decimals, 0));
}

}  // namespace lumi
