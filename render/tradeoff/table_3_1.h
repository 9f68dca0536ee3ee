// The thesis's Table 3.1 as figures: for each method a number for each of its eleven columns, a threshold, and the tick
// that follows, beside the thesis's own. docs/methods.md says what each number is.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/tradeoff/ray_bench.h"
#include "scene/files/json_keys.h"

namespace lumi {

// The columns that rays tell of; pictures tell of navigation, time and correspondence (methods.cc).
struct RayFigures {
  std::optional<double> photos_used;      // share of the cameras whose photo counts near its own place
  std::optional<double> direction_error;  // of a colour that is the direction itself, over that of the mean of all
  std::optional<double> own_weight;       // of a photo at its own camera, lower 5 %
  std::optional<double> ray_difference;   // of a weight for one ray from two places on it, upper 5 %
  std::optional<double> jump;             // of a weight over a step of 1e-7 scene sizes, largest on 20 ways
  std::optional<double> border_weight;    // of a photo at its border, upper 5 %
  std::optional<double>
      coarse_weight_ratio;              // of a photo's weight, once it is four times as far on its own ray; median
  std::optional<double> hidden_weight;  // of photos from which the proxy hides the point; mean
};
// Of these settings, by random rays. Throws what the method does where it takes no view of this scene at all.
RayFigures MeasureRays(const RayBench& bench, const RadianceSettings& settings);

// A column of the table: what decides.
struct TableColumn {
  std::string_view key, title, unit_or_share;
  bool less_is_better = false;
  double threshold = 0;
  std::string_view reason;  // of the threshold
};
constexpr std::size_t kTableColumns = 11;
const std::array<TableColumn, kTableColumns>& TableColumns();

// A row of the thesis's table.
struct TableRow {
  std::string_view paper;   // as the thesis cites it
  std::string_view method;  // by --method's name; empty: not measured, and why:
  std::string_view why_not;
  std::string_view ticks;  // of the thesis, a letter a column: + or -
};
// The fourteen, then the thesis's own algorithm and SIBR's, which it does not have.
const std::vector<TableRow>& TableRows();

// A method's row of the table on a scene, by column, and all of a scene, as methods --properties writes them.
struct MethodProperties {
  std::string method;
  std::array<std::optional<double>, kTableColumns> figures = {};
};
struct SceneFigures {
  std::string scene;
  std::vector<MethodProperties> properties;
};
void ListKeys(JsonKeys& j, MethodProperties& p);
void ListKeys(JsonKeys& j, SceneFigures& s);
// Markdown: the table of ticks (the worst scene decides), then a table of figures a scene.
std::string TableText(const std::vector<SceneFigures>& scenes);

}  // namespace lumi
