#include <algorithm>

#include "reconstruct/factorization/reconstruct_from_tracks.h"

namespace lumi {
namespace {

// Times the extent of the cameras: beyond, a point is a direction.
constexpr double kFarthest = 1e4;

}  // namespace

Scene ToScene(const FactorizationResult& result, const Tracks& tracks) {
  Scene scene;
  scene.frame = result.upgrade == UpgradeKind::kMetric        ? Frame::kMetric
                : result.upgrade == UpgradeKind::kQuasiAffine ? Frame::kQuasiAffine
                                                              : Frame::kProjective;
  const bool metric = scene.frame == Frame::kMetric;
  std::vector<std::size_t> order;
  for (std::size_t f = 0; f < tracks.frames.size(); ++f)
    if (f < result.placed.size() && result.placed[f]) order.push_back(f);
  std::ranges::stable_sort(order,
                           [&](std::size_t a, std::size_t b) { return tracks.frames[a].name < tracks.frames[b].name; });
  if (metric) scene.cameras.push_back(*result.camera);
  std::vector<int> view_of(tracks.frames.size(), -1);
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (const std::size_t f : order) {
    View view;
    view.name = tracks.frames[f].name;
    if (!metric) {
      view.P = result.P[f];
      view.size_px = tracks.frames[f].size_px;
    }
    if (metric) {
      view.camera = CameraId{0};
      view.cam_from_world = result.cam_from_world[f];
      low = low.cwiseMin(view.CentreInWorld());
      high = high.cwiseMax(view.CentreInWorld());
    }
    view_of[f] = static_cast<int>(scene.views.size());
    scene.views.push_back(std::move(view));
  }
  const double farthest = metric ? kFarthest * (high - low).norm() : 1e8;
  for (const FactorizationPoint& p : result.points) {
    if (!(p.X.w() * farthest > p.X.head<3>().norm())) continue;
    Point point;
    if (metric)
      point.x_in_world = p.X.hnormalized();
    else
      point.X_in_world = p.X;
    const Track& track = tracks.tracks[static_cast<std::size_t>(p.track)];
    point.color = track.color;
    point.error_px = p.error_px;
    for (const int o : p.observations) {
      const TrackObservation& seen = track.observations[static_cast<std::size_t>(o)];
      point.track.push_back({ViewId{view_of[static_cast<std::size_t>(seen.frame)]}, seen.x_px});
    }
    scene.points.push_back(std::move(point));
  }
  if (!metric) scene.plane_at_infinity = result.plane_at_infinity;
  UpdateFrameOfReference(scene);
  return scene;
}

}  // namespace lumi
