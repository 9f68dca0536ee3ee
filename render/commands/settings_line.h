// The options of the reconstruction as they stand on a program's line.
#pragma once

#include <map>
#include <string>

#include "render/radiance/decided.h"
#include "render/radiance/setting_options.h"
#include "scene/program/options.h"

namespace lumi {

class SettingsLine {
 public:
  explicit SettingsLine(Options options) {
    options.Group("Reconstruction");
    for (const SettingOption& s : SettingOptions())
      options.Add("--" + s.name, given_[s.name], s.help).TypeName(s.value).Default(s.fallback);
  }
  SettingsLine(const SettingsLine&) = delete;  // the options hold on to where their words go
  SettingsLine& operator=(const SettingsLine&) = delete;
  bool Has(const std::string& name) const { return !given_.at(name).empty(); }

  // Over what stands in `settings`. Throws UsageError.
  void Apply(RadianceSettings& settings, Decided& decided) const {
    for (const auto& [name, text] : given_)
      if (!text.empty()) {
        SetOption(settings, name, text);
        decided.Add(name);
      }
    if (settings.similarity != Similarity::kFull) return;
    // What the optimum needs and nobody spoke against: 1/h is no covariance, and candidates are weighed one by one. The
    // line's --similarity full wins over what a file, written for another similarity, says of them.
    const auto open = [&](const char* name) { return !Has(name) && (Has("similarity") || !decided.Has(name)); };
    if (open("correlation")) settings.correlation = Correlation::kFallingLeaves;
    if (open("sampling")) settings.sampling = Sampling::kInterpolated;
  }

 private:
  std::map<std::string, std::string> given_;
};

}  // namespace lumi
