// What lumi-stabilize score says of each video, as cells of a table.
#pragma once

#include <string>
#include <vector>

#include "pipeline/sibling_summaries.h"

namespace lumi {

// Each figure with the digits that it is read with; "-" where the score has none (a film too short for a stability, a
// blank one).
struct ScoreRow {
  std::string video;  // file name
  std::string cropping, distortion, stability, jitter_px, kept_area;
};

std::vector<ScoreRow> ScoreRows(const sibling::ScoreSummary& score);

}  // namespace lumi
