// A period that was filmed about once: how alike a video is to itself, shifted by whole frames.
#pragma once

#include <optional>
#include <vector>

#include "timeperiodic/period.h"

namespace lumi {

// Correlation of the signals with themselves for shifts of 0, 1 ... frames, max_shift at most.
std::vector<double> SelfSimilarity(const Signals& signals, Eigen::Index max_shift);

// The shortest shift at which the video is as like itself as at any. Its standard deviation: how far it moves as parts
// of the video are left out, or how far the frames' own best shifts disagree where that is more. similarity:
// SelfSimilarity's. None where no shift stands out.
std::optional<PeriodEstimate> FromFewCycles(const Signals& signals, const std::vector<double>& similarity);

}  // namespace lumi
