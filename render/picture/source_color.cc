#include "render/picture/source_color.h"

#include <algorithm>
#include <cmath>

namespace lumi {

Eigen::Vector3f SourceColor(int view_index) {
  // Hues a golden ratio apart never come close for neighbours; three lightnesses tell hues that meet again apart.
  const double hue = std::fmod(0.61803398875 * view_index, 1.0) * 6.0;
  const double saturation = view_index % 2 == 0 ? 0.95 : 0.6;
  const double value = 1.0 - 0.18 * (view_index % 3);
  Eigen::Vector3f rgb;
  for (int i = 0; i < 3; ++i) {
    const double k = std::fmod(5.0 - 2.0 * i + hue, 6.0);
    rgb[i] = static_cast<float>(value - value * saturation * std::max(0.0, std::min({k, 4.0 - k, 1.0})));
  }
  return rgb;
}

}  // namespace lumi
