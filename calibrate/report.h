// report.html of a calibration: one file, readable without a network.
#pragma once

#include <string>
#include <vector>

#include "calibrate/calibrate.h"
#include "scene/tradeoff/table.h"

namespace lumi {

inline constexpr const char* kReportMark = "lumi-calibrate";  // in every report: ours may be written over

std::string ReportHtml(const CalibrateOptions& options, const CalibrateSummary& summary);

// Models against error and seconds.
TradeoffTable ModelTable(const FitResult& fit = {});
// Held-out error and standard deviation of the focal length against the number of views.
TradeoffTable ViewCountTable(const std::vector<ViewCountTrial>& trials = {});
std::vector<Plot> ViewCountPlots(const TradeoffTable& table);

}  // namespace lumi
