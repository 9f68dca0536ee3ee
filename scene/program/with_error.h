// A measured value beside its standard deviation.
#pragma once

#include <string>
#include <string_view>

namespace lumi {

// Both to the deviation's second digit: "15.370012 +- 0.000031". Without a deviation (0, not finite) the value alone.
std::string WithError(double value, double sigma, std::string_view between = " +- ");

}  // namespace lumi
