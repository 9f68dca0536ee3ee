#include "proxy/plane/plane_proxy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// Without points: a plane this many times as far away as the cameras are apart, so that the parallax between
// neighbours stays moderate.
constexpr double kDepthPerSpacing = 5;

double MedianCameraSpacing(const std::vector<ProxyView>& views) {
  std::vector<double> nearest;
  for (std::size_t i = 0; i < views.size(); ++i) {
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t j = 0; j < views.size(); ++j)
      if (j != i) best = std::min(best, (views[i].render.centre - views[j].render.centre).norm());
    if (std::isfinite(best)) nearest.push_back(best);
  }
  return Quantile(nearest, 0.5);
}

}  // namespace

std::string Validate(const PlaneOptions& options) {
  if (!(options.far_factor > 1)) return "far_factor must be above 1";
  if (!(options.margin >= 0)) return "margin must be >= 0";
  return {};
}

Mesh BuildPlaneProxy(const Scene& scene, const PlaneOptions& options, PlaneSummary* summary) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  const std::vector<ProxyView> views = MakeProxyViews(scene);

  Eigen::Vector3d forward = Eigen::Vector3d::Zero(), eye = Eigen::Vector3d::Zero();
  for (const ProxyView& v : views) {
    forward += v.forward;
    eye += v.render.centre / static_cast<double>(views.size());
  }
  // Views all around have no common direction; the first one's stands in.
  if (forward.norm() < 1e-3 * static_cast<double>(views.size())) forward = views.front().forward;
  forward.normalize();

  // Depths from the mean eye along the common direction, as the views saw them: the median of inverse depth.
  std::vector<double> inverse_depths;
  std::vector<ProxyPoint> points = SelectPoints(scene, views, options.points).points;
  for (const ProxyPoint& p : points) {
    const double depth = (p.x_in_world - eye).dot(forward);
    for (std::size_t i = 0; i < p.views.size() && depth > 0; ++i) inverse_depths.push_back(1 / depth);
  }
  std::size_t used = points.size();
  if (inverse_depths.empty()) {  // too few for the tests of reliability: take what there is
    for (const Point& p : scene.points) {
      const double depth = p.x_in_world.allFinite() ? (p.x_in_world - eye).dot(forward) : -1;
      if (depth > 0) inverse_depths.push_back(1 / depth);
    }
    used = inverse_depths.size();
  }
  double depth = 0;
  if (!inverse_depths.empty()) {
    depth = 1 / Quantile(inverse_depths, 0.5);
  } else {
    depth = kDepthPerSpacing * MedianCameraSpacing(views);
    if (!(depth > 0)) {
      throw DataError(
          "no point lies before the cameras and no two cameras are apart: nothing says how far the scene is",
          "reconstruct from more photos, or import a mesh (lumi-proxy import)");
    }
  }

  // The axes lie along the mean image axes, so that the quad is as small as the photos allow.
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) right += view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitX();
  right -= right.dot(forward) * forward;
  if (right.norm() < 1e-6 * static_cast<double>(views.size())) right = forward.unitOrthogonal();
  right.normalize();
  const Eigen::Vector3d down = forward.cross(right);

  const double far = options.far_factor * depth;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  std::size_t clamped = 0;
  for (const ProxyView& v : views) {
    const Eigen::Vector3d from_eye = v.render.centre - eye;
    const double distance = depth - from_eye.dot(forward);
    const Eigen::Vector2d size = v.render.size_px.cast<double>();
    for (const Eigen::Vector2d& corner :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(size.x(), 0), Eigen::Vector2d(0, size.y()), size}) {
      const std::optional<Eigen::Vector3d> d = RayDirection(v.render.P, corner);
      if (!d) continue;
      const Eigen::Vector3d ray = d->normalized();
      const double approach = ray.dot(forward);
      double t = approach > 0 && distance > 0 ? distance / approach : far;
      if (t >= far) {
        t = far;
        ++clamped;
      }
      const Eigen::Vector3d hit = from_eye + t * ray;
      const Eigen::Vector2d xy(hit.dot(right), hit.dot(down));
      low = low.cwiseMin(xy);
      high = high.cwiseMax(xy);
    }
  }
  const Eigen::Vector2d margin = options.margin * (high - low);
  low -= margin;
  high += margin;

  Mesh mesh;
  const Eigen::Vector3d origin = eye + depth * forward;
  for (const Eigen::Vector2d& xy : {low, Eigen::Vector2d(high.x(), low.y()), high, Eigen::Vector2d(low.x(), high.y())})
    mesh.vertices.push_back(origin + xy.x() * right + xy.y() * down);
  // right x down = forward: this order is counter-clockwise for who looks along -forward; reversed, for the views.
  mesh.faces = {{0, 2, 1}, {0, 3, 2}};
  if (summary) *summary = {depth, -forward, used, clamped};
  return mesh;
}

}  // namespace lumi
