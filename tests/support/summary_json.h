// A summary as --json prints it, to be looked into.
#pragma once

#include <nlohmann/json.hpp>

#include "scene/files/json_keys.h"

namespace lumi {

nlohmann::json AsJson(const auto& summary) { return nlohmann::json::parse(JsonKeys(summary).Text()); }

}  // namespace lumi
