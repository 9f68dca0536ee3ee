// A table of rows that are JSON. The header does not include the library: whoever has such rows does.
#pragma once

#include "scene/tradeoff/table.h"

namespace lumi {

// Reads the column's key.
template <typename Json>
TradeoffField<Json> FromJson(const TradeoffColumn& column) {
  return {column, [key = column.key](const Json& row) -> TradeoffValue {
            const Json* value = &row;
            for (std::size_t begin = 0, end = 0; end != std::string::npos; begin = end + 1) {
              end = key.find('.', begin);
              const auto found = value->find(key.substr(begin, end - begin));
              if (found == value->end()) return {};
              value = &*found;
            }
            if (value->is_boolean()) return value->template get<bool>();
            if (value->is_number_integer()) return value->template get<std::int64_t>();
            if (value->is_string()) return value->template get<std::string>();
            return value->is_number() ? value->template get<double>() : CostAndQuality::kNone;
          }};
}

// Each column's value by its key.
template <typename Json>
void AddRows(const Json& rows, TradeoffTable& table) {
  for (const Json& row : rows) {
    std::vector<TradeoffValue> values;
    for (const TradeoffColumn& column : table.columns) values.push_back(FromJson<Json>(column).value(row));
    table.Add(std::move(values));
  }
}

}  // namespace lumi
