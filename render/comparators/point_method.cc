#include "render/comparators/point_method.h"

#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

// Only angle and field of view: the other measures belong to this renderer.
RadianceSettings AngleAlone(const RadianceSettings& settings) {
  RadianceSettings s;
  ForEachEffect([&]<typename M> { M::Switch(s, false); });
  s.field_of_view = true;
  s.fov_feather = settings.fov_feather;
  return s;
}

}  // namespace

PointSight::PointSight(const ViewSetup& setup, const VisibilityMaps* visibility)
    : setup_(setup), visibility_(visibility), settings_(AngleAlone(setup.settings)) {}

bool PointSight::Look(const Eigen::Vector3d& direction, double t) {
  const Eigen::Vector3f d = direction.cast<float>();
  const auto t_float = static_cast<float>(t);
  EvaluateMeasures(setup_.sources, settings_, d, t_float, Eigen::Vector3f::Zero(), measures_);
  EvaluateVisibility(setup_.sources, visibility_, d, t_float, measures_);
  seeing_.clear();
  bool contained = false;
  for (std::int32_t j = 0; j < setup_.sources.count; ++j) {
    const auto i = static_cast<std::size_t>(j);
    if (!(measures_.f[i] > 0)) continue;
    contained = true;
    if (measures_.v[i] > kHalfVisible) seeing_.push_back(j);
  }
  // If the proxy hides the point from every photo, occlusion is ignored, so that the picture has no hole.
  for (std::int32_t j = 0; contained && seeing_.empty() && j < setup_.sources.count; ++j)
    if (measures_.f[static_cast<std::size_t>(j)] > 0) seeing_.push_back(j);
  return !seeing_.empty();
}

void PointMethod::Weigh(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays,
                        WeightTable& table) const {
  table.first.assign(1, 0);
  table.camera.clear();
  table.weight.clear();
  table.alpha.assign(rays.size(), 0.0F);
  const VisibilityMaps* const maps = heeds_visibility() ? visibility : nullptr;
  PointSight sight(setup, maps);
  WindowMemo memo;
  WeightedPhotos row;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double t = i < rays.exact_t.size() && rays.exact_t[i] > 0 ? rays.exact_t[i] : static_cast<double>(rays.t[i]);
    const Eigen::Vector3d d =
        i < rays.exact_direction.size() ? rays.exact_direction[i] : rays.direction[i].cast<double>().normalized();
    if (t > 0 && std::isfinite(t) && std::isfinite(rays.t[i]) && sight.Look(d, t)) {
      row.camera.clear();
      row.weight.clear();
      Eigen::Vector3d normal = i < rays.normal.size() ? rays.normal[i].cast<double>() : Eigen::Vector3d(-d);
      if (!(normal.squaredNorm() > 0)) normal = -d;
      if (normal.dot(d) > 0) normal = -normal;
      AtPoint({setup, maps, d, t, normal, i < rays.face.size() ? rays.face[i] : -1, sight.theta(), sight.f(), sight.v(),
               sight.seeing()},
              memo, row);
      double sum = 0;
      for (const float w : row.weight) sum += static_cast<double>(w);
      if (sum > 0) {
        table.alpha[i] = 1;
        for (std::size_t k = 0; k < row.camera.size(); ++k) {
          if (row.weight[k] == 0) continue;
          table.camera.push_back(row.camera[k]);
          table.weight.push_back(static_cast<float>(static_cast<double>(row.weight[k]) / sum));
        }
      }
    }
    table.first.push_back(static_cast<std::int32_t>(table.camera.size()));
  }
}

std::int32_t NearestInAngle(const PhotosAtPoint& point) {
  return *std::ranges::min_element(point.seeing, {},
                                   [&](std::int32_t j) { return point.theta[static_cast<std::size_t>(j)]; });
}

double FacingOf(const PhotosAtPoint& point, std::int32_t photo) {
  const Eigen::Vector3d to_photo = CentreOf(point.setup, photo) - point.point();
  const double distance = to_photo.norm();
  return distance > 0 ? std::max(0.0, point.normal.dot(to_photo) / distance) : 0;
}

}  // namespace lumi
