#include "render/world/per_view_proxy.h"

#include <algorithm>

#include "render/world/vanishing_point.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
PerViewProxy::PerViewProxy(const Scene& scene, const PerViewOptions& options)
    : scene_(scene),
      options_(options),
      order_(scene),
      seen_(scene.views.size()),
      plane_at_infinity_(PlaneAtInfinity(scene)) {
  if (!plane_at_infinity_)
    throw DataError("this scene has matrices and points, but no plane at infinity: its rays have no angles",
                    "lumi-reconstruct --backend factorization --projective finds one (a quasi-affine scene)",
                    scene.folder);
  for (const std::int32_t i : TrustedPoints(scene)) {
    const Point& p = scene.points[static_cast<std::size_t>(i)];
    for (const Observation& o : p.track)
      seen_[static_cast<std::size_t>(o.view.value)].push_back(static_cast<std::int32_t>(points_.size()));
    points_.push_back(Homogeneous(scene, p));
  }
  if (points_.empty())
    throw DataError("the scene has no reliable points to triangulate in each view",
                    "use a proxy, which needs none: lumi-proxy plane SCENE, or lumi-proxy plane WORKSPACE -o plane.ply",
                    scene.folder);
}

std::vector<Eigen::Vector4d> PerViewProxy::PointsOf(std::pair<int, int> ranks) const {
  if (ranks.first == 0 && ranks.second == order_.count() - 1) return points_;
  std::vector<std::int32_t> points;
  for (int rank = ranks.first; rank <= ranks.second; ++rank) {
    const auto& seen = seen_[static_cast<std::size_t>(order_.view(rank))];
    points.insert(points.end(), seen.begin(), seen.end());
  }
  if (points.empty()) return points_;
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::vector<Eigen::Vector4d> X;
  for (const std::int32_t i : points) X.push_back(points_[static_cast<std::size_t>(i)]);
  return X;
}

PictureWorld PerViewProxy::For(const RenderView& view, int reach) const {
  const std::pair<int, int> ranks = order_.Around(view.time_s, reach);
  const ViewTriangulation own =
      TriangulateView(view.P, view.size_px, PointsOf(ranks), plane_at_infinity_, options_.triangulation);
  PictureWorld world;
  for (int rank = ranks.first; rank <= ranks.second; ++rank) world.photos.push_back(order_.view(rank));
  world.use.assign(world.photos.size(), true);
  world.view = view;
  if (scene_.frame == Frame::kMetric) {
    world.sources.normalized_from_world = scene_.normalized_from_world;
    for (const std::int32_t i : world.photos)
      world.sources.views.push_back(
          Normalized(MakeRenderView(scene_, scene_.views[static_cast<std::size_t>(i)]), scene_.normalized_from_world));
    world.proxy = MeshOf(own);
    return world;
  }
  const Eigen::Matrix3d K0 = NominalCalibration(
      view.size_px, options_.nominal_focal_px > 0 ? options_.nominal_focal_px : NominalFocalPx(view.size_px));
  // The plane's sign and the depth of 1 follow from the points in view or, if there are none, from all points.
  Plane plane = *plane_at_infinity_;
  int sign = 0;
  for (const Eigen::Vector4d& X : own.vertices.empty() ? points_ : own.vertices) sign += plane.dot(X) > 0 ? 1 : -1;
  if (sign < 0) plane = -plane;
  const double unit_kappa = own.vertices.empty() ? 1 : Median(own.kappa);
  const auto frame = VanishingPointFrame::Make(view.P, plane, K0, unit_kappa);
  if (!frame)
    throw DataError("a picture's centre of projection lies on the scene's plane at infinity: its rays have no angles",
                    "take another path", scene_.folder);
  world.view.P = frame->P();
  world.view.centre.setZero();
  for (std::size_t k = 0; k < world.photos.size(); ++k) {
    const View& v = scene_.views[static_cast<std::size_t>(world.photos[k])];
    RenderView source;
    source.size_px = v.size_px;
    source.time_s = v.time_s;
    source.gain = v.gain;
    source.grids = v.grids;
    if (const auto moved = frame->MoveCamera(v.P)) {
      source.P = moved->P;
      source.centre = moved->centre;
    } else {
      source.P = frame->P();  // placeholder; the camera is not used
      world.use[k] = false;
    }
    world.sources.views.push_back(source);
  }
  if (own.vertices.empty()) {
    // No point says how far away anything is. One depth for all: right where the camera only turned.
    const double w = view.size_px.x(), h = view.size_px.y(), around = options_.triangulation.margin * std::max(w, h);
    for (const Eigen::Vector2d& x : {Eigen::Vector2d(-around, -around), Eigen::Vector2d(-around, h + around),
                                     Eigen::Vector2d(w + around, h + around), Eigen::Vector2d(w + around, -around)})
      world.proxy.vertices.push_back(frame->At(x, unit_kappa));
    world.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
    return world;
  }
  TakeFields(world.sources);
  world.proxy.faces = own.triangles;
  for (std::size_t i = 0; i < own.vertices.size(); ++i)
    world.proxy.vertices.push_back(frame->At(own.x_px[i], own.kappa[i]));
  return world;
}

}  // namespace lumi
