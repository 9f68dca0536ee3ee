// Field-of-view value (thesis sec. 4.2.1), a gate: 1 inside a photo, 0 outside, a raised cosine between over the
// feather at its border. `edge_px`: distance of the point's image to the nearest border, negative outside.
#pragma once

#include "render/radiance/measures/record.h"

namespace lumi {

// Of a point on a photo's very border: it is still seen, and at an epipole it counts.
constexpr float kBarelySeen = 1e-30F;

template <typename T>
LUMI_INLINE T FieldOfView(T edge_px, T feather_px) {
  return RaisedCosine(edge_px / feather_px);
}

namespace measure {

struct FieldOfView {
  static constexpr std::string_view kName = "fov", kTitle = "field of view";
  static constexpr bool kEffect = true;

  struct Settings {
    bool field_of_view = true;  // off: f = 1, and a photo that ends leaves a hole
    double fov_feather = 0.02;  // width of the border over which a photo fades, fraction of its smaller side, (0, 0.5]
    double gamma = 1;           // of the penalty by f and v, >= 0
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.field_of_view; }
  static void Switch(Settings& s, bool on) { s.field_of_view = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("fov", &Settings::field_of_view, "Field of view: a photo fades towards its border, and others fill in",
                 "field of view");
    table.Real("fov-feather", &Settings::fov_feather, {0, 0.5, true},
               "Border over which a photo fades, fraction of its smaller side, (0, 0.5]",
               {"feather", 0.005, 0.5, "%.3f"});
    table.Real("gamma", &Settings::gamma, kFactorRange, "Weight of the field-of-view and visibility penalty, >= 0",
               {"weight of field of view and visibility", 0, 100});
  }

  static constexpr std::string_view kHeatMapUnit = "", kHeatMapHelp = "How far inside that photo's field of view";

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto> photos) {
      constexpr float kWhole = 0.99F;  // the rest is rounding
      ++rays_;
      for (const NearPhoto& p : photos)
        if (p.f < kWhole) {
          ++ends_;
          break;
        }
    }
    Verdict Decide(const ViewFacts&, Settings&) const {
      const double ends = Share(ends_, rays_);
      return {ends >= kShareThatCounts,
              fmt::format("at {:.1f} % of the rays one of the nearest photos ends", 100 * ends)};
    }

   private:
    long rays_ = 0, ends_ = 0;
  };
};

}  // namespace measure
}  // namespace lumi
