// How radiance is reconstructed at a ray (thesis chapters 4 and 5): the options of lumi-render that the weights depend
// on. Angles in radians. A measure that is off costs nothing: kernels and shaders are compiled without it.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "render/radiance/measures/list.h"

namespace lumi {

struct LeavesByPlace;

// S w = y with all photos that correlate with the ray (Eq. 4.1), or S taken for the identity (sec. 5.1.1).
enum class Similarity { kIdentity, kFull };
// R(h): 1/h windowed at the k+1st (Eq. 5.1), or the falling-leaves model's (Eqs. 4.3 to 4.5, corrected). kMeasured: the
// falling leaves that fit the photos; Lumigraph::ChooseMeasures replaces it by kFallingLeaves with these, before
// weights are computed.
enum class Correlation { kInverse, kFallingLeaves, kMeasured };
// How field of view and visibility enter the optimum: S_ij = f_i f_j R(h_ij), y_i = f_i R(h_i), or Eq. 4.7's sum.
enum class Combine { kSmooth, kAdditive };
// How the optimum's weights come to sum to 1 (sec. 4.1, and docs/optimum.md).
enum class WeightSum { kRenormalise, kConstrained, kLocalMean };
// What the sparse samples (sec. 5.1.3) give a pixel: its photos, which it then weighs itself, or their weights,
// interpolated.
enum class Sampling { kCandidates, kInterpolated };

// Whose formula weighs the photos: this project's unstructured lumigraph, or a published method that it is compared
// with (render/comparators/).
enum class Algorithm {
  kUlr,
  kChenWilliams1993,
  kLevoyHanrahan1996,
  kGortler1996,
  kDebevec1996,
  kSeitzDyer1996,
  kPulli1997,
  kDebevec1998,
  kPighin1998,
  kHeigl1999,
  kLhuillierQuan1999,
  kWood2000,
  kSibrUlr,
};

// Each measure's own options are members, too: alpha, field_of_view, resolution, time ... (measures/).
struct RadianceSettings : MeasureList::Settings {
  Similarity similarity = Similarity::kIdentity;
  int k = 4;  // photos a ray blends, 1..kMaxBlend; 0: all
  Correlation correlation = Correlation::kInverse;
  Combine combine = Combine::kSmooth;
  WeightSum sum = WeightSum::kLocalMean;
  double cutoff_rad = 20 * kRadPerDeg;    // the optimum leaves out photos farther from the ray, (0, pi]
  double accuracy = 1e-3;                 // of the optimum's weights, > 0: 1e-4 and up take single precision
  double r_min_rad = 0.001 * kRadPerDeg;  // smallest and largest leaf, 0 <= r_min <= r_max
  double r_max_rad = 5 * kRadPerDeg;
  double noise =
      0;  // variance of each photo's own noise over that of the radiance, >= 0: the optimum averages noise out
  // Correlation::kMeasured: this many places along the scene's longest side may have different leaves; 1: all have the
  // same.
  int correlation_regions = 1;
  // The leaves measured there, used in place of r_min, r_max and noise; none: these hold everywhere. Valid for one
  // scene only.
  std::shared_ptr<const LeavesByPlace> by_place;

  int grid_columns = 0, grid_rows = 0;  // sparse samples of the view, >= 2; 0: every pixel
  bool epipoles = true;                 // sparse samples at the photos' centres, too
  Sampling sampling = Sampling::kCandidates;

  Algorithm method = Algorithm::kUlr;
  // Parameters of a published method (docs/methods.md); negative: the paper's own value.
  double method_count = -1, method_parameter = -1;

  bool Sparse() const { return grid_columns > 0; }
  bool operator==(const RadianceSettings&) const = default;
};

// Empty, or what is wrong, naming the option.
std::string Validate(const RadianceSettings& settings);

// Names as the options spell them ("falling-leaves" ...).
std::string_view Name(Similarity v);
std::string_view Name(Correlation v);
std::string_view Name(Combine v);
std::string_view Name(WeightSum v);
std::string_view Name(Sampling v);
std::string_view Name(Algorithm v);
// All, in the order of their years; the first is kUlr.
std::span<const Algorithm> Algorithms();

// The most cameras a pixel may blend where k is not "all".
constexpr int kMaxBlend = 16;

// A photo whose field-of-view value lies below this fades out of the alpha of a pixel that no other photo covers, and
// out of an interpolated weight.
constexpr float kAlphaFullAt = 0.05F;

}  // namespace lumi
