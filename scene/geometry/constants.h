// Numbers that have one name in the whole suite.
#pragma once

#include <numbers>

namespace lumi {

inline constexpr double kRadPerDeg = std::numbers::pi / 180;
inline constexpr double kDegPerRad = 180 / std::numbers::pi;

// A normal distribution's standard deviation over its median absolute deviation.
inline constexpr double kSigmaPerMad = 1.4826;

}  // namespace lumi
