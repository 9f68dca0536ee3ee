#include "scene/tradeoff/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"

namespace lumi {
namespace {

bool IsText(TradeoffRole role) { return role == TradeoffRole::kRemark || role == TradeoffRole::kFailed; }
bool IsOfSetting(TradeoffRole role) { return role == TradeoffRole::kSetting || role == TradeoffRole::kCost; }

double NumberOf(const TradeoffValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  const auto* number = std::get_if<double>(&value);
  return number != nullptr ? *number : CostAndQuality::kNone;
}

std::string TextOf(const TradeoffValue& value) {
  const auto* text = std::get_if<std::string>(&value);
  return text != nullptr ? *text : std::string();
}

bool IsTrue(const TradeoffValue& value) {
  const auto* truth = std::get_if<bool>(&value);
  return truth != nullptr && *truth;
}

std::string CellOf(const TradeoffColumn& column, const TradeoffValue& value) {
  if (std::holds_alternative<std::string>(value)) return TextOf(value);
  if (std::holds_alternative<bool>(value)) return IsTrue(value) ? "yes" : "no";
  const double number = NumberOf(value);
  if (!std::isfinite(number)) return "-";
  if (column.format == "{}" && std::holds_alternative<std::int64_t>(value))
    return fmt::format("{}", std::get<std::int64_t>(value));
  return fmt::format(fmt::runtime(column.format), column.format.ends_with('%') ? 100 * number : number);
}

std::string CsvCellOf(const TradeoffValue& value) {
  if (std::holds_alternative<bool>(value)) return IsTrue(value) ? "1" : "0";
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *whole);
  if (std::holds_alternative<double>(value))
    return std::isfinite(NumberOf(value)) ? fmt::format("{:.7g}", NumberOf(value)) : "";
  const std::string text = TextOf(value);
  if (text.find_first_of(" ,\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

// Why a row has no figures; empty: it has.
std::string FailureOf(const TradeoffTable& table, const std::vector<TradeoffValue>& row) {
  std::string failure;
  for (std::size_t c = 0; c < row.size(); ++c)
    if (table.columns[c].role == TradeoffRole::kFailed) failure += TextOf(row[c]);
  return failure;
}

}  // namespace

void TradeoffTable::Add(std::vector<TradeoffValue> row) {
  if (row.size() != columns.size()) throw std::invalid_argument("TradeoffTable::Add: a value a column");
  const bool failed = !FailureOf(*this, row).empty();
  for (std::size_t c = 0; c < row.size(); ++c) {
    const TradeoffRole role = columns[c].role;
    const bool kept = IsText(role) ? !TextOf(row[c]).empty() : !failed || IsOfSetting(role);
    if (!kept) row[c] = {};
  }
  rows.push_back(std::move(row));
}

std::size_t TradeoffTable::Find(const std::string& key) const {
  for (std::size_t c = 0; c < columns.size(); ++c)
    if (columns[c].key == key) return c;
  throw std::invalid_argument("TradeoffTable: no column " + key);
}

double TradeoffTable::Number(std::size_t row, const std::string& key) const { return NumberOf(rows[row][Find(key)]); }

std::vector<std::size_t> TradeoffTable::Front(const std::string& cost, const std::string& accuracy) const {
  const double sign = columns[Find(accuracy)].role == TradeoffRole::kMoreIsBetter ? 1 : -1;
  std::vector<CostAndQuality> axes;
  for (std::size_t row = 0; row < rows.size(); ++row) axes.push_back({Number(row, cost), sign * Number(row, accuracy)});
  return ParetoFront(axes);
}

void TradeoffTable::MarkFront(const std::string& cost, const std::string& accuracy) {
  const std::vector<std::size_t> front = Front(cost, accuracy);
  starred = "front";
  std::size_t column = 0;
  while (column < columns.size() && columns[column].key != starred) ++column;
  if (column == columns.size()) columns.push_back({starred});
  for (auto& row : rows) {
    row.resize(columns.size());
    if (FailureOf(*this, row).empty()) row[column] = false;
  }
  for (const std::size_t i : front) rows[i][column] = true;
}

std::string TextOf(const TradeoffTable& table) {
  const std::size_t star = table.starred.empty() ? table.columns.size() : table.Find(table.starred);
  std::vector<std::size_t> shown;
  std::vector<int> widths;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const TradeoffColumn& column = table.columns[c];
    if (column.width == 0) continue;
    std::size_t width = static_cast<std::size_t>(std::abs(column.width));
    if (column.width < 0)
      for (const auto& row : table.rows) width = std::max(width, CellOf(column, row[c]).size());
    shown.push_back(c);
    widths.push_back(static_cast<int>(width));
  }
  const auto padded = [&](std::size_t i, const std::string& cell) {
    return fmt::format(fmt::runtime(table.columns[shown[i]].width < 0 ? "{:<{}}" : "{:>{}}"), cell, widths[i]);
  };
  const bool stars = star < table.columns.size();
  std::string text = stars ? " " : "";
  for (std::size_t i = 0; i < shown.size(); ++i)
    text += (i > 0 || stars ? " " : "") + padded(i, table.columns[shown[i]].heading);
  for (const auto& row : table.rows) {
    text += std::string("\n") + (!stars ? "" : IsTrue(row[star]) ? "*" : " ");
    const bool failed = !FailureOf(table, row).empty();
    for (std::size_t i = 0; i < shown.size() && (!failed || IsOfSetting(table.columns[shown[i]].role)); ++i)
      text += (i > 0 || stars ? " " : "") + padded(i, CellOf(table.columns[shown[i]], row[shown[i]]));
    for (std::size_t c = 0; c < row.size(); ++c)
      if (const std::string remark = TextOf(row[c]); IsText(table.columns[c].role) && !remark.empty())
        text += (table.columns[c].role == TradeoffRole::kFailed ? " " : "  ") +
                fmt::format(fmt::runtime(table.columns[c].format), remark);
  }
  return text;
}

std::string CsvOf(const TradeoffTable& table) {
  std::vector<std::size_t> written;
  std::string csv;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const TradeoffColumn& column = table.columns[c];
    const std::string name = column.csv.empty() ? column.key.substr(column.key.rfind('.') + 1) : column.csv;
    if (name.empty() || name == "-") continue;
    csv += (written.empty() ? "" : ",") + name;
    written.push_back(c);
  }
  csv += "\n";
  for (const auto& row : table.rows)
    for (const std::size_t c : written) csv += CsvCellOf(row[c]) + (c == written.back() ? "\n" : ",");
  return csv;
}

Plot PlotOf(const TradeoffTable& table, const TradeoffPanel& panel) {
  Plot plot{panel.title, panel.subtitle, panel.x_axis, panel.y_axis, {}, panel.marks};
  const std::size_t label = panel.label.empty() ? 0 : table.Find(panel.label);
  const auto y_of = [&](std::size_t row, const std::string& key) {
    const double y = table.Number(row, key);
    return panel.least > 0 && y < panel.least ? panel.least : y;
  };
  if (!panel.front.empty()) {
    PlotSeries front{"front", "#57606a", Marker::kNone, true, true, false, {}};
    for (const std::size_t row : panel.front)
      front.points.push_back({table.Number(row, panel.x), y_of(row, panel.y), {}, {}});
    plot.series.push_back(std::move(front));
  }
  for (const TradeoffSeries& s : panel.series) {
    PlotSeries series{s.name.empty() ? s.is : s.name, s.color, s.marker, s.line, false, s.dashed, {}};
    const std::string& key = s.y.empty() ? panel.y : s.y;
    for (std::size_t row = 0; row < table.rows.size(); ++row) {
      if (!panel.by.empty() && TextOf(table.rows[row][table.Find(panel.by)]) != s.is) continue;
      const double x = table.Number(row, panel.x), y = y_of(row, key);
      if (!std::isfinite(x) || !std::isfinite(y)) continue;
      const auto text = [&](std::size_t c) { return CellOf(table.columns[c], table.rows[row][c]); };
      const std::string name = text(label), tip = label == 0 ? name : text(0) + " " + name;
      const bool labelled =
          !panel.label_front_only || std::find(panel.front.begin(), panel.front.end(), row) != panel.front.end();
      series.points.push_back(
          {x, y, labelled ? name.substr(0, name.find(':')) : "",
           fmt::format("{}: {} {:.4g}, {} {:.4g}", tip, panel.x_axis.label, x, panel.y_axis.label, y)});
    }
    if (s.line) std::ranges::stable_sort(series.points, {}, &PlotPoint::x);
    if (!series.points.empty()) plot.series.push_back(std::move(series));
  }
  return plot;
}

TradeoffFiles WriteTradeoff(const std::filesystem::path& stem, const TradeoffTable& table,
                            const std::vector<Plot>& panels, const std::string& json) {
  TradeoffFiles files{stem.string() + ".json", stem.string() + ".csv", stem.string() + ".svg"};
  WriteTextAtomically(files.json, json.empty() ? JsonTextOf(table) : json);
  WriteTextAtomically(files.csv, CsvOf(table));
  WriteTextAtomically(files.svg, SvgOf(panels));
  if (const std::filesystem::path folder = stem.parent_path(); folder.filename() == "tradeoff")
    RecordMeasured(folder.parent_path(), stem.filename().string(), {files.json, files.csv, files.svg});
  return files;
}

}  // namespace lumi
