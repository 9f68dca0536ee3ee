// RadianceSettings as an object of lumi-render's own option names and values, as its summaries print them, fronts keep them
// and --settings takes them back.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "render/radiance/settings.h"

namespace lumi {

nlohmann::ordered_json ToJson(const RadianceSettings& settings);

// Sets the option called `name` (without dashes) from a JSON value or from its text on the command line. Throws UsageError
// naming the option where the value does not fit; returns false for a name that is no setting.
bool SetOption(RadianceSettings& settings, const std::string& name, const nlohmann::ordered_json& value);

// One option: for the command line's help and for the list of names.
struct SettingOption {
  std::string name;
  std::string value;   // "FLOAT", "off|distance|jacobian" ...
  std::string help;    // with units and range
  std::string fallback;  // default, as text
};
const std::vector<SettingOption>& SettingOptions();

}  // namespace lumi
