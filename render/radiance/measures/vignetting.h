// Vignetting: how much darker a lens shows the corners of its photos (render/effects/vignetting.h),
// is taken out of photos where they are read (render/photos/photo_correction.h), and given back to pictures that are
// compared with a photo. A part of exposure: its gain gives back the brightness that this takes. No kernel knows of it.
#pragma once

#include "render/radiance/measures/record.h"

namespace lumi::measure {

struct Vignetting {
  static constexpr std::string_view kName = "vignetting", kTitle = "vignetting";
  static constexpr bool kEffect = true;

  struct Settings {
    bool vignetting = false;
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.vignetting; }
  static void Switch(Settings& s, bool on) { s.vignetting = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("vignetting", &Settings::vignetting, "A lens's darker corners are brightened as photos are read",
                 "vignetting");
  }

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto>) {}
    Verdict Decide(const ViewFacts& facts, Settings&) const {
      if (facts.corner < 1)
        return {true, fmt::format("corners have {:.0f} % of the middle's brightness", 100 * facts.corner)};
      return {false, facts.compared ? "no lens of 16 photos or more shows darker corners" : "not looked at"};
    }
  };
};

}  // namespace lumi::measure
