#include "render/settings_json.h"

#include <nlohmann/json.hpp>

namespace lumi {

using Json = nlohmann::ordered_json;

Json ToJson(const RadianceSettings& settings) {
  Json j = Json::object();
  for (const SettingOption& o : SettingOptions()) {
    const OptionValue v = o.get(settings);
    const auto* number = std::get_if<double>(&v);
    j[o.name] = number ? Json(*number) : o.name == "k" && settings.k > 0 ? Json(settings.k) : Json(Text(v));
  }
  return j;
}

bool SetOption(RadianceSettings& settings, const std::string& name, const Json& value) {
  const SettingOption* option = FindSettingOption(name);
  if (!option) return false;
  option->set(settings, value.is_boolean()        ? OptionValue(value.get<bool>())
                        : value.is_number_float() ? OptionValue(value.get<double>())
                        : value.is_string()       ? OptionValue(value.get<std::string>())
                                                  : OptionValue(value.dump()));
  return true;
}

}  // namespace lumi
