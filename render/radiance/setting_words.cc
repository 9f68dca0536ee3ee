#include "render/radiance/setting_words.h"

#include "render/radiance/setting_options.h"
#include "scene/program/error.h"

namespace lumi {

void ApplySettingWords(const std::map<std::string, std::string>& words, RadianceSettings& settings, Decided& decided) {
  const auto has = [&](const char* name) {
    const auto word = words.find(name);
    return word != words.end() && !word->second.empty();
  };
  for (const auto& [name, text] : words)
    if (!text.empty()) {
      if (!SetOption(settings, name, text)) throw UsageError("\"" + name + "\" is not a setting of the reconstruction");
      decided.Add(name);
    }
  if (settings.similarity != Similarity::kFull) return;
  // Sets what the optimum needs, unless the user decided otherwise: 1/h is no covariance, and candidates are weighed
  // one by one. A similarity among these words overrides earlier decisions, which were made for another similarity.
  const auto open = [&](const char* name) { return !has(name) && (has("similarity") || !decided.Has(name)); };
  if (open("correlation")) settings.correlation = Correlation::kFallingLeaves;
  if (open("sampling")) settings.sampling = Sampling::kInterpolated;
}

}  // namespace lumi
