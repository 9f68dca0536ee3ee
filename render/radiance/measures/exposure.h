// Exposure: photos' gains (render/effects/exposure.h) are divided out where they are read, and the view's own applied.
// No term of h.
#pragma once

#include "render/radiance/measures/record.h"

namespace lumi::measure {

struct Exposure {
  static constexpr std::string_view kName = "exposure", kTitle = "exposure";
  static constexpr bool kEffect = true;

  struct Settings {
    bool exposure = false;
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.exposure; }
  static void Switch(Settings& s, bool on) { s.exposure = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("exposure", &Settings::exposure, "Photos are brought to one exposure", "exposure");
  }

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto>) {}
    Verdict Decide(const ViewFacts& facts, Settings&) const {
      if (facts.gain_spread > 1)
        return {true, fmt::format("photos of one point differ by a factor of up to {:.2f}", facts.gain_spread)};
      if (facts.corrected) return {true, "photos of one point agree; it gives back what their correction takes"};
      return {false, "photos of one point agree"};
    }
  };
};

}  // namespace lumi::measure
