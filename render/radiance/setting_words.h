// Settings of the reconstruction from words: of a command line, a file, or a Python dictionary.
#pragma once

#include <map>
#include <string>

#include "render/radiance/decided.h"
#include "render/radiance/settings.h"

namespace lumi {

// words: option names without dashes, and their values as text; they replace the values in `settings`, and an empty
// text changes nothing. Throws UsageError, also for an unknown name.
void ApplySettingWords(const std::map<std::string, std::string>& words, RadianceSettings& settings, Decided& decided);

}  // namespace lumi
