// A proxy of its own for each picture (thesis sec. 6.2.3): structure points triangulated in the virtual view. It needs
// no mesh, in any frame of the world, and it is the proxy of scenes that have points but no metric.
//
// Each picture also has its own photos, those taken around its moment (sec. 6.4.3), whose points are used, and, in a
// scene without a metric, its own world, in which angles are those of vanishing points (vanishing_point.h).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "render/time/photo_order.h"
#include "render/world/picture_world.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {

constexpr const char* kPerViewProxy = "per-view";  // as the name of a proxy on the command line

struct PerViewOptions {
  ViewTriangulationOptions triangulation;
  double nominal_focal_px = 0;  // of a scene without a metric; 0: NominalFocalPx(of the view)
};

class PerViewProxy {
 public:
  // `scene` must outlive it; its photos' gains and times are read with each picture. Throws DataError for a scene
  // without a point that can be trusted, and for one of matrices without a plane at infinity.
  explicit PerViewProxy(const Scene& scene, const PerViewOptions& options = {});
  // `reach`: photos to either side in time, -1: all of them. The structure points are those that these photos see (all,
  // where they see none). Throws DataError for a view whose centre lies on the plane at infinity.
  PictureWorld For(const RenderView& view, int reach = -1) const;
  std::size_t points() const { return points_.size(); }
  const PhotoOrder& order() const { return order_; }

 private:
  std::vector<Eigen::Vector4d> PointsOf(std::pair<int, int> ranks) const;

  const Scene& scene_;
  PerViewOptions options_;
  PhotoOrder order_;
  std::vector<Eigen::Vector4d> points_;          // trusted, the best first
  std::vector<std::vector<std::int32_t>> seen_;  // by each view of the scene, into points_
  std::optional<Plane> plane_at_infinity_;
};

}  // namespace lumi
