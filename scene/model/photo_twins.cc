#include "scene/model/photo_twins.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/geometry/angle.h"
#include "scene/geometry/constants.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

constexpr double kMostMoved = 5e-4;  // of the depth
constexpr double kMostTurnedDeg = 5;

// Median distance of what each view sees; of a view without points the scene's.
std::vector<double> Depths(const Scene& scene) {
  std::vector<std::vector<double>> of_view(scene.views.size());
  for (const Point& point : scene.points)
    for (const Observation& o : point.track) {
      const auto v = static_cast<std::size_t>(o.view.value);
      of_view[v].push_back((point.x_in_world - scene.views[v].CentreInWorld()).norm());
    }
  std::vector<double> depths, known;
  for (std::vector<double>& distances : of_view) {
    depths.push_back(distances.empty() ? 0 : Median(std::move(distances)));
    if (depths.back() > 0) known.push_back(depths.back());
  }
  const double usual = known.empty() ? 1 / scene.normalized_from_world.scale : Median(std::move(known));
  for (double& depth : depths)
    if (!(depth > 0)) depth = usual;
  return depths;
}

}  // namespace

PhotoTwins::PhotoTwins(const Scene& scene) : of_(scene.views.size()) {
  if (scene.frame != Frame::kMetric || scene.views.empty()) return;
  const std::vector<double> depths = Depths(scene);
  std::vector<Eigen::Vector3d> centres, axes;
  for (const View& view : scene.views) {
    centres.push_back(view.CentreInWorld());
    axes.push_back(view.cam_from_world.rotation.toRotationMatrix().row(2));
  }
  // Along one axis, only those near each other are compared.
  std::vector<int> order(scene.views.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](int v) { return centres[static_cast<std::size_t>(v)].x(); });
  const double farthest = kMostMoved * *std::ranges::max_element(depths);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto a = static_cast<std::size_t>(order[i]);
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const auto b = static_cast<std::size_t>(order[j]);
      if (!(centres[b].x() - centres[a].x() <= farthest)) break;
      if (scene.views[a].time_s || scene.views[b].time_s) continue;
      if ((centres[b] - centres[a]).norm() > kMostMoved * std::min(depths[a], depths[b])) continue;
      if (AngleBetween(axes[a], axes[b]) > kMostTurnedDeg * kRadPerDeg) continue;
      of_[a].push_back(order[j]);
      of_[b].push_back(order[i]);
    }
  }
}

int PhotoTwins::LeaveOut(std::vector<bool>& keep) const {
  std::vector<bool> without = keep;
  for (std::size_t v = 0; v < keep.size(); ++v)
    if (!keep[v])
      for (const int twin : of_[v]) without[static_cast<std::size_t>(twin)] = false;
  const auto before = std::ranges::count(keep, true), after = std::ranges::count(without, true);
  if (after == before || 2 * after < before) return 0;
  keep = std::move(without);
  return static_cast<int>(before - after);
}

}  // namespace lumi
