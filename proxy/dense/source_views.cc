#include "proxy/dense/source_views.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "scene/geometry/angle.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr double kBestAngleDeg = 5, kBelowDeg = 2, kAboveDeg = 12;

double Worth(double angle_deg) {
  if (angle_deg < kSmallestAngleDeg) return 0;
  const double off = (angle_deg - kBestAngleDeg) / (angle_deg < kBestAngleDeg ? kBelowDeg : kAboveDeg);
  return std::exp(-0.5 * off * off);
}

}  // namespace

std::vector<std::vector<SourceView>> PickSources(const Scene& scene, std::size_t most) {
  const std::size_t count = scene.views.size();
  // A view's points, so that pairs are met by way of points: thousands of photos share points with tens of others.
  std::vector<std::vector<std::size_t>> points(count);
  for (std::size_t p = 0; p < scene.points.size(); ++p) {
    if (!scene.points[p].x_in_world.allFinite()) continue;
    for (const Observation& o : scene.points[p].track) {
      std::vector<std::size_t>& of_view = points[static_cast<std::size_t>(o.view.value)];
      if (of_view.empty() || of_view.back() != p) of_view.push_back(p);
    }
  }
  std::vector<std::vector<SourceView>> sources(count);
  ParallelEach(count, 1, [&](std::size_t v) {
    const Eigen::Vector3d eye = scene.views[v].CentreInWorld();
    std::unordered_map<std::int32_t, std::vector<double>> angles;
    for (const std::size_t p : points[v]) {
      const Point& point = scene.points[p];
      std::vector<std::int32_t> seen;
      for (const Observation& o : point.track)
        if (o.view.value != static_cast<std::int32_t>(v)) seen.push_back(o.view.value);
      std::ranges::sort(seen);
      seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
      for (const std::int32_t other : seen) {
        const Eigen::Vector3d there = scene.views[static_cast<std::size_t>(other)].CentreInWorld();
        angles[other].push_back(AngleBetween(eye - point.x_in_world, there - point.x_in_world) / kRadPerDeg);
      }
    }
    for (auto& [other, of_pair] : angles) {
      SourceView s;
      s.view = ViewId{other};
      s.shared = of_pair.size();
      for (const double angle : of_pair) s.score += Worth(angle);
      s.angle_deg = Quantile(std::move(of_pair), 0.5);
      if (s.score > 0 && s.angle_deg >= kSmallestAngleDeg) sources[v].push_back(s);
    }
    std::ranges::sort(sources[v], [](const SourceView& a, const SourceView& b) {
      return a.score != b.score ? a.score > b.score : a.view < b.view;
    });
    if (sources[v].size() > most) sources[v].resize(most);
  });
  if (std::ranges::all_of(sources, [](const auto& s) { return s.empty(); }))
    throw DataError("no two photos see the same points from different places: stereo finds no depth",
                    "photograph from places that lie apart, not by turning on the spot");
  return sources;
}

}  // namespace lumi
