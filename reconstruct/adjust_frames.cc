#include "reconstruct/adjust_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include "reconstruct/mapping.h"
#include "reconstruct/reprojection.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Cameras, keyframes among them, in the last adjustment: its time grows with their square, and the lens is then known
// better than keyframes alone know it (docs/reconstruct.md).
constexpr std::size_t kAdjustedCameras = 150;
constexpr int kAdjustIterations = 25;
// Of the observations' median error: what is further off has no part in the adjustment.
constexpr double kFarOff = 4;

}  // namespace

void AdjustWithFrames(Scene& scene, const std::vector<PlacedCamera>& placed, bool lens_known, const ColmapJob& job) {
  std::vector<const PlacedCamera*> usable;
  for (const PlacedCamera& p : placed)
    if (p.ok) usable.push_back(&p);
  const std::size_t keyframes = scene.views.size();
  const std::size_t more = std::min(usable.size(), kAdjustedCameras > keyframes ? kAdjustedCameras - keyframes : 0);
  if (more == 0) return;
  Scene extended = scene;
  for (std::size_t i = 0; i < more; ++i) {
    const PlacedCamera& p = *usable[(2 * i + 1) * usable.size() / (2 * more)];
    const auto index = static_cast<std::int32_t>(extended.views.size());
    View view;
    view.name = fmt::format("~{:06d}", i);  // sorts after any frame's
    view.camera = scene.views.front().camera;
    view.cam_from_world = p.cam_from_world;
    std::set<std::int32_t> once;
    for (const auto& [point, x] : p.observations)
      if (once.insert(point).second)
        extended.points[static_cast<std::size_t>(point)].track.push_back({ViewId{index}, x});
    extended.views.push_back(std::move(view));
  }
  // Single wrong sightings of right points.
  const auto error = [&](const Point& point, const Observation& o) {
    const View& view = extended.views[static_cast<std::size_t>(o.view.value)];
    const auto x = extended.CameraOf(view).Project(view.cam_from_world * point.x_in_world);
    return x ? (*x - o.x_px).norm() : kBehindCameraPx;
  };
  std::vector<double> errors;
  for (const Point& point : extended.points)
    for (const Observation& o : point.track) errors.push_back(error(point, o));
  if (errors.empty()) return;
  const double limit = kFarOff * Median(std::move(errors));
  for (Point& point : extended.points)
    std::erase_if(point.track, [&](const Observation& o) { return error(point, o) > limit; });
  std::erase_if(extended.points, [](const Point& point) { return point.track.size() < 2; });
  UpdatePointErrors(extended);
  const Scene adjusted = PolishCameras(extended, lens_known, kAdjustIterations, job);

  // The adjusted scene has the same points in another order: they are recognised by place, as a place in a photo
  // belongs to one point.
  std::map<std::tuple<std::string, double, double>, std::size_t> point_at;
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (const Observation& o : scene.points[p].track)
      point_at[{scene.views[static_cast<std::size_t>(o.view.value)].name, o.x_px.x(), o.x_px.y()}] = p;
  std::map<std::string, Rigid3> pose_of;
  for (const View& view : adjusted.views) pose_of[view.name] = view.cam_from_world;
  if (!std::ranges::all_of(scene.views, [&](const View& view) { return pose_of.count(view.name) > 0; })) return;
  std::vector<char> kept(scene.points.size(), 0);
  for (const Point& point : adjusted.points)
    for (const Observation& o : point.track) {
      const auto at =
          point_at.find({adjusted.views[static_cast<std::size_t>(o.view.value)].name, o.x_px.x(), o.x_px.y()});
      if (at == point_at.end()) continue;
      scene.points[at->second].x_in_world = point.x_in_world;
      kept[at->second] = 1;
      break;
    }
  for (View& view : scene.views) view.cam_from_world = pose_of[view.name];
  scene.cameras[static_cast<std::size_t>(scene.views.front().camera.value)] = adjusted.CameraOf(adjusted.views.front());
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    if (!kept[p]) scene.points[p].track.clear();
}

}  // namespace lumi
