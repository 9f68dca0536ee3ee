#include "proxy/dense/depth_start.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/geometry/median.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {
namespace {

constexpr double kOutlierShare = 0.005;      // of the points, at each end of the range
constexpr double kNearer = 2, kFarther = 4;  // how much nearer or farther than all points a surface may lie
constexpr double kMergePx = 2;

std::vector<Eigen::Vector4d> PointsOf(const Scene& scene, ViewId view) {
  std::vector<Eigen::Vector4d> points;
  for (const Point& point : scene.points) {
    if (!point.x_in_world.allFinite()) continue;
    if (std::ranges::any_of(point.track, [&](const Observation& o) { return o.view == view; }))
      points.emplace_back(point.x_in_world.homogeneous());
  }
  return points;
}

// Inverse depth over a triangle of the image, written to the pixels whose centres it holds.
void FillTriangle(const ViewTriangulation& t, const std::array<std::int32_t, 3>& corners, const DepthRange& range,
                  DepthMap& map) {
  std::array<Eigen::Vector2d, 3> x;
  std::array<double, 3> w;
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = t.x_px[static_cast<std::size_t>(corners[i])];
    w[i] = t.kappa[static_cast<std::size_t>(corners[i])];
  }
  const Eigen::Vector2d a = x[1] - x[0], b = x[2] - x[0];
  const double area = a.x() * b.y() - a.y() * b.x();
  if (area == 0) return;
  const double gx = ((w[1] - w[0]) * b.y() - (w[2] - w[0]) * a.y()) / area;
  const double gy = ((w[2] - w[0]) * a.x() - (w[1] - w[0]) * b.x()) / area;
  const auto [top, bottom] = std::minmax({x[0].y(), x[1].y(), x[2].y()});
  const int y0 = std::max(0, static_cast<int>(std::ceil(top - 0.5)));
  const int y1 = std::min(map.height - 1, static_cast<int>(std::floor(bottom - 0.5)));
  for (int j = y0; j <= y1; ++j) {
    // The triangle's extent in this row.
    const double y = j + 0.5;
    double left = std::numeric_limits<double>::infinity(), right = -left;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector2d &p = x[i], &q = x[(i + 1) % 3];
      if ((p.y() < y && q.y() < y) || (p.y() > y && q.y() > y)) continue;
      const double share = p.y() == q.y() ? 0 : (y - p.y()) / (q.y() - p.y());
      for (const double at :
           {p.x() + share * (q.x() - p.x()), p.y() == q.y() ? q.x() : p.x() + share * (q.x() - p.x())}) {
        left = std::min(left, at);
        right = std::max(right, at);
      }
    }
    const int i0 = std::max(0, static_cast<int>(std::ceil(left - 0.5)));
    const int i1 = std::min(map.width - 1, static_cast<int>(std::floor(right - 0.5)));
    for (int i = i0; i <= i1; ++i) {
      const std::size_t p = map.At(i, j);
      const double inverse_depth = w[0] + gx * (i + 0.5 - x[0].x()) + gy * (y - x[0].y());
      const bool inside = inverse_depth >= range.farthest_w && inverse_depth <= range.nearest_w;
      map.w[p] = std::clamp(static_cast<float>(inverse_depth), range.farthest_w, range.nearest_w);
      map.gx[p] = inside ? static_cast<float>(gx) : 0;
      map.gy[p] = inside ? static_cast<float>(gy) : 0;
    }
  }
}

}  // namespace

std::optional<DepthRange> RangeOf(const Scene& scene, ViewId view) {
  const std::vector<double> depths = PointDepths(scene, view);
  if (depths.size() < kFewestPoints) return std::nullopt;
  const auto at = [&](double share) {
    return depths[static_cast<std::size_t>(std::lround(share * static_cast<double>(depths.size() - 1)))];
  };
  return DepthRange{static_cast<float>(kNearer / at(kOutlierShare)),
                    static_cast<float>(1 / (kFarther * at(1 - kOutlierShare)))};
}

DepthMap StartingPlanes(const Scene& scene, ViewId view, const StereoCamera& camera, const DepthRange& range) {
  DepthMap map(camera.width, camera.height);
  const std::vector<double> depths = PointDepths(scene, view);
  std::ranges::fill(map.w,
                    std::clamp(static_cast<float>(1 / depths[depths.size() / 2]), range.farthest_w, range.nearest_w));
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
  K.diagonal().head<2>() = camera.focal_px;
  K.col(2).head<2>() = camera.centre_px;
  ViewTriangulationOptions options;
  options.merge_px = kMergePx;
  const ViewTriangulation t = TriangulateView(ProjectionMatrix(K, camera.cam_from_world), {camera.width, camera.height},
                                              PointsOf(scene, view), Plane(0, 0, 0, 1), options);
  for (const std::array<std::int32_t, 3>& corners : t.triangles) FillTriangle(t, corners, range, map);
  return map;
}

}  // namespace lumi
