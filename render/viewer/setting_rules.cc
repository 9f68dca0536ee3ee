#include "render/viewer/setting_rules.h"

#include <fmt/format.h>

#include "render/radiance/measures/evaluate.h"
#include "render/radiance/setting_options.h"

namespace lumi {

std::string WhyWithoutEffect(const RadianceSettings& s, std::string_view option) {
  const bool full = s.similarity == Similarity::kFull;
  const auto is = [&](std::initializer_list<std::string_view> names) {
    for (const std::string_view n : names)
      if (n == option) return true;
    return false;
  };
  if (s.method != Algorithm::kUlr && !is({"method", "method-count", "method-parameter", "exposure", "prefilter",
                                          "visibility", "white-balance", "vignetting"}))
    return fmt::format("{} has weights of its own", Name(s.method));
  if (full && is({"correlation"})) return "the optimum needs falling leaves: 1/h is no covariance";
  if (!full && is({"sum", "combine", "cutoff-deg", "accuracy", "noise"}))
    return "only for the optimum (similarity full)";
  if (!s.Sparse() && is({"sampling", "epipoles"})) return "only on a grid of sparse samples";
  if (full && is({"sampling"})) return "candidates are weighed one by one: the optimum is interpolated";
  if (is({"r-min-deg"}) && s.correlation == Correlation::kInverse) return "only for falling leaves";
  if (is({"r-max-deg"}) && s.correlation == Correlation::kInverse && !HasTerms(s))
    return "only for falling leaves and for terms beside the angle";
  if (is({"gamma"})) return s.field_of_view || s.visibility ? "" : "field of view and visibility are off";
  if (const SettingOption* o = FindSettingOption(option); o && !o->is_switch && !IsOn(s, o->measure))
    return fmt::format("{} is off", o->measure_title);
  return {};
}

void Reconcile(RadianceSettings& s, std::string_view option) {
  if (option == "method" && s.method != Algorithm::kUlr) {
    s.similarity = Similarity::kIdentity;
    s.grid_columns = s.grid_rows = 0;
    s.method_count = s.method_parameter = -1;
  }
  // Measuring needs all photos, which are still loading here: only lumi-render measures.
  if (s.correlation == Correlation::kMeasured) s.correlation = Correlation::kFallingLeaves;
  // Changing an option of this renderer's own weights switches back to them.
  if (s.method != Algorithm::kUlr && (option == "similarity" || option == "grid")) s.method = Algorithm::kUlr;
  if (s.similarity == Similarity::kFull) {
    if (option == "similarity" || option == "grid") {
      s.correlation = Correlation::kFallingLeaves;
      s.sampling = Sampling::kInterpolated;
    } else if ((option == "correlation" && s.correlation == Correlation::kInverse) ||
               (option == "sampling" && s.sampling == Sampling::kCandidates && s.Sparse())) {
      s.similarity = Similarity::kIdentity;
    }
  }
  if (option == "r-min-deg" && s.r_min_rad > s.r_max_rad) s.r_max_rad = s.r_min_rad;
  if (option == "r-max-deg" && s.r_min_rad > s.r_max_rad) s.r_min_rad = s.r_max_rad;
}

std::string Describe(const RadianceSettings& s) {
  if (s.method != Algorithm::kUlr) return fmt::format("{}, at rest", Name(s.method));
  std::string text = s.similarity == Similarity::kFull
                         ? fmt::format("optimum within {:.0f} deg", s.cutoff_rad / kRadPerDeg)
                     : s.k == 0 ? "all photos"
                                : fmt::format("k {}", s.k);
  if (s.Sparse())
    text += fmt::format(", {} {}x{}{}", Name(s.sampling), s.grid_columns, s.grid_rows,
                        s.epipoles ? "" : " without epipoles");
  if (s.similarity == Similarity::kIdentity && s.correlation == Correlation::kFallingLeaves) text += ", falling leaves";
  for (const SettingOption& o : SettingOptions())
    if (o.is_switch && IsOn(s, o.measure))
      text += fmt::format(", {}", o.choices.empty() ? std::string(o.name) : Text(o.get(s)));
  if (s.time) text += fmt::format(" {:.2f} s", s.time_s);
  return text;
}

}  // namespace lumi
