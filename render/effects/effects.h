// Which measures a scene calls for: each is switched on by evidence in the data, seen at rays of the views that are to
// be rendered, or by the user, whose word overrides. What is off is compiled out.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/radiance/decided.h"
#include "render/world/renderer.h"
#include "scene/files/json_keys.h"

namespace lumi {

struct Effect {
  std::string name;  // a measure's kName
  bool on = false;
  bool from_photos = false;  // the photos' pixels tell, not the rays of the views to come
  std::string evidence;      // a line for people
  std::string decided_by;    // what decided instead of the evidence, for people; empty: nothing did
  // A frame, against the same settings without it; 0 where it is off, nullopt: not measured.
  std::optional<double> cost_ms = {};
};
void ListKeys(JsonKeys& j, Effect& effect);

inline std::string Reason(const Effect& e) {
  return e.decided_by.empty() ? e.evidence : e.decided_by + "; " + e.evidence;
}

struct EffectChoice {
  RadianceSettings settings;
  std::vector<Effect> effects;
};

// All names, in the order of measures/list.h.
const std::vector<std::string>& EffectNames();
std::string EffectsHelp();  // of --effects

// Throws std::invalid_argument for a name that is not among them.
void SwitchEffect(RadianceSettings& settings, std::string_view name, bool on);

// --effects: auto, none, or a list: those and no others, except where an option of their own has `decided` otherwise.
// What is listed is decided from here on. Throws UsageError.
void ApplyEffectList(const std::string& list, RadianceSettings& settings, Decided& decided);

// `desired`: views that will be rendered (a few are looked at); `use`: as in RenderRequest. `decided`: effects that the
// user spoke about; `settings` holds their word and it is kept. `photos`: what their colours say (exposure.h).
EffectChoice ChooseEffects(const Scene& scene, const Mesh& proxy, const std::vector<RenderView>& desired,
                           const std::vector<bool>& use, const RadianceSettings& settings, const Decided& decided,
                           const PhotoFacts& photos);
// The same where each picture is made in a world of its own. `world` gives that of a view; nothing in it is hidden from
// a photo.
EffectChoice ChooseEffects(const Scene& scene, const std::vector<RenderView>& desired,
                           const std::function<PictureWorld(const RenderView&)>& world,
                           const RadianceSettings& settings, const Decided& decided, const PhotoFacts& photos);

// Fills cost_ms: renders `desired` small, with and without each effect that is on.
void MeasureEffects(Renderer& renderer, const RenderView& desired, const std::vector<bool>& use, EffectChoice& choice);

}  // namespace lumi
