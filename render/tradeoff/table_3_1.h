// The thesis's Table 3.1 as figures: for each method a number for each of its eleven columns, a threshold, and the tick
// that follows, beside the thesis's own. docs/methods.md says what each number is.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/files/json_keys.h"

namespace lumi {

// A column of the table and its threshold.
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
// The thesis's fourteen methods, its own algorithm, then SIBR's, which the thesis does not list.
const std::vector<TableRow>& TableRows();

// A method's row of the table on a scene, by column, and all of a scene, as methods --properties writes them.
struct MethodProperties {
  std::string method;
  std::array<std::optional<double>, kTableColumns> figures = {};
};
struct MethodRefusal {
  std::string method, refused;  // why; empty: it was not
};
struct SceneFigures {
  std::string scene;
  std::vector<MethodProperties> properties;
  std::vector<MethodRefusal> methods = {};
};
void ListKeys(JsonKeys& j, MethodProperties& p);
void ListKeys(JsonKeys& j, MethodRefusal& r);
void ListKeys(JsonKeys& j, SceneFigures& s);
// Markdown: the table of ticks (the worst scene decides; scenes that a method refused are named), then a table of
// figures a scene.
std::string TableText(const std::vector<SceneFigures>& scenes);

}  // namespace lumi
