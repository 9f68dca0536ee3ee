#include "render/radiance/leaves_table.h"

#include <cmath>

#include "render/radiance/correlation.h"

namespace lumi {
namespace {

// Towards 0 in octaves of h; towards 2 r_max, where P_same vanishes and what is left of it is normalised, in s = sqrt(1
// - y), y = h / (2 r_max): P_same / s^3 is smooth there, for leaves of one size and of many.
constexpr int kAnOctave = 64;
constexpr int kFirstOctave = 2;  // below y = 1/4
constexpr int kOctaves = 38;     // down to 1e-12 of 2 r_max
constexpr int kEnd = 512;        // intervals of s over y in [1/4, 1]
constexpr double kLargestS = 0.8660254037844386;
constexpr int kFirstNode = 8;  // nearer to the end P_same is below 1e-5 and its digits are gone

}  // namespace

LeavesTable::LeavesTable(double r_min_rad, double r_max_rad) : r_min_(r_min_rad), r_max_(r_max_rad) {
  const FallingLeaves leaves(r_min_rad, r_max_rad);
  small_.reserve(kAnOctave * kOctaves + 2);
  for (int i = 0; i < kAnOctave * kOctaves + 2; ++i)
    small_.push_back(leaves.PSame(2 * r_max_rad * std::exp2(-kFirstOctave - static_cast<double>(i) / kAnOctave)));
  end_.resize(kEnd + 1);
  for (int i = kFirstNode; i <= kEnd; ++i) {
    const double s = kLargestS * i / kEnd;
    end_[static_cast<std::size_t>(i)] = leaves.PSame(2 * r_max_rad * (1 - s * s)) / (s * s * s);
  }
  for (std::size_t i = 0; i < kFirstNode; ++i) end_[i] = end_[kFirstNode];
}

double LeavesTable::operator()(double h) const {
  const double y = h / (2 * r_max_);
  if (!(y < 1)) return 0;
  if (!(y > 0)) return 1;
  const auto between = [](const std::vector<double>& value, double at) {
    const auto i = static_cast<std::size_t>(at);
    const double a = at - static_cast<double>(i);
    return i + 1 < value.size() ? (1 - a) * value[i] + a * value[i + 1] : value.back();
  };
  if (y >= 0.25) {
    const double s = std::sqrt(1 - y);
    return s * s * s * between(end_, s * (kEnd / kLargestS));
  }
  const double at = kAnOctave * (-kFirstOctave - std::log2(y));
  if (at >= kAnOctave * kOctaves) return r_min_ > 0 ? 1 : small_.back();
  return between(small_, at);
}

}  // namespace lumi
