#include "render/tradeoff/measure.h"

#include <algorithm>
#include <cmath>

#include "render/holdout/holdout.h"
#include "render/path/camera_path.h"
#include "render/time/clock.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

std::vector<ViewId> Spread(const std::vector<ViewId>& all, int most) {
  const auto n = all.size(), m = std::min(n, static_cast<std::size_t>(std::max(1, most)));
  std::vector<ViewId> chosen;
  for (std::size_t i = 0; i < m; ++i) chosen.push_back(all[(2 * i + 1) * n / (2 * m)]);
  return chosen;
}

}  // namespace

TestView TestViewOf(const Scene& scene, ViewId id, int width_px) {
  const View& view = scene.views[static_cast<std::size_t>(id.value)];
  TestView t{view.name, id, HeldOutView(scene, view, width_px), {}, {}};
  t.photo = Resize(ReadImage8(scene.ImagePath(view), 3), t.view.size_px.x(), t.view.size_px.y());
  return t;
}

int HoldoutWithPhotos(const Scene& scene, int n, Fold fold) {
  while (n > 2 && FoldViews(scene, n, fold).empty()) --n;
  return n;
}

std::vector<TestView> HeldOutViews(const Scene& scene, int n, Fold fold, int most, int width_px) {
  const std::size_t count = scene.views.size();
  if (count < 2)
    throw DataError("too few photos to hold any out: " + std::to_string(count), "add photos", scene.folder);
  n = HoldoutWithPhotos(scene, n, fold);
  const std::vector<ViewId> held = FoldViews(scene, n, fold);
  const std::vector<bool> use = PhotosWithout(scene, n, fold);
  std::vector<TestView> views;
  for (const ViewId id : Spread(held, most)) {
    TestView t = TestViewOf(scene, id, width_px);
    t.use = use;
    views.push_back(std::move(t));
  }
  return views;
}

Mesh FacingPlane(const Scene& scene, double times) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), forward = Eigen::Vector3d::Zero();
  std::vector<double> depths;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& v = scene.views[i];
    centre += v.CentreInWorld() / static_cast<double>(scene.views.size());
    forward += v.cam_from_world.R().row(2).transpose();
    const std::vector<double> d = PointDepths(scene, {static_cast<std::int32_t>(i)});
    if (!d.empty()) depths.push_back(d[d.size() / 2]);
  }
  if (forward.norm() < 1e-6 * static_cast<double>(scene.views.size()))
    forward = scene.views.front().cam_from_world.R().row(2).transpose();
  const double depth = times * (depths.empty() ? 1.0 / scene.normalized_from_world.scale : Median(depths));
  const Eigen::Vector3d n = forward.normalized(), x = n.unitOrthogonal(), y = n.cross(x), c = centre + depth * n;
  const double side = 20 * depth;
  Mesh m;
  m.vertices = {c - side * x - side * y, c + side * x - side * y, c + side * x + side * y, c - side * x + side * y};
  m.faces = {{0, 1, 2}, {0, 2, 3}};
  return m;
}

RenderView FirstOfPath(const Scene& scene, const std::filesystem::path& file, int width_px) {
  const CameraPath path = ReadCameraPath(file);
  const Eigen::Vector2d aspect = path.width_px > 0 && path.height_px > 0
                                     ? Eigen::Vector2d(path.width_px, path.height_px)
                                     : SizePx(scene, scene.views.front()).cast<double>();
  const int height = std::max(1, static_cast<int>(std::lround(width_px * aspect.y() / aspect.x())));
  RenderView view = SamplePath(path, width_px, height).front();
  view.time_s = FirstTime(scene);
  return view;
}

TimedFrame TimeFrame(Renderer& renderer, const RenderRequest& request, int repeats, double alone_ms) {
  TimedFrame result;
  const auto once = [&] {
    CheckInterrupted();
    const Stopwatch watch;
    result.image = renderer.Render(request);
    return 1000 * watch.Seconds();
  };
  result.first_ms = once();
  if (result.first_ms > alone_ms || repeats == 0) {
    result.all_ms = {result.first_ms};
  } else {
    if (result.first_ms > kSlowMs) repeats = 1;
    for (int i = 0; i < repeats; ++i) result.all_ms.push_back(once());
  }
  result.ms = Median(result.all_ms);
  return result;
}

}  // namespace lumi
