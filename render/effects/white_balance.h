// The photos' white balances relative to one another, from the colours that photos of one scene point have: log (red /
// green) = a_point + b_photo, and so with blue, by robust least squares. Brightness, and with it vignetting, falls out
// of the ratio.
#pragma once

#include <array>
#include <vector>

#include "render/effects/track_colors.h"

namespace lumi {

struct WhiteBalances {
  // One a view, RGB: geometric mean 1 over the channels, and of each ratio over the views; 1 where nothing is known.
  std::vector<std::array<double, 3>> of_view;
  double spread = 1;  // largest over smallest ratio of two channels of the views that are known well
  double noise = 1;   // the spread that chance alone gives (99 %)
  // 2 %: five code values in full white, where a cast begins to show beside another.
  bool Differ() const { return spread > 1.02 && spread > noise; }
};

WhiteBalances EstimateWhiteBalances(const std::vector<ColorSample>& samples, std::size_t points, std::size_t views);

}  // namespace lumi
