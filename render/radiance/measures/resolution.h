// Resolution (thesis sec. 4.2.2 and 5.1.2): how much a pixel of photo j is stretched in the desired view, sigma > 1
// where the photo is undersampled, and the value r_j in [0,1] that comes of it.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "render/radiance/measures/record.h"

namespace lumi {

// sigma of sec. 4.2.2: the plane-induced homography's largest stretch, or the ratio of distances (sec. 5.1.2).
enum class Resolution { kOff, kDistance, kJacobian };
inline std::string_view Name(Resolution v) {
  return v == Resolution::kOff ? "off" : v == Resolution::kDistance ? "distance" : "jacobian";
}

// sigma as the ratio of distances, with the focal lengths that the thesis takes for equal.
template <typename T>
LUMI_INLINE T DistanceStretch(T distance_source, T distance_desired, T focal_source_px, T focal_desired_px) {
  return (distance_source * focal_desired_px) / (distance_desired * focal_source_px);
}

// Largest singular value of [a b; c d], without cancellation (errata).
template <typename T>
LUMI_INLINE T LargestSingularValue(T a, T b, T c, T d) {
  const T s = a + d, e = b - c, m = a - d, n = b + c;
  return T(0.5) * (std::sqrt(s * s + e * e) + std::sqrt(m * m + n * n));
}

// sigma of the homography from photo to view that the proxy's plane induces: J_view J_photo^-1, where J maps a step in
// the plane's tangents to a step in pixels. Equal to the thesis's Jacobian (whose factor is 1 / (Gx + Hy + I)^2,
// errata), but finite in its intermediates. A photo that sees the plane edge-on is infinitely stretched.
template <typename T>
LUMI_INLINE T JacobianStretch(T v00, T v01, T v10, T v11, T p00, T p01, T p10, T p11) {
  const T det = p00 * p11 - p01 * p10;
  const T a = v00 * p11 - v01 * p10, b = v01 * p00 - v00 * p01;
  const T c = v10 * p11 - v11 * p10, d = v11 * p00 - v10 * p01;
  const T size = LargestSingularValue(a, b, c, d);
  return std::abs(det) > size * T(1e-12) ? size / std::abs(det) : T(1e12);
}

// The same from the photo's pixels as functions of the view's, whose Jacobian on the proxy's plane is (A + b c^T /
// facing) / w: A what rays at infinity have, b the motion of the photo's pixel and c / facing that of the inverse
// depth, a step of a pixel each, w the depth in the photo over that in the view. sigma = 1 / its smaller singular
// value, by the matrix determinant lemma: finite for a plane seen edge on, facing = 0, too.
template <typename T>
LUMI_INLINE T PlaneStretch(T a00, T a01, T a10, T a11, T b0, T b1, T c0, T c1, T facing, T w) {
  const T size = w * LargestSingularValue(a00 * facing + b0 * c0, a01 * facing + b0 * c1,  //
                                          a10 * facing + b1 * c0, a11 * facing + b1 * c1);
  const T det = std::abs((a00 * a11 - a01 * a10) * facing + c0 * (a11 * b0 - a01 * b1) + c1 * (a00 * b1 - a10 * b0));
  return det > size * T(1e-12) ? size / det : T(1e12);
}

// What ResolutionValue takes for a limit; 0 for none.
inline float InverseLog(double limit) { return limit > 0 ? static_cast<float>(1 / std::abs(std::log2(limit))) : 0.0F; }

// Value of a stretch (Fig. 4-7): 1 at sigma = 1, a raised cosine of log sigma down to 0 at `high` for undersampled
// photos, and at `low` for oversampled ones; inverse_log_low = 0: those are not penalised (the pyramid serves them).
// inverse_log_x = 1 / |log2(x)|.
template <typename T>
LUMI_INLINE T ResolutionValue(T sigma, T inverse_log_low, T inverse_log_high) {
  const T octaves = Log2(std::min(std::max(sigma, T(1e-12)), T(1e12)));
  return RaisedCosine(T(1.0) - (octaves > 0 ? octaves * inverse_log_high : -octaves * inverse_log_low));
}

namespace measure {

struct Resolution {
  static constexpr std::string_view kName = "resolution", kTitle = "the resolution measure";
  static constexpr bool kEffect = true;

  struct Settings {
    lumi::Resolution resolution = lumi::Resolution::kOff;
    double resolution_low = 0;   // stretch at which an oversampled photo's r is largest; 0: it is not penalised
    double resolution_high = 3;  // the same for an undersampled photo, > 1
    double beta = 1;             // >= 0
    bool operator==(const Settings&) const = default;
  };
  static bool On(const Settings& s) { return s.resolution != lumi::Resolution::kOff; }
  // It comes on as the ratio of distances.
  static void Switch(Settings& s, bool on) {
    if (on != On(s)) s.resolution = on ? lumi::Resolution::kDistance : lumi::Resolution::kOff;
  }
  template <typename Table>
  static void Options(Table& table) {
    table.Choice("resolution", &Settings::resolution,
                 {lumi::Resolution::kOff, lumi::Resolution::kDistance, lumi::Resolution::kJacobian},
                 "Measure of how a photo's pixels are stretched", "resolution");
    table.Pair("resolution-range", "LOW,HIGH", &Settings::resolution_low, {0, 1, false, true},
               &Settings::resolution_high, {1, std::numeric_limits<double>::infinity(), true},
               "Stretches at which a photo's resolution counts least, [0, 1) and above 1; LOW 0: oversampled photos "
               "are as good",
               {"its range", 0, 100});
    table.Real("beta", &Settings::beta, kFactorRange, "Weight of the resolution measure, >= 0",
               kFactorRow("its weight"));
  }

  static constexpr double kOwn = 1;
  static constexpr bool kPerPhoto = false, kReadsStretch = true;
  static double Factor(const Settings& s) { return On(s) ? s.beta : 0; }
  struct Shape {
    float inverse_log_low = 0, inverse_log_high = 0;
    std::array<float, 4> Packed() const { return {inverse_log_low, inverse_log_high, 0, 0}; }
  };
  static Shape ShapeOf(const Settings& s) { return {InverseLog(s.resolution_low), InverseLog(s.resolution_high)}; }
  template <typename Sight>
  LUMI_INLINE static auto Value(const Sight& at, const Shape& shape) {
    using T = decltype(at.stretch());
    return ResolutionValue(at.stretch(), static_cast<T>(shape.inverse_log_low), static_cast<T>(shape.inverse_log_high));
  }
  static constexpr const char* kGlslValue = "ResolutionValue";
  static constexpr const char* kGlsl = R"(
float ResolutionValue(Sight s, vec4 shape) {
  float octaves = log2(clamp(s.stretch, 1e-12, 1e12));
  return RaisedCosine(1.0 - (octaves > 0.0 ? octaves * shape.y : -octaves * shape.x));
}
)";
  static constexpr std::string_view kHeatMapUnit = "", kHeatMapHelp = "That photo's resolution against the picture's";
  static double Shown(double value, const Settings&) { return value; }
  // A heat map of it while it is off shows the finer one.
  static void ShowAll(Settings& s) {
    if (!On(s)) s.resolution = lumi::Resolution::kJacobian;
  }

  class Evidence {
   public:
    explicit Evidence(const Settings& s) : shape_(ShapeOf(s)) {}
    void Look(std::span<const NearPhoto> photos) {
      double smallest = std::numeric_limits<double>::infinity(), largest = 0, offset = 0;
      long count = 0;
      for (const NearPhoto& p : photos) {
        if (!p.measured) continue;
        const double penalty =
            1 - static_cast<double>(ResolutionValue(static_cast<float>(std::exp2(p.octaves_jacobian)),
                                                    shape_.inverse_log_low, shape_.inverse_log_high));
        smallest = std::min(smallest, penalty);
        largest = std::max(largest, penalty);
        offset += p.octaves_jacobian - p.octaves_distance;
        ++count;
      }
      if (count < 2) return;
      penalty_.push_back(largest - smallest);
      for (const NearPhoto& p : photos)
        if (p.measured)
          disagreement_.push_back(
              std::abs(p.octaves_jacobian - p.octaves_distance - offset / static_cast<double>(count)));
    }
    Verdict Decide(const ViewFacts& facts, Settings& settings) const {
      // Of the largest penalty, between photos that would be blended, at half of the rays: a stretch by 1.73 beside
      // none. Where it is so at fewer, preferring the sharper photo over the nearer one in angle changed the error of
      // left-out photos by -0.2 to +0.07 dB.
      constexpr double kPenaltyThatCounts = 0.5, kMeasuresAgree = 0.25;  // octaves between the two ways
      const double penalty = AtShare(penalty_, 0.5), disagreement = AtShare(disagreement_, 0.9);
      Verdict v{penalty >= kPenaltyThatCounts, fmt::format("at half of the rays the nearest photos' penalties for "
                                                           "stretched pixels differ by {:.2f} of the largest or more",
                                                           penalty)};
      if (!v.on || facts.asked) return v;
      settings.resolution =
          facts.metric && disagreement <= kMeasuresAgree ? lumi::Resolution::kDistance : lumi::Resolution::kJacobian;
      if (facts.metric)
        v.evidence += fmt::format("; by distance and by Jacobian they differ by {:.2f} octaves: {}", disagreement,
                                  Name(settings.resolution));
      return v;
    }

   private:
    static double AtShare(std::vector<double> v, double share) {
      if (v.empty()) return 0;
      const auto at = static_cast<std::ptrdiff_t>(
          std::min(static_cast<double>(v.size() - 1), share * static_cast<double>(v.size())));
      std::nth_element(v.begin(), v.begin() + at, v.end());
      return v[static_cast<std::size_t>(at)];
    }
    Shape shape_;
    std::vector<double> penalty_;       // largest less smallest 1 - r among the photos of a ray
    std::vector<double> disagreement_;  // octaves, of a photo's relative sigma by the two ways
  };
};

}  // namespace measure
}  // namespace lumi
