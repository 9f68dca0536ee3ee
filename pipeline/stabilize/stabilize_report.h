// OUT-work/report.html and report.json of a stabilised video.
#pragma once

#include <filesystem>

#include "pipeline/stabilize/stabilize_video.h"

namespace lumi {

// Windows, crop, scores, the tracks of each window as filmed and as stabilised. Returns report.html.
std::filesystem::path WriteStabilizeReport(const std::filesystem::path& folder, const StabilizeVideoOptions& options,
                                           const StabilizeVideoSummary& summary);

}  // namespace lumi
