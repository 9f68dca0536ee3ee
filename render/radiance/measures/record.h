// What a measure is: a record, a struct of static members in namespace lumi::measure, in a header of its own, named in
// measures/list.h. Everything that lists measures follows from that list: options and their help, --settings, --show,
// --effects, the viewer's panel, the trade-off's sweep, the kernels of the CPU, the shaders and the optimum.
// docs/render.md, "Another measure", goes through an example. A record has
//
// - kName ("time", as --effects and --show spell it) and kTitle ("time", "the resolution measure", as a sentence does);
// - kEffect: whether --effects switches it (the angle is always on);
// - Settings: its options' values. RadianceSettings inherits them, so their names are unique over all measures;
// - On(settings), Switch(settings, on);
// - Options(table): its options. The table (setting_options.cc) has Switch, Choice, Real, Angle (degrees outside,
//   radians inside) and Pair; each takes a name, the field, a Range, the help, and a PanelRow for the viewer's panel.
//   The option that bears the measure's own name is its switch.
//
// A term of the dissimilarity h (as Resolution, Time, Sharpness are) also has
//
// - kOwn: the value of a photo that nothing speaks against;
// - kPerPhoto: the value is the same for all rays of a view. The core then evaluates it once a frame;
// - Factor(settings): how much it counts. h grows by Factor 2 r_max |kOwn - Value|; 0 switches it off;
// - Shape and ShapeOf(settings): what Value needs of the settings. Shape::Packed() gives it to the shaders as an
//   array<float, 4> (no need where the measure is kPerPhoto);
// - Value(sight, shape): the photo's value at a ray's point, a template for float and double: take the type from what
//   the sight returns, as resolution.h does. The sight, described at the end of this file, computes only what it is
//   asked for;
// - kGlsl and kGlslValue: the same in GLSL ES 3.00, float NameValue(Sight s, vec4 shape), and its name; pure in its
//   arguments. Sight there has theta, x_px, size_px, depth, stretch and field (gl/measures_shader.cc). RaisedCosine
//   exists in C++ (kernel.h) and in GLSL. A term that is kPerPhoto needs none;
// - kReadsStretch, if Value asks for stretch();
// - kHeatMapUnit (empty: the scale ends at 1; else where the farthest tenth begins), kHeatMapHelp,
//   Shown(value, settings), and ShowAll(settings), which switches the measure on for its heat map.
//
// An effect also has Evidence: made from Settings, it sees the photos near rays of the views to come (Look), and then
// Decide(facts, settings) returns a Verdict. Decide may also change the measure's settings (which of several ways it is
// evaluated by). A measure that no data call for returns {false, why}.
//
// A measure that reads something off the photos' pixels has Estimate(scene, photos, sink): a PhotoGrid for each view,
// or none where the photos do not differ. sight.field() reads it. photos is nullptr where they are not in memory; then
// the estimator reads them.
//
// A value must be continuous in the point and in the view, and finite wherever the proxy can be, also where the point
// lies behind the photo (w() <= 0; u() and v() mean nothing there). A gate, a factor of f v as field of view and
// visibility are, is more than a record: each kernel knows them by name (dissimilarity.h).
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

// What the photos' colours say of one another.
struct PhotoFacts {
  double gain_spread = 1;   // largest over smallest gain of the photos' exposures, 1 where they agree
  double color_spread = 1;  // largest over smallest ratio of a channel to green, 1 where photos agree
  double corner = 1;        // a corner's brightness over the middle's, 1 where it is as bright
  bool corrected = false;   // white balance or vignetting is taken out of the photos as they are read
  bool compared = true;     // false: exposure is switched off, and nothing of this was looked at
};

struct ViewFacts : PhotoFacts {
  bool metric = true;                 // distances can be compared
  bool timed = false;                 // photos carry times
  bool several_at_once = false;       // and some were taken at the same moment
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

// ---- What a value may ask of the place where a ray's point lies for a photo (backends have sights of their own):
//
// - T theta(): angle at the point between the ray and the ray to the photo, rad
// - T u(), v(): the point in the photo, px from its upper left corner; w(): its depth there, <= 0 behind the photo
// - T width(), height(): of the photo, px
// - T stretch(): sigma of a photo's pixel in the view (resolution.h), by Jacobian where --resolution says so, else by
//   distance
// - T field(): the photo's own number there, interpolated (PhotoGrid); 1 where nothing is known
// - T dt_s(), timed(): only where the measure is kPerPhoto. The photo's time less the view's, on the circle of a period
//   already; 0 where the photo has no time, else 1

}  // namespace lumi
