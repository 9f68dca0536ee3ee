#include "pipeline/stabilize/score_rows.h"

#include <fmt/format.h>

#include <filesystem>

namespace lumi {

std::vector<ScoreRow> ScoreRows(const sibling::ScoreSummary& score) {
  const auto cell = [](const std::optional<double>& value, int digits) {
    return value ? fmt::format("{:.{}f}", *value, digits) : std::string("-");
  };
  std::vector<ScoreRow> rows;
  for (const sibling::ScoredVideo& v : score.videos)
    rows.push_back({std::filesystem::path(v.file).filename().string(), cell(v.cropping_ratio, 3), cell(v.distortion, 3),
                    cell(v.stability, 3), cell(v.jitter_px, 2), cell(v.kept_area, 3)});
  return rows;
}

}  // namespace lumi
