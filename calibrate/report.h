// report.html of a calibration: one file, readable without a network.
#pragma once

#include <string>

#include "calibrate/calibrate.h"

namespace lumi {

inline constexpr const char* kReportMark = "lumi-calibrate";  // in every report: ours may be written over

std::string ReportHtml(const CalibrateOptions& options, const CalibrateSummary& summary);
// Held-out error and standard deviation of the focal length against the number of views.
std::string TradeoffSvg(const std::vector<ViewCountTrial>& trials);

}  // namespace lumi
