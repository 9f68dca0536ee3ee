// The options of the reconstruction on a command line.
#pragma once

#include <map>
#include <string>

#include "render/radiance/decided.h"
#include "render/radiance/setting_options.h"
#include "render/radiance/setting_words.h"
#include "scene/program/options.h"

namespace lumi {

class SettingsLine {
 public:
  explicit SettingsLine(Options options) {
    options.Group("Reconstruction");
    for (const SettingOption& s : SettingOptions())
      options.Add("--" + s.name, given_[s.name], s.help).TypeName(s.value).Default(s.fallback);
  }
  SettingsLine(const SettingsLine&) = delete;  // the options keep pointers into given_
  SettingsLine& operator=(const SettingsLine&) = delete;
  bool Has(const std::string& name) const { return !given_.at(name).empty(); }

  // Replaces the values in `settings` that the line gives. Throws UsageError.
  void Apply(RadianceSettings& settings, Decided& decided) const { ApplySettingWords(given_, settings, decided); }

 private:
  std::map<std::string, std::string> given_;
};

}  // namespace lumi
