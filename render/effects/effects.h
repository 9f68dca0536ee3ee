// Which measures a scene calls for: each is switched on by evidence in the data, gathered at rays of the views that
// will be rendered, or by the user, who overrides the evidence. A measure that is off is not compiled into kernels and
// shaders.
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
  bool from_photos = false;  // the evidence is in the photos' pixels, not at rays of the views
  std::string evidence;      // a line for people
  std::string decided_by;    // what overrode the evidence, for people; empty: nothing did
  // Time it adds to a frame, against the same settings without it; 0: it is off; nullopt: not measured.
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

// As --effects takes it: the list of those that are on, or none.
std::string EffectListOf(const RadianceSettings& settings);

// --effects: auto, none, or a list. A list switches on its effects and all others off, except those that `decided`
// holds already; all effects then are `decided`. Throws UsageError.
void ApplyEffectList(const std::string& list, RadianceSettings& settings, Decided& decided);

// `desired`: views that will be rendered (a few are looked at); `use`: as in RenderRequest. `decided`: effects that the
// user spoke about; `settings` holds their word and it is kept. `photos`: what their colours say (exposure.h).
EffectChoice ChooseEffects(const Scene& scene, const Mesh& proxy, const std::vector<RenderView>& desired,
                           const std::vector<bool>& use, const RadianceSettings& settings, const Decided& decided,
                           const PhotoFacts& photos);
// The same if each picture is made in a world of its own. `world` gives the world of a view; its proxy hides nothing.
EffectChoice ChooseEffects(const Scene& scene, const std::vector<RenderView>& desired,
                           const std::function<PictureWorld(const RenderView&)>& world,
                           const RadianceSettings& settings, const Decided& decided, const PhotoFacts& photos);

// Sets cost_ms: renders `desired` at a small size, with and without each effect that is on.
void MeasureEffects(Renderer& renderer, const RenderView& desired, const std::vector<bool>& use, EffectChoice& choice);

}  // namespace lumi
