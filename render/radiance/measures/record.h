// What a measure is: a record, a struct of static members in a header of its own, named in measures/list.h. Everything
// that lists measures follows from that list: options and their help, --settings, --effects, --show, the viewer's
// panel, the trade-off's sweep, the kernels of the CPU, the shaders and the optimum. To add one, write a record that
// has
//
//   kName, kTitle     as --effects and --show spell it ("time"); as a sentence does ("time", "the resolution measure")
//   kEffect           whether --effects switches it (the angle is always on)
//   Settings          its options' values; RadianceSettings inherits them. On(settings), Switch(settings, on)
//   Options(table)    its options: name, field, range, help, and how the viewer's panel shows them
//
// and, if it is a term of the dissimilarity h (as Resolution, Time, Sharpness are),
//
//   kOwn              the value of a photo that is the view itself
//   kPerPhoto         whether the value is the same for all rays of a view (then it is evaluated once a frame, by the
//   core) Factor(settings)  how much it counts: h grows by Factor 2 r_max |kOwn - Value|. 0 switches it off Shape,
//   ShapeOf(settings, view)   what Value needs of the settings, up to four floats Value(sight, shape)   the photo's
//   value at a ray's point: one template for float, double and whatever a kernel has. `sight` is asked
//                     for what is needed and computes nothing else (struct Sight, below, says what there is)
//   kGlsl, kGlslValue the same in GLSL ES 3.00, and its name: float ResolutionValue(Sight s, vec4 shape), pure in its
//   arguments (a term
//                     that is kPerPhoto needs none)
//   kHeatMapUnit, kHeatMapHelp, Shown(value, settings), ShowAll(settings)   its heat map: unit, a line of help, the
//   value shown, and how
//                     it is evaluated while the measure is off
//
// and, if it is an effect, Evidence: Look(ray) at rays of the views to come, then Decide(facts). A measure that needs
// something of the photos themselves has Estimate(scene, photos, sink): a PhotoGrid for each view, or none where the
// photos do not differ; sight.field() reads it (photos: nullptr where they are not in memory, and the estimator reads
// them).
//
// A value must be continuous in the point and in the view, kOwn for a photo that is the view, and finite wherever the
// proxy can be. A factor of f v, as field of view and visibility are, is a gate; gates are few, and each kernel knows
// them by name (dissimilarity.h).
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <string_view>

#include "render/radiance/kernel.h"
#include "render/radiance/measures/photo_field.h"
#include "scene/geometry/constants.h"

namespace lumi {

// Where an option's number may lie.
struct Range {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;

  bool Holds(double v) const {
    return std::isfinite(v) && (low_open ? v > low : v >= low) && (high_open ? v < high : v <= high);
  }
  std::string Text() const {  // "must " ...
    if (!std::isfinite(high))
      return !std::isfinite(low) ? "be a number"
                                 : fmt::format("be {:g} {}", low, low_open ? "exclusive, or more" : "or more");
    return fmt::format("lie in {}{:g}, {:g}{}", low_open ? '(' : '[', low, high, high_open ? ')' : ']');
  }
};
constexpr Range kAnyNumber;
// Of a factor of h: beyond it, sums of measures leave what a float holds.
constexpr Range kFactorRange{0, 1e9};

// An option in the viewer's panel. No label: it has no row of its own there.
struct PanelRow {
  const char* label = nullptr;
  double low = 0, high = 0;
  const char* format = "%.2f";
};
constexpr PanelRow kFactorRow(const char* label) { return {label, 0, 10}; }

// ---- What evidence is gathered from.

// One of the k + 1 photos nearest to a ray by angle, whatever else they are.
struct NearPhoto {
  float f = 0, v = 1;        // field of view, visibility
  bool measured = false;     // what follows is known: the photo sees the point, and the proxy is not edge on
  double pyramid_level = 0;  // that it would be read at, if `ahead`
  bool ahead = false;        // the point lies before the photo, within its field of view
  double octaves_jacobian = 0, octaves_distance = 0;  // log2 of the stretch of its pixels, by either way
};

struct ViewFacts {
  bool metric = true;                 // distances can be compared
  bool timed = false;                 // photos carry times
  bool several_at_once = false;       // and some were taken at the same moment
  double gain_spread = 1;             // largest over smallest gain of the photos' exposures, 1 where they agree
  bool asked = false;                 // the user has decided already
  const PhotoField* field = nullptr;  // the measure's own, where it has an estimator
};

// What the data say: a line for people, and the word it comes to.
struct Verdict {
  bool on = false;
  std::string evidence;
};

// Of the rays looked at: an effect at fewer cannot be seen.
constexpr double kShareThatCounts = 0.002;

inline double Share(long part, long whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

// ---- What a value may ask of the place where a ray's point lies for a photo. Backends have structs with these members
// of their own.
//
//   T theta()            angle at the point between the ray and the ray to the photo, rad
//   T u(), v()           the point in the photo, px from its upper left corner; w() its depth there (<= 0: behind it)
//   T width(), height()  of the photo, px
//   T stretch()          sigma of a photo's pixel in the view (resolution.h), by distance or by Jacobian as
//   --resolution says T dt_s()             the photo's time less the view's, on the circle of a period already; timed()
//   0 where the photo has none, else 1 T field()            the photo's own number there, interpolated (PhotoGrid)

}  // namespace lumi
