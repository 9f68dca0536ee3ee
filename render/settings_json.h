// RadianceSettings as an object of lumi-render's own option names and values, as its summaries print them, fronts keep
// them and --settings takes them back.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "render/radiance/setting_options.h"

namespace lumi {

nlohmann::ordered_json ToJson(const RadianceSettings& settings);

// Sets the option called `name` (without dashes) from a JSON value or from its text on the command line. Throws
// UsageError naming the option where the value does not fit; returns false for a name that is no setting.
bool SetOption(RadianceSettings& settings, const std::string& name, const nlohmann::ordered_json& value);

}  // namespace lumi
