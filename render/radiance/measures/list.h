// The measures, in the order in which --effects, summaries and the viewer's panel name them. record.h says what a
// record holds and what follows from its place here.
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "render/radiance/measures/angle.h"
#include "render/radiance/measures/exposure.h"
#include "render/radiance/measures/field_of_view.h"
#include "render/radiance/measures/prefilter.h"
#include "render/radiance/measures/resolution.h"
#include "render/radiance/measures/sharpness.h"
#include "render/radiance/measures/time.h"
#include "render/radiance/measures/vignetting.h"
#include "render/radiance/measures/visibility.h"
#include "render/radiance/measures/white_balance.h"

namespace lumi {

template <typename... M>
struct MeasureListOf {
  static constexpr int kCount = sizeof...(M);
  // f.operator()<M>() for each in turn.
  template <typename F>
  static constexpr void ForEach(F&& f) {
    (f.template operator()<M>(), ...);
  }
  struct Settings : M::Settings... {
    bool operator==(const Settings&) const = default;
  };
  template <typename Wanted>
  static constexpr int IndexOf() {
    int index = -1, at = 0;
    ((index = std::is_same_v<Wanted, M> ? at : index, ++at), ...);
    return index;
  }
};

using MeasureList = MeasureListOf<measure::Angle, measure::FieldOfView, measure::Resolution, measure::Visibility,
                                  measure::Time, measure::Sharpness, measure::Exposure, measure::WhiteBalance,
                                  measure::Vignetting, measure::Prefilter>;

// A term of h, the angle aside: it grows by Factor 2 r_max |kOwn - Value|.
template <typename M>
concept Term = requires {
  M::kOwn;
};
// A term whose value depends on the ray.
template <typename M>
concept PixelTerm = Term<M> && !M::kPerPhoto;
template <typename M>
concept ReadsStretch = requires {
  M::kReadsStretch;
};
template <typename M>
concept Effectual = M::kEffect;
// A measure with a heat map.
template <typename M>
concept Mapped = requires {
  M::kHeatMapUnit;
};
// A measure that reads something of its own off the photos.
template <typename M>
concept Estimated = requires {
  &M::Estimate;
};
// Its evidence is in the photos' pixels, not in the rays of views.
template <typename M>
concept FromPhotos = Estimated<M> || std::is_same_v<M, measure::Exposure> || std::is_same_v<M, measure::WhiteBalance> ||
    std::is_same_v<M, measure::Vignetting>;

template <typename F>
constexpr void ForEachTerm(F&& f) {
  MeasureList::ForEach([&]<typename M> {
    if constexpr (Term<M>) f.template operator()<M>();
  });
}
constexpr int kTermCount = [] {
  int count = 0;
  ForEachTerm([&]<typename M> { ++count; });
  return count;
}();
template <typename F>
constexpr void ForEachEffect(F&& f) {
  MeasureList::ForEach([&]<typename M> {
    if constexpr (Effectual<M>) f.template operator()<M>();
  });
}

// Some of the measures: those an effect list names, those the user spoke about, those a shader is compiled with.
class MeasureSet {
 public:
  template <typename M>
  bool Has() const {
    return (bits_ & Bit<M>()) != 0;
  }
  template <typename M>
  void Add(bool yes = true) {
    bits_ |= yes ? Bit<M>() : 0;
  }
  int Count() const { return std::popcount(bits_); }
  auto operator<=>(const MeasureSet&) const = default;

 private:
  template <typename M>
  static constexpr std::uint32_t Bit() {
    static_assert(MeasureList::IndexOf<M>() >= 0 && MeasureList::kCount <= 32);
    return std::uint32_t(1) << MeasureList::IndexOf<M>();
  }
  std::uint32_t bits_ = 0;
};

}  // namespace lumi
