// RadianceSettings in JSON.
#pragma once

#include "render/radiance/setting_options.h"
#include "scene/files/json_keys.h"

namespace lumi {

// An object of the options' names and values, as summaries print it, fronts keep it and --settings takes it back.
// Throws UsageError for what SetOption does not take.
void ListKeys(JsonKeys& j, RadianceSettings& settings);
// The same, as lumi-render prints how a picture was made: with the backend, and without a time that differs from view
// to view.
JsonKeys KeysOf(const RadianceSettings& settings, bool own_times, const std::string& backend);

}  // namespace lumi
