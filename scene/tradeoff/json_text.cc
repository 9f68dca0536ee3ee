#include <nlohmann/json.hpp>

#include "scene/tradeoff/table.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;

void Put(Json& object, const std::string& key, const TradeoffValue& value) {
  if (key.empty() || std::holds_alternative<std::monostate>(value)) return;
  const std::size_t dot = key.find('.');
  // An object from the start: a null that becomes one while memory runs out crashes where it ends (nlohmann's
  // JSON 3.11).
  if (dot != std::string::npos)
    return Put(*object.emplace(key.substr(0, dot), Json::object()).first, key.substr(dot + 1), value);
  std::visit(
      [&](const auto& v) {
        if constexpr (!std::is_same_v<std::decay_t<decltype(v)>, std::monostate>) object[key] = v;
      },
      static_cast<const TradeoffValue::variant&>(value));
}

}  // namespace

std::string JsonTextOf(const TradeoffTable& table) {
  Json json = Json::object();
  for (const auto& [key, value] : table.facts) Put(json, key, value);
  Json& rows = json[table.rows_key] = Json::array();
  for (const auto& values : table.rows) {
    Json& row = rows.emplace_back(Json::object());
    for (std::size_t c = 0; c < table.columns.size(); ++c) Put(row, table.columns[c].key, values[c]);
  }
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

JsonKeys KeysOf(const TradeoffTable& table) { return JsonKeys::Parse(JsonTextOf(table)).value(); }

}  // namespace lumi
