// What speaks for a period, as an SVG.
#pragma once

#include <string>

#include "timeperiodic/period.h"

namespace lumi {

std::string PeriodPlot(const PeriodEstimate& estimate);

}  // namespace lumi
