#include "render/settings_json.h"

#include "scene/program/error.h"

namespace lumi {

void ListKeys(JsonKeys& j, RadianceSettings& settings) {
  if (j.reading()) {
    for (const auto& [name, text] : j.Words())
      if (!SetOption(settings, name, text)) throw UsageError("\"" + name + "\" is not a setting of the reconstruction");
    return;
  }
  for (const SettingOption& o : SettingOptions()) {
    const OptionValue v = o.get(settings);
    const char* name = o.name.c_str();
    if (const auto* number = std::get_if<double>(&v))
      j.Say(name, *number);
    else if (o.name == "k" && settings.k > 0)
      j.Say(name, settings.k);
    else
      j.Say(name, Text(v));
  }
}

JsonKeys KeysOf(const RadianceSettings& settings, bool own_times, const std::string& backend) {
  // Leaves that differ by place cannot be written as numbers: kMeasured is written, so that they are measured again.
  RadianceSettings said = settings;
  if (said.similarity != Similarity::kFull) said.correlation_regions = 1;
  if (said.by_place && said.similarity == Similarity::kFull) {
    const RadianceSettings usual;
    said.correlation = Correlation::kMeasured;
    said.r_min_rad = usual.r_min_rad;
    said.r_max_rad = usual.r_max_rad;
    said.noise = usual.noise;
  }
  JsonKeys j(said);
  if (own_times) j.Remove("time-s");
  return j.Say("backend", backend);
}

}  // namespace lumi
