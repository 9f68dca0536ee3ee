#include "render/comparators/photo_rank.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "scene/geometry/median.h"

namespace lumi {

double MedianDepth(const ViewSetup& setup, const ProxyTracer& proxy) {
  constexpr int kSide = 16;
  std::vector<Eigen::Vector3f> directions;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      directions.push_back((setup.ray_from_pixel * Eigen::Vector3d((x + 0.5) / kSide * setup.desired.size_px.x(),
                                                                   (y + 0.5) / kSide * setup.desired.size_px.y(), 1))
                               .normalized()
                               .cast<float>());
  std::vector<float> t(directions.size());
  proxy.Trace(setup.desired.centre.cast<float>(), directions, t);
  const Eigen::Vector3f axis = AxisOf(setup.desired).cast<float>();
  std::vector<float> depths;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (t[i] > 0 && std::isfinite(t[i])) depths.push_back(t[i] * axis.dot(directions[i]));
  return depths.empty() ? 1.0 : static_cast<double>(Median(depths));
}

Eigen::Vector3d AxisOf(const RenderView& view) { return view.P.row(2).head<3>().transpose().normalized(); }

std::vector<RankedPhoto> RankPhotos(const Sources& sources, const ViewSetup& setup, double median_depth) {
  std::vector<RankedPhoto> ranked;
  const Eigen::Vector3d axis = AxisOf(setup.desired);
  for (std::int32_t j = 0; j < setup.sources.count; ++j) {
    if (!(setup.sources.enabled[static_cast<std::size_t>(j)] > 0)) continue;
    const RenderView& view = sources.views[static_cast<std::size_t>(setup.sources.view[static_cast<std::size_t>(j)])];
    const Eigen::Vector3d other = AxisOf(view);
    const double baseline = (view.centre - setup.desired.centre).norm();
    ranked.push_back(
        {j, std::atan2(baseline, median_depth) + 2 * std::atan2((axis - other).norm(), (axis + other).norm())});
  }
  std::ranges::sort(ranked, {}, [](const RankedPhoto& p) { return std::tuple(p.distance, p.photo); });
  return ranked;
}

}  // namespace lumi
