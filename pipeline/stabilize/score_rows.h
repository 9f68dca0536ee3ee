// What lumi-stabilize score says of each video, as cells of a table.
#pragma once

#include <string>
#include <vector>

namespace lumi {

// Each figure with the digits that it is read with; "-" where the score has none (a film too short for a stability, a blank one).
struct ScoreRow {
  std::string video;  // file name
  std::string cropping, distortion, stability, jitter_px, kept_area;
};

// `score_json`: the program's summary; no rows where it is empty.
std::vector<ScoreRow> ScoreRows(const std::string& score_json);

}  // namespace lumi
