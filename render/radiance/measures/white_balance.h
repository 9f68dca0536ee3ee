// White balance: what a photo's red and blue are to its green, against the other photos
// (render/effects/white_balance.h), is taken out of photos where they are read (render/photos/photo_correction.h), and
// given back to pictures that are compared with a photo. A part of exposure: its gain gives back the brightness that
// this takes. No kernel knows of it.
#pragma once

#include "render/radiance/measures/record.h"

namespace lumi::measure {

struct WhiteBalance {
  static constexpr std::string_view kName = "white-balance", kTitle = "white balance";
  static constexpr bool kEffect = true;

  struct Settings {
    bool white_balance = false;
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.white_balance; }
  static void Switch(Settings& s, bool on) { s.white_balance = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("white-balance", &Settings::white_balance, "Photos are brought to one white balance as they are read",
                 "white balance");
  }

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto>) {}
    Verdict Decide(const ViewFacts& facts, Settings&) const {
      if (facts.color_spread > 1)
        return {true,
                fmt::format("photos of one point differ by up to {:.1f} % in colour", 100 * (facts.color_spread - 1))};
      return {false, facts.compared ? "photos of one point agree in colour" : "not looked at"};
    }
  };
};

}  // namespace lumi::measure
