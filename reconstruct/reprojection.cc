#include "reconstruct/reprojection.h"

#include "scene/program/parallel_each.h"

namespace lumi {

double UpdatePointErrors(Scene& scene) {
  ParallelEach(scene.points.size(), 256, [&](std::size_t i) {
    Point& point = scene.points[i];
    double sum = 0;
    for (const Observation& o : point.track) {
      const View& view = scene.views[static_cast<std::size_t>(o.view.value)];
      const auto x_px = scene.CameraOf(view).Project(view.cam_from_world * point.x_in_world);
      sum += x_px ? (*x_px - o.x_px).norm() : kBehindCameraPx;
    }
    point.error_px = point.track.empty() ? 0 : sum / static_cast<double>(point.track.size());
  });
  double sum = 0, count = 0;
  for (const Point& point : scene.points) {
    sum += point.error_px * static_cast<double>(point.track.size());
    count += static_cast<double>(point.track.size());
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace lumi
