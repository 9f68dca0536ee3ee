#include "proxy/leave_out.h"

#include <utility>

#include "scene/files/evaluation_proxy.h"
#include "scene/model/photo_twins.h"

namespace lumi {

Scene WithPhotos(const Scene& scene, const std::vector<bool>& keep) {
  Scene out = scene;
  out.points.clear();
  for (const Point& point : scene.points) {
    Point kept = point;
    std::erase_if(kept.track, [&](const Observation& o) { return !keep[static_cast<std::size_t>(o.view.value)]; });
    if (kept.track.size() >= 2) out.points.push_back(std::move(kept));
  }
  return out;
}

std::vector<bool> PhotosWithoutFolds(const Scene& scene, int n, bool choosing) {
  std::vector<bool> keep(scene.views.size(), true);
  for (const ViewId v : FoldViews(scene, n, Fold::kReport)) keep[static_cast<std::size_t>(v.value)] = false;
  if (choosing)
    for (const ViewId v : FoldViews(scene, n, Fold::kChoose)) keep[static_cast<std::size_t>(v.value)] = false;
  PhotoTwins(scene).LeaveOut(keep);
  return keep;
}

std::vector<bool> PhotosWithoutEach(const Scene& scene, int k) {
  std::vector<bool> keep(scene.views.size(), true);
  for (auto v = static_cast<std::size_t>(k); v < keep.size(); v += kProxiesForEach) keep[v] = false;
  PhotoTwins(scene).LeaveOut(keep);
  return keep;
}

}  // namespace lumi
