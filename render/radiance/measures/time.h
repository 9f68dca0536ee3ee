// Time (thesis sec. 7.1): dissimilarity of two times in units of 2 r_max. `least` in the window's core, a raised cosine
// from there up to 1 at the window's edge, and in proportion beyond, so that the nearest in time still lead where the
// window is empty. On the circle of a period where there is one.
#pragma once

#include <algorithm>
#include <array>

#include "render/radiance/measures/record.h"

namespace lumi {

struct TimeShape {
  float inverse_half_window = 0;  // per second
  float core = 0.5F;              // the flat part of the window, [0, 1)
  float least = 0;                // in the core, [0, 1)
  float period_s = 0, inverse_period = 0;
};

template <typename T>
LUMI_INLINE T TimeDissimilarity(T dt_s, const TimeShape& shape) {
  const T core = shape.core, least = shape.least;
  dt_s = std::abs(dt_s);
  const T turns = dt_s * shape.inverse_period;  // 0 without a period
  dt_s = std::abs(dt_s - shape.period_s * std::floor(turns + T(0.5)));
  const T s = dt_s * shape.inverse_half_window;
  return s > 1 ? s : least + (1 - least) * RaisedCosine((s - core) / (1 - core));
}

namespace measure {

struct Time {
  static constexpr std::string_view kName = "time", kTitle = "time";
  static constexpr bool kEffect = true;

  struct Settings {
    bool time = false;  // photos away from time_s fade, within half of time_window_s each way
    double time_s = 0;
    double time_window_s = 1.0 / 3;  // > 0 (11 frames of 30 a second, errata of sec. 6.4.3)
    double time_core = 0.5;          // part of the window in which time counts least, [0, 0.95]: 0: from the middle on
    double time_least = 0;  // and how much it counts there, of what it counts at the window's edge, [0, 0.5]: above
                            // 0 a photo gives way before it ends, even one on whose own rays the view looks
    double period_s = 0;    // of the scene; 0: time does not repeat
    double epsilon = 1;     // >= 0
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.time; }
  static void Switch(Settings& s, bool on) { s.time = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("time", &Settings::time, "Photos away from the view's time rank behind",
                 "photos of the view's time first");
    table.Real("time-s", &Settings::time_s, kAnyNumber, "The view's time, seconds");
    table.Real("time-window-s", &Settings::time_window_s, {0, kAnyNumber.high, true}, "Window around it, seconds, > 0",
               {"window", 0.01, 60, "%.2f s"});
    table.Real("time-core", &Settings::time_core, {0, 0.95},
               "Part of the window in which time counts least, [0, 0.95]");
    table.Real("time-least", &Settings::time_least, {0, 0.5},
               "How much it counts there, of what it counts at the window's edge, [0, 0.5]");
    table.Real("epsilon", &Settings::epsilon, kFactorRange, "Weight of the time measure, >= 0",
               kFactorRow("its weight"));
  }

  static constexpr double kOwn = 0;
  static constexpr bool kPerPhoto = true;
  static double Factor(const Settings& s) { return s.time ? s.epsilon : 0; }
  using Shape = TimeShape;
  static Shape ShapeOf(const Settings& s) {
    // Bounded: no difference in time times infinity is no number, and h must not overflow.
    constexpr double kMost = 1e18;
    Shape shape;
    shape.inverse_half_window = static_cast<float>(std::min(2 / s.time_window_s, kMost));
    shape.core = static_cast<float>(s.time_core);
    shape.least = static_cast<float>(s.time_least);
    shape.period_s = static_cast<float>(s.period_s);
    shape.inverse_period = s.period_s > 0 ? static_cast<float>(std::min(1 / s.period_s, kMost)) : 0.0F;
    return shape;
  }
  template <typename Sight>
  LUMI_INLINE static auto Value(const Sight& at, const Shape& shape) {
    return at.timed() * TimeDissimilarity(at.dt_s(), shape);
  }
  static constexpr std::string_view kHeatMapUnit = "s", kHeatMapHelp = "How far that photo is in time";
  static double Shown(double value, const Settings& s) { return value * s.time_window_s / 2; }
  static void ShowAll(Settings& s) { s.time = true; }

  class Evidence {
   public:
    explicit Evidence(const Settings& s) : periodic_(s.period_s > 0) {}
    void Look(std::span<const NearPhoto>) {}
    Verdict Decide(const ViewFacts& facts, Settings&) const {
      const bool at_once = facts.timed && facts.several_at_once;
      return {facts.timed && (periodic_ || at_once), !facts.timed ? "photos carry no times"
                                                     : periodic_  ? "photos carry times and the scene a period"
                                                     : at_once    ? "several photos were taken at each moment"
                                                     : facts.asked
                                                         ? "photos carry times"
                                                         : "the scene has no period, and no time was asked for"};
    }

   private:
    bool periodic_;
  };
};

}  // namespace measure
}  // namespace lumi
