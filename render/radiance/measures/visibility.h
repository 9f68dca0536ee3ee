// Visibility, a gate: a point behind what a photo's depth map shows counts as blocked, v falling from 1 to
// kBlockedVisibility. Feathered twice: over relative depth, and, as callers interpolate the comparison of neighbouring
// texels, across an occluder's edge. Between the ends, v is geometric: h = theta / v then changes by the same factor at
// every step of the feather, so no weight changes fast. With a linear v, 1 / v would be steepest just before the
// blocked end.
#pragma once

#include <bit>
#include <cstdint>

#include "render/radiance/measures/record.h"

namespace lumi {

// The proxy is rough, so its occlusion is only evidence. A blocked camera's value falls to this, not to 0: it ranks
// after the cameras that see the point, and before a hole. Lower values make weights steeper at an occluder's edge.
constexpr float kBlockedVisibility = 1.0F / 50;
constexpr double kLog2Blocked = -5.643856189774724;
// Half seen, half blocked.
constexpr float kHalfVisible = 0.141421356F;
// Relative depth behind the map's surface over which visibility fades: above the step that a slanted surface makes
// between texels, below the distance between an object and its background.
constexpr float kVisibleUpTo = 0.0225F;
constexpr float kBlockedFrom = 0.06F;

// In [0,1]: how far a point at this depth is seen past a texel's surface (+infinity: nothing there).
template <typename T>
LUMI_INLINE T SeenPast(T depth, T surface) {
  constexpr T kUpTo = 1 + static_cast<T>(kVisibleUpTo),
              kInverseWidth = 1 / (static_cast<T>(kBlockedFrom) - static_cast<T>(kVisibleUpTo));
  const T s = std::min(std::max(T(0), (depth / surface - kUpTo) * kInverseWidth), T(1));
  return 1 - s * s * (3 - 2 * s);
}

// kBlockedVisibility^(1 - seen): 1 at 1. In float by 2^x = 2^round(x) times the series of 2^(x - round(x)), error 2e-7
// relative.
LUMI_INLINE double VisibilityOf(double seen) { return std::exp2(kLog2Blocked * (1 - seen)); }
LUMI_INLINE float VisibilityOf(float seen) {
  const float x = static_cast<float>(kLog2Blocked) * (1 - std::min(seen, 1.0F));
  const auto whole = static_cast<std::int32_t>(x - 0.5F);
  const float z = 0.693147181F * (x - static_cast<float>(whole));
  const float series =
      1 + z * (1 + z * (0.5F + z * (0.166666667F + z * (4.16666667e-2F + z * (8.33333333e-3F + z * 1.38888889e-3F)))));
  return series * std::bit_cast<float>((whole + 127) << 23);
}

namespace measure {

struct Visibility {
  static constexpr std::string_view kName = "visibility", kTitle = "visibility";
  static constexpr bool kEffect = true;

  struct Settings {
    bool visibility = true;  // photos whose view of a point the proxy blocks rank last
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.visibility; }
  static void Switch(Settings& s, bool on) { s.visibility = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("visibility", &Settings::visibility, "Photos whose view of a point the proxy blocks rank last",
                 "visibility");
  }

  static constexpr std::string_view kHeatMapUnit = "", kHeatMapHelp = "How much that photo sees of the point";

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto> photos) {
      ++rays_;
      for (const NearPhoto& p : photos)
        if (p.f > 0 && p.v < kHalfVisible) {
          ++blocked_;
          break;
        }
    }
    Verdict Decide(const ViewFacts&, Settings&) const {
      const double blocked = Share(blocked_, rays_);
      return {blocked >= kShareThatCounts,
              fmt::format("at {:.1f} % of the rays the proxy blocks one of the nearest photos", 100 * blocked)};
    }

   private:
    long rays_ = 0, blocked_ = 0;
  };
};

}  // namespace measure
}  // namespace lumi
