// Prefiltering: how many pixels of a photo a pixel of the view covers on the proxy's plane, and the level of the
// photo's pyramid that it is read at.
//
// The photo's pixels as functions of the view's have the Jacobian J, the inverse of that whose stretch resolution.h
// measures. On a plane they are a homography, whose Jacobian's determinant is that of the matrix over w^3 (errata of
// sec. 4.2.2), so that
//   |det J| = (f_j / f)^2  |n.(p - D_j)| / |n.p|  (z / z_j)^3
// with focal lengths f in pixels, depths z along the optical axes and n the plane's normal at p, all from the view's
// centre. A pyramid has one level for both directions. log2 of sqrt |det J|, the geometric mean of J's singular values,
// is a compromise: one direction is blurred as much as the other is aliased. By the smaller singular value (the
// resolution measure's largest stretch) oblique planes would shimmer, by the larger they would be blurred:
// docs/render.md has the figures.
#pragma once

#include <algorithm>
#include <cmath>

#include "render/radiance/measures/record.h"

namespace lumi {

// Octaves. A trilinear sample is bilinear at a level whose own pixels are boxes 2^level wide already: at log2 of the
// footprint's side its variance is three times a pixel's. log2(3) / 2 below, 0.79, they are equal on one level; between
// levels the mixture is wider.
constexpr float kLevelBias = -0.5F;
// Photo pixels a pixel: up to here level 0 is read.
constexpr float kReadWhole = 2;  // 4^-kLevelBias

template <typename T>
constexpr T kMostFacing = T(1e6);

// |n.(p - D)| / |n.p|: how much nearer the plane is to the photo's centre than to the view's. Bounded where either sees
// it edge on; 1 for a normal of 0 (a triangle without area).
template <typename T>
LUMI_INLINE T FacingRatio(T of_photo, T of_view) {
  constexpr T kMost = kMostFacing<T>, kLeast = 1 / kMost;
  const T a = std::abs(of_photo), b = std::abs(of_view);
  return a > 0 || b > 0 ? std::min(std::max(a, b * kLeast) / std::max(b, a * kLeast), kMost) : T(1);
}

// |det J|: photo pixels a pixel, an area. focal_ratio: f_j / f; depth_ratio: z / z_j > 0.
template <typename T>
LUMI_INLINE T Footprint(T focal_ratio, T facing_ratio, T depth_ratio) {
  const T frontal = focal_ratio * depth_ratio;
  return frontal * frontal * (facing_ratio * depth_ratio);
}

// Level in a pyramid whose level 0 is the photo itself; negative levels are read at 0.
template <typename T>
T PyramidLevel(T footprint) {
  return T(0.5) * std::log2(footprint) + static_cast<T>(kLevelBias);
}

namespace measure {

// No term of h: oversampled photos are read from their pyramid.
struct Prefilter {
  static constexpr std::string_view kName = "prefilter", kTitle = "prefiltering";
  static constexpr bool kEffect = true;

  struct Settings {
    bool prefilter = true;
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.prefilter; }
  static void Switch(Settings& s, bool on) { s.prefilter = on; }
  template <typename Table>
  static void Options(Table& table) {
    table.Switch("prefilter", &Settings::prefilter, "Oversampled photos are read from their pyramid", "prefilter");
  }

  class Evidence {
   public:
    explicit Evidence(const Settings&) {}
    void Look(std::span<const NearPhoto> photos) {
      for (const NearPhoto& p : photos) {
        photos_ += p.f > 0;
        oversampled_ += p.ahead && p.pyramid_level > kLevelThatCounts;
      }
    }
    Verdict Decide(const ViewFacts&, Settings&) const {
      const double oversampled = Share(oversampled_, photos_);
      return {oversampled >= kShareThatCounts,
              fmt::format("{:.1f} % of the photos have more than {:.1f} pixels a pixel", 100 * oversampled,
                          std::sqrt(static_cast<double>(kReadWhole)) * std::exp2(kLevelThatCounts))};
    }

   private:
    static constexpr double kLevelThatCounts = 0.1;  // of a pyramid: less is no trace
    long photos_ = 0, oversampled_ = 0;
  };
};

}  // namespace measure
}  // namespace lumi
