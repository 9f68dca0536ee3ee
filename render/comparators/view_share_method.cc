#include "render/comparators/view_share_method.h"

#include <cmath>

namespace lumi {

void ViewShareMethod::AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const {
  constexpr double kNothing = 1e-12;
  double sum = 0;
  for (const std::int32_t j : point.seeing) {
    const auto i = static_cast<std::size_t>(j);
    if (!(share_[i] > 0)) continue;
    const double w = share_[i] * static_cast<double>(point.f[i]) * Seen(static_cast<double>(point.v[i])) *
                     std::pow(FacingOf(point, j), power_);
    out.camera.push_back(j);
    out.weight.push_back(static_cast<float>(w));
    sum += w;
  }
  if (sum > kNothing) return;
  out.camera.assign(1, NearestInAngle(point));
  out.weight.assign(1, 1.0F);
}

}  // namespace lumi
