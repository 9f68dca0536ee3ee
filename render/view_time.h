// The moment that a picture shows, where the scene moves: the view's own, unless the user named one for all.
#pragma once

#include <algorithm>
#include <optional>

#include "render/radiance/settings.h"
#include "scene/model/scene.h"

namespace lumi {

// Of the earliest photo, seconds; nullopt where no photo carries a time.
inline std::optional<double> FirstTime(const Scene& scene) {
  std::optional<double> first;
  for (const View& v : scene.views)
    if (v.time_s) first = first ? std::min(*first, *v.time_s) : *v.time_s;
  return first;
}

// The settings for this view: at its time, where it has one.
inline RadianceSettings AtTimeOf(RadianceSettings settings, const RenderView& view) {
  if (view.time_s) settings.time_s = *view.time_s;
  return settings;
}

}  // namespace lumi
