// From light to code values and back: a pure power. An exposure is then a factor on code values too (View::gain), which
// no curve with a linear toe would give.
#pragma once

#include <cmath>

namespace lumi {

constexpr double kGamma = 2.2;

inline double CodeFromLight(double light) { return light <= 0 ? 0.0 : std::pow(light, 1.0 / kGamma); }
inline float CodeFromLight(float light) {
  return light <= 0 ? 0.0f : std::pow(light, static_cast<float>(1.0 / kGamma));
}
inline double LightFromCode(double code) { return code <= 0 ? 0.0 : std::pow(code, kGamma); }

// Factor on code values of an exposure longer by so many stops.
inline double CodeGainFromStops(double stops) { return std::exp2(stops / kGamma); }

}  // namespace lumi
