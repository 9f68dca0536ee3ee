// The moment that a picture shows, where the scene moves: the view's own, unless the user named one for all.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "render/radiance/settings.h"
#include "scene/geometry/median.h"
#include "scene/model/scene.h"

namespace lumi {

// Of the earliest photo, seconds; nullopt where no photo carries a time.
inline std::optional<double> FirstTime(const Scene& scene) {
  std::optional<double> first;
  for (const View& v : scene.views)
    if (v.time_s) first = first ? std::min(*first, *v.time_s) : *v.time_s;
  return first;
}

// What the scene's own clock says: its period, and where it has one, a window of two frames. All turns stand side by side in the period then,
// so few frames are enough, and a wider window blurs (docs/timeperiodic.md). `window_decided`: the user said how wide.
inline void TakeClock(const Scene& scene, bool window_decided, RadianceSettings& settings) {
  settings.period_s = scene.period_s.value_or(0);
  if (!(settings.period_s > 0) || window_decided) return;
  constexpr double kFrames = 2, kMostOfPeriod = 0.25;
  std::vector<double> times, steps;
  for (const View& v : scene.views)
    if (v.time_s) times.push_back(*v.time_s);
  std::sort(times.begin(), times.end());
  for (std::size_t i = 1; i < times.size(); ++i)
    if (times[i] > times[i - 1]) steps.push_back(times[i] - times[i - 1]);
  if (!steps.empty()) settings.time_window_s = std::min(kFrames * Median(steps), kMostOfPeriod * settings.period_s);
}

// The settings for this view: at its time, where it has one.
inline RadianceSettings AtTimeOf(RadianceSettings settings, const RenderView& view) {
  if (view.time_s) settings.time_s = *view.time_s;
  return settings;
}

}  // namespace lumi
