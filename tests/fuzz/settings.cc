// lumi-render --settings, and the settings in a stored front.
#include "render/settings_json.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(settings) {
  const JsonKeys keys = JsonKeys::Read(InputFile("settings.json", bytes), "settings");
  const auto settings = keys.As<RadianceSettings>();
  if (Validate(settings).empty())
    Require(JsonKeys(settings).Text() == JsonKeys(JsonKeys(settings).As<RadianceSettings>()).Text(),
            "settings do not read back as they are written");
}

}  // namespace lumi::fuzz
