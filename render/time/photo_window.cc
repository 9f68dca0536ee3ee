#include "render/time/photo_window.h"

#include <algorithm>

#include "render/time/clock.h"
#include "render/time/photo_order.h"

namespace lumi {

int TakeWindow(Scene& scene, std::optional<int> wanted, bool along_path, Decided& decided, RadianceSettings& settings) {
  constexpr int kUsualReach = 5;  // 11 frames (sec. 6.4.3)
  constexpr double kPathTimeLeast =
      0.005;  // smaller: a photo ends within a pixel; larger: its neighbours show through it
  const bool video =
      std::all_of(scene.views.begin(), scene.views.end(), [](const View& v) { return v.time_s || v.frame_index; });
  const int reach = wanted.value_or(video || along_path ? kUsualReach : -1);
  if (reach < 0) return reach;
  GiveTimes(scene);
  const double frame_s = ClockOf(scene).frame_s;
  const auto open = [&](const char* name) { return !decided.Has(name); };
  if (open("time")) settings.time = true;
  if (open("time-window-s") && frame_s > 0) settings.time_window_s = (2 * reach + 1) * frame_s;
  if (open("time-core")) settings.time_core = 0;
  // A photo's own view must give the photo back; a frame of a path instead fades to another photo where this one ends.
  if (open("time-least") && along_path) settings.time_least = kPathTimeLeast;
  // Evidence is gathered at some frames only: in others, photos may end.
  if (open("fov")) settings.field_of_view = true;
  decided.Add({"time", "time-window-s", "fov"});
  return reach;
}

}  // namespace lumi
