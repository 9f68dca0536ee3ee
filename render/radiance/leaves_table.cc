#include "render/radiance/leaves_table.h"

#include <cmath>

#include "render/radiance/correlation.h"

namespace lumi {
namespace {

constexpr int kAnOctave = 64;
constexpr int kOctaves = 40;  // down to 1e-12 of 2 r_max

}  // namespace

LeavesTable::LeavesTable(double r_min_rad, double r_max_rad) : r_min_(r_min_rad), r_max_(r_max_rad) {
  const FallingLeaves leaves(r_min_rad, r_max_rad);
  value_.reserve(kAnOctave * kOctaves + 2);
  for (int i = 0; i < kAnOctave * kOctaves + 2; ++i) value_.push_back(leaves.PSame(2 * r_max_rad * std::exp2(-static_cast<double>(i) / kAnOctave)));
}

double LeavesTable::operator()(double h) const {
  if (!(h < 2 * r_max_)) return 0;
  if (!(h > 0)) return 1;
  const double at = -kAnOctave * std::log2(h / (2 * r_max_));
  if (at >= kAnOctave * kOctaves) return r_min_ > 0 ? 1 : value_.back();
  const auto i = static_cast<std::size_t>(at);
  const double a = at - static_cast<double>(i);
  return (1 - a) * value_[i] + a * value_[i + 1];
}

}  // namespace lumi
