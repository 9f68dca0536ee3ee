// What accuracy costs, as every stage that measures it shows it: a row a setting, a column a figure, each column
// described once.
//
//   const std::vector<TradeoffField<Row>> fields = {
//       {{"name", TradeoffRole::kSetting, "setting", -20}, &Row::name},
//       {{"seconds", TradeoffRole::kCost, "seconds", 8, "{:.2f}"}, &Row::seconds},
//       {{"error_px", TradeoffRole::kLessIsBetter, "error", 8, "{:.3f} px"}, &Row::error_px}};
//   const TradeoffTable table = TradeoffTableOf(fields, rows);
//   WriteTradeoff(folder / "stage", table, {PlotOf(table, panel)});   // .json, .csv, .svg
//   return TextOf(table);
#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/plot/plot.h"
#include "scene/tradeoff/front.h"

namespace lumi {

// Absent (not in JSON), a truth, a whole number, a number (NaN: null in JSON), a text.
struct TradeoffValue : std::variant<std::monostate, bool, std::int64_t, double, std::string> {
  TradeoffValue() = default;
  // libstdc++ takes a std::variant with a text for one that always has a value. Where memory runs out while such a one
  // is copied, it destroys a value that is not there: the copy is made elsewhere, and moved.
  TradeoffValue(const TradeoffValue& other)
      : variant(std::visit([](const auto& v) { return variant(std::in_place_type<std::decay_t<decltype(v)>>, v); },
                           static_cast<const variant&>(other))) {}
  TradeoffValue(TradeoffValue&&) = default;
  TradeoffValue& operator=(const TradeoffValue& other) { return *this = TradeoffValue(other); }
  TradeoffValue& operator=(TradeoffValue&&) = default;
  ~TradeoffValue() = default;
  TradeoffValue(bool truth) : variant(truth) {}
  TradeoffValue(double number) : variant(number) {}
  TradeoffValue(std::optional<double> number) : variant(number.value_or(CostAndQuality::kNone)) {}
  TradeoffValue(std::string text) : variant(std::move(text)) {}
  TradeoffValue(std::string_view text) : variant(std::string(text)) {}
  TradeoffValue(const char* text) : variant(std::string(text)) {}
  template <std::integral T>
  TradeoffValue(T number) : variant(static_cast<std::int64_t>(number)) {}
};

enum class TradeoffRole {
  kSetting,  // what was varied; failed rows have it too, and their cost
  kCost,
  kLessIsBetter,  // accuracy, as an error
  kMoreIsBetter,  // accuracy
  kFigure,        // what was measured beside these
  kRemark,        // a text at the end of the row; left out where it is empty
  kFailed         // why nothing was measured, at the end of the row too; the row then has no figures
};

struct TradeoffColumn {
  std::string key;  // in JSON, with its unit: "seconds"; "settings.k": k of an object; empty: not in JSON
  TradeoffRole role = TradeoffRole::kFigure;
  std::string heading = {};   // in the text table
  int width = 0;              // in the text table; below 0: aligned to the left, as wide as it needs; 0: not in it
  std::string format = "{}";  // of a number in the text table; one that ends in "%" shows a share
  std::string csv = {};       // name in CSV; empty: the key's last part; "-": not there
};

template <typename Row>
struct TradeoffField {
  TradeoffColumn column;
  std::function<TradeoffValue(const Row&)> value;
};

struct TradeoffTable {
  std::vector<TradeoffColumn> columns;
  std::vector<std::vector<TradeoffValue>> rows = {};              // a value a column
  std::vector<std::pair<std::string, TradeoffValue>> facts = {};  // of all rows: keys beside them in JSON
  std::string rows_key = "points", starred = {};  // in JSON; the column whose true rows begin with a star in the text

  // Throws std::invalid_argument where `row` does not have one value for each column.
  void Add(std::vector<TradeoffValue> row);
  std::size_t Find(const std::string& key) const;                // of a column; throws std::invalid_argument
  double Number(std::size_t row, const std::string& key) const;  // NaN where there is none
  // The Pareto front of the rows by two columns, the cheapest first; the accuracy's role says which direction is
  // better.
  std::vector<std::size_t> Front(const std::string& cost, const std::string& accuracy) const;
  // Sets the column "front", appended where it is not there; its rows are starred.
  void MarkFront(const std::string& cost, const std::string& accuracy);
};

template <typename Row>
TradeoffTable TradeoffTableOf(const std::vector<TradeoffField<Row>>& fields, const std::vector<Row>& rows) {
  TradeoffTable table;
  for (const auto& field : fields) table.columns.push_back(field.column);
  for (const Row& row : rows) {
    std::vector<TradeoffValue> values;
    for (const auto& field : fields) values.push_back(field.value(row));
    table.Add(std::move(values));
  }
  return table;
}

// Points of a plot that look alike.
struct TradeoffSeries {
  std::string is;  // rows whose column `by` has this text
  std::string name = {}, color = "#24292f";
  Marker marker = Marker::kCircle;
  bool line = false;   // through the points in the order of x
  std::string y = {};  // another column than the panel's
  bool dashed = false;
};

struct TradeoffPanel {
  std::string title, subtitle;
  std::string x;  // columns' keys
  PlotAxis x_axis;
  std::string y;
  PlotAxis y_axis;
  std::vector<TradeoffSeries> series;
  std::string by = {};                  // column that tells series apart; empty: all rows are in each
  std::string label = {};               // column whose text stands beside a point, up to a colon; empty: the first
  std::vector<std::size_t> front = {};  // rows drawn as steps, ascending in x
  bool label_front_only = false;
  double least = 0;  // where a logarithmic y axis ends: lesser values are drawn there
  std::vector<PlotMark> marks = {};
};
Plot PlotOf(const TradeoffTable& table, const TradeoffPanel& panel);

// For people: headings, a line a row; no newline at the end.
std::string TextOf(const TradeoffTable& table);
std::string CsvOf(const TradeoffTable& table);
std::string JsonTextOf(const TradeoffTable& table);
JsonKeys KeysOf(const TradeoffTable& table);  // the same, as a value of a summary

struct TradeoffFiles {
  std::filesystem::path json, csv, svg;
};
// STEM.json (`json`; empty: the table's), .csv and .svg, each complete or not there. In a scene's folder `tradeoff`
// they are recorded in its provenance.
TradeoffFiles WriteTradeoff(const std::filesystem::path& stem, const TradeoffTable& table,
                            const std::vector<Plot>& panels, const std::string& json = {});

}  // namespace lumi
