// The moment that a picture of a moving scene shows: the view's own, unless the user named one for all.
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

// How the photos stand in time.
struct SceneClock {
  double frame_s = 0;            // from one moment to the next, median; 0: fewer than two moments
  bool several_at_once = false;  // two photos or more a moment: several cameras filmed it
};
inline SceneClock ClockOf(const Scene& scene) {
  constexpr double kSameMoment = 0.1,
                   kUsual = 0.9;  // times of one moment differ in rounding; of what most moments are apart
  std::vector<double> times, steps;
  for (const View& v : scene.views)
    if (v.time_s) times.push_back(*v.time_s);
  std::sort(times.begin(), times.end());
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  if (steps.empty()) return {};
  std::sort(steps.begin(), steps.end());
  // With n cameras per moment, only one in n steps is not 0: the usual step is among the longest.
  const double usual = steps[static_cast<std::size_t>(kUsual * static_cast<double>(steps.size() - 1))] > 0
                           ? steps[static_cast<std::size_t>(kUsual * static_cast<double>(steps.size() - 1))]
                           : steps.back();
  if (!(usual > 0)) return {};
  std::vector<double> moments;
  for (const double step : steps)
    if (step > kSameMoment * usual) moments.push_back(step);
  return {Median(moments), times.size() >= 2 * (moments.size() + 1) && moments.size() >= 2};
}

// Takes the scene's period and, if it has one or several cameras filmed it at once, a time window of two frames: it
// then holds enough photos from different places, and a wider one blurs (docs/timeperiodic.md). `window_decided`: the
// user said how wide.
inline void TakeClock(const Scene& scene, bool window_decided, RadianceSettings& settings) {
  settings.period_s = scene.period_s.value_or(0);
  const SceneClock clock = ClockOf(scene);
  if (window_decided || !(clock.frame_s > 0)) return;
  constexpr double kFrames = 2, kMostOfPeriod = 0.25;
  if (settings.period_s > 0)
    settings.time_window_s = std::min(kFrames * clock.frame_s, kMostOfPeriod * settings.period_s);
  else if (clock.several_at_once)
    settings.time_window_s = kFrames * clock.frame_s;
}

// The settings for this view: at its time, where it has one.
inline RadianceSettings AtTimeOf(RadianceSettings settings, const RenderView& view) {
  if (view.time_s) settings.time_s = *view.time_s;
  return settings;
}

}  // namespace lumi
