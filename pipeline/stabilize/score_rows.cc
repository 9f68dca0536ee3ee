#include "pipeline/stabilize/score_rows.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

namespace lumi {

std::vector<ScoreRow> ScoreRows(const std::string& score_json) {
  const nlohmann::json score = nlohmann::json::parse(score_json, nullptr, false);
  std::vector<ScoreRow> rows;
  if (!score.is_object() || !score.contains("videos")) return rows;
  for (const nlohmann::json& video : score["videos"]) {
    const auto cell = [&](const char* key, int digits) {
      const auto at = video.find(key);
      return at != video.end() && at->is_number() ? fmt::format("{:.{}f}", at->get<double>(), digits) : std::string("-");
    };
    rows.push_back({std::filesystem::path(video.value("file", "")).filename().string(), cell("cropping_ratio", 3), cell("distortion", 3), cell("stability", 3), cell("jitter_px", 2),
                    cell("kept_area", 3)});
  }
  return rows;
}

}  // namespace lumi
