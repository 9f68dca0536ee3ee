// The options of the reconstruction as one table: the core's own and, group by group, each measure's. The command line,
// its help,
// --settings, summaries, the viewer's panel and Validate follow from it.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "render/radiance/settings.h"

namespace lumi {

// A switch is true or false ("on", "off" as text); an angle is in degrees here.
using OptionValue = std::variant<bool, double, std::string>;
std::string Text(const OptionValue& value);

struct SettingOption {
  std::string name;                         // without dashes
  std::string value;                        // what it takes: "FLOAT", "off|distance|jacobian" ...
  std::string help;                         // with units and range
  std::string_view measure, measure_title;  // kName and kTitle of the measure it belongs to, or empty
  bool is_switch = false;                   // of its measure: on/off, or the choice that contains off
  PanelRow row;
  std::string fallback;  // default, as text
  std::function<OptionValue(const RadianceSettings&)> get;
  // From a value or its text. Throws UsageError naming the option where it does not fit.
  std::function<void(RadianceSettings&, const OptionValue&)> set;
  std::function<std::string(const RadianceSettings&)> problem;  // empty, or what is wrong; none: any value is valid
  // For the panel's widgets: the field itself, and its unit (a slider's value times this).
  std::variant<std::monostate, bool RadianceSettings::*, double RadianceSettings::*> field;
  double unit = 1;
  std::vector<std::string> choices;
};

// All, in the order of the help.
const std::vector<SettingOption>& SettingOptions();
// nullptr for a name that is no option.
const SettingOption* FindSettingOption(std::string_view name);

// Sets the option called `name` (without dashes) from its text on the command line, or in JSON. Throws UsageError
// naming it where the text does not fit; returns false for a name that is no option.
bool SetOption(RadianceSettings& settings, const std::string& name, const std::string& text);

// Whether a measure is on; the angle always is.
bool IsOn(const RadianceSettings& settings, std::string_view measure);

}  // namespace lumi
