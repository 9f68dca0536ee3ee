#include "proxy/leave_out.h"

#include <utility>

namespace lumi {

Scene WithViews(const Scene& scene, const std::vector<bool>& keep) {
  Scene out = scene;
  std::vector<std::int32_t> position(scene.views.size(), -1);
  out.views.clear();
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (!keep[v]) continue;
    position[v] = static_cast<std::int32_t>(out.views.size());
    out.views.push_back(scene.views[v]);
  }
  out.points.clear();
  for (const Point& point : scene.points) {
    Point kept = point;
    kept.track.clear();
    for (const Observation& o : point.track)
      if (const std::int32_t to = position[static_cast<std::size_t>(o.view.value)]; to >= 0)
        kept.track.push_back({ViewId{to}, o.x_px});
    if (kept.track.size() >= 2) out.points.push_back(std::move(kept));
  }
  return out;
}

std::vector<bool> ViewsWithoutFolds(const Scene& scene, int n, bool choosing) {
  std::vector<bool> keep(scene.views.size(), true);
  for (const ViewId v : FoldViews(scene, n, Fold::kReport)) keep[static_cast<std::size_t>(v.value)] = false;
  if (choosing)
    for (const ViewId v : FoldViews(scene, n, Fold::kChoose)) keep[static_cast<std::size_t>(v.value)] = false;
  return keep;
}

}  // namespace lumi
