#include "render/tradeoff/table_3_1.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

namespace lumi {

const std::array<TableColumn, kTableColumns>& TableColumns() {
  static const std::array<TableColumn, kTableColumns> columns = {{
      {"photos_used", "unstructured input", "of the photos count at their own place", false, 0.9,
       "cameras anywhere: nearly all of them can contribute"},
      {"covered", "natural navigation", "of what this renderer covers at held-out cameras", false, 0.95,
       "a view that was not photographed is drawn as wholly as any"},
      {"ms", "real-time", "ms a frame, CPU", true, 100, "ten frames a second"},
      {"correspondence_db", "correspondence", "dB that the proxy brings over a plane through the scene", false, 0.5,
       "a difference that can be seen"},
      {"direction_error", "angle-based", "of the error of a texture", true, 0.5,
       "nearer to the view's direction than half way from a texture"},
      {"own_weight", "epipole consistency", "weight of a photo at its own camera", false, 0.99,
       "less than three code values from others"},
      {"ray_difference", "radiance consistency", "change of a weight along its ray", true, 0.01,
       "less than three code values"},
      {"jump", "continuity", "jump of a weight", true, 0.01, "less than three code values"},
      {"border_weight", "field of view", "weight of a photo at its border", true, 0.05, "a border that does not show"},
      {"coarse_weight_ratio", "resolution", "of its weight has a photo four times as far", true, 0.5,
       "a coarse photo leaves most to finer ones"},
      {"hidden_weight", "visibility", "weight of photos that do not see the point", true, 0.05,
       "another surface's colour that does not show"},
  }};
  return columns;
}

const std::vector<TableRow>& TableRows() {
  static const std::vector<TableRow> rows = {
      {"Chen and Williams 1993", "chen-williams-1993", "", "++++---++-+"},
      {"Faugeras and Laveau 1994", "",
       "its colours are those of a pair's dissolve; what it adds, views given by points in two photos, asks for no "
       "proxy",
       "+--+-+++---"},
      {"Levoy and Hanrahan 1996", "levoy-hanrahan-1996", "", "-++--+++---"},
      {"Gortler et al. 1996", "gortler-1996", "", "++++-+++---"},
      {"Debevec et al. 1996", "debevec-1996", "", "++-++++++-+"},
      {"Seitz and Dyer 1996", "seitz-dyer-1996", "", "+--+-+++---"},
      {"Scharstein 1996", "", "over a known surface it blends as Seitz and Dyer do; what differs is its stereo",
       "+--+-+++---"},
      {"Pulli et al. 1997", "pulli-1997", "", "+++++-++++-"},
      {"Chang and Zakhor 1997", "",
       "its colours are those of the nearest photos that see a point, as in Chen and Williams; what differs is its "
       "depth",
       "+--+----+-+"},
      {"Debevec et al. 1998", "debevec-1998", "", "+++++-+-+-+"},
      {"Pighin et al. 1998", "pighin-1998", "", "+++++-++---"},
      {"Heigl et al. 1999", "heigl-1999", "", "++++-+-+---"},
      {"Lhuillier and Quan 1999", "lhuillier-quan-1999", "", "+-++-+++---"},
      {"Wood et al. 2000", "wood-2000", "", "+++++++++-+"},
      {"SIBR (2020)", "sibr-ulr", "", ""},
      {"unstructured lumigraph", "ulr", "", "+++++++++++"},
  };
  return rows;
}

void ListKeys(JsonKeys& j, MethodProperties& p) {
  j("method", p.method);
  for (std::size_t i = 0; i < kTableColumns; ++i) j(TableColumns()[i].key.data(), p.figures[i]);
}
void ListKeys(JsonKeys& j, MethodRefusal& r) { j("method", r.method, "refused", r.refused); }
void ListKeys(JsonKeys& j, SceneFigures& s) { j("scene", s.scene, "properties", s.properties, "methods", s.methods); }

namespace {

bool Holds(const TableColumn& c, double value) {
  return c.less_is_better ? value <= c.threshold : value >= c.threshold;
}

std::string Cell(const std::optional<double>& value, bool whole) {
  if (!value || !std::isfinite(*value)) return "";
  return whole ? fmt::format("{:.0f}", *value) : fmt::format("{:.3g}", *value);
}

const std::array<std::optional<double>, kTableColumns>* Find(const SceneFigures& scene, std::string_view method) {
  for (const MethodProperties& p : scene.properties)
    if (p.method == method) return &p.figures;
  return nullptr;
}

// The worst value over the scenes that have one, and that scene's name.
std::pair<std::optional<double>, std::string> Worst(const std::vector<SceneFigures>& scenes, std::string_view method,
                                                    std::size_t column) {
  std::optional<double> worst;
  std::string where;
  for (const SceneFigures& s : scenes)
    if (const auto* f = Find(s, method))
      if (const auto& v = (*f)[column];
          v && std::isfinite(*v) && (!worst || (TableColumns()[column].less_is_better ? *v > *worst : *v < *worst))) {
        worst = v;
        where = s.scene;
      }
  return {worst, where};
}

std::string RefusedOn(const std::vector<SceneFigures>& scenes, std::string_view method) {
  std::vector<std::string> names;
  for (const SceneFigures& s : scenes)
    for (const MethodRefusal& r : s.methods)
      if (!method.empty() && r.method == method && !r.refused.empty()) names.push_back(s.scene);
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

std::string TableText(const std::vector<SceneFigures>& scenes) {
  const auto& columns = TableColumns();
  std::string text = "| algorithm |";
  for (const TableColumn& c : columns) text += fmt::format(" {} |", c.title);
  text += " thesis differs in | refused on |\n|---|" + std::string();
  for (std::size_t i = 0; i < columns.size() + 2; ++i) text += "---|";
  text += "\n| threshold |";
  for (const TableColumn& c : columns) text += fmt::format(" {} {:g} |", c.less_is_better ? "<=" : ">=", c.threshold);
  text += " | |\n";
  for (const TableRow& row : TableRows()) {
    text += fmt::format("| {} |", row.paper);
    std::string differs;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const bool thesis = !row.ticks.empty() && row.ticks[i] == '+';
      // The thesis's own tick stands in brackets.
      const std::string_view theirs = row.ticks.empty() ? "" : thesis ? " (yes)" : " (no)";
      const auto [value, where] = Worst(scenes, row.method, i);
      if (row.method.empty() || !value) {
        text += fmt::format("{} |", theirs);
        continue;
      }
      const bool tick = Holds(columns[i], *value);
      text += fmt::format(" {} {}{} |", tick ? "**yes**" : "no", Cell(value, i == 2), theirs);
      if (!row.ticks.empty() && tick != thesis)
        differs += fmt::format("{}{} ({})", differs.empty() ? "" : ", ", columns[i].title, where);
    }
    text += fmt::format(" {} | {} |\n", row.method.empty() ? "not measured: " + std::string(row.why_not) : differs,
                        RefusedOn(scenes, row.method));
  }
  for (const SceneFigures& s : scenes) {
    text += fmt::format("\n**{}**\n\n| method |", s.scene);
    for (const TableColumn& c : columns) text += fmt::format(" {} |", c.title);
    text += "\n|---|";
    for (std::size_t i = 0; i < columns.size(); ++i) text += "---|";
    text += "\n";
    for (const auto& [name, figures] : s.properties) {
      text += fmt::format("| {} |", name);
      for (std::size_t i = 0; i < columns.size(); ++i) text += fmt::format(" {} |", Cell(figures[i], i == 2));
      text += "\n";
    }
  }
  return text;
}

}  // namespace lumi
