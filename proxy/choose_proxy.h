// Which of the proxies that were measured becomes the active one.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "proxy/summaries.h"

namespace lumi {

// One of table.candidates, which has one that is not refused, and why it. Of those within the budget (milliseconds a
// frame) the highest PSNR; of those that are no further than kSamePsnrDb below it the highest SSIM; of equals fewer
// faces. Where the photos have silhouettes PSNR is over the object's pixels and decides alone: around the object a hull
// shows nothing, and holes count as black. Where nothing is within the budget the fastest; where nothing was measured
// the mesh through the points, or the last that there is.
std::pair<const ProxyCandidate*, std::string> ChooseProxy(const AutoTable& table, std::optional<double> budget_ms);

// A proxy is often chosen on one or two photos, whose PSNR cannot tell smaller differences: a blurred edge may be ahead
// of a sharp one that is off by a pixel. SSIM counts the structure.
inline constexpr double kSamePsnrDb = 0.25;

}  // namespace lumi
