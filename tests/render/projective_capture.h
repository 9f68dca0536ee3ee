// A capture's scene as matrices and points in a world that only a projective transformation relates to its own.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "scene/geometry/dense_solvers.h"
#include "tests/render/capture.h"

namespace lumi::test {

// Points where rays of the photos meet the true surface, each with the photos that see it. Off the pixels' centres, so
// that nothing is symmetric.
inline std::vector<Point> SeenPoints(const Capture& capture) {
  std::vector<Point> points;
  for (std::size_t from = 0; from < capture.scene.views.size(); from += 3) {
    const RenderView view = MakeRenderView(capture.scene, capture.scene.views[from]);
    for (int y = 1; y < view.size_px.y(); y += 3)
      for (int x = 1; x < view.size_px.x(); x += 3) {
        const Eigen::Vector2d off(std::sin(12.9 * x + 78.2 * y), std::sin(39.3 * x + 11.1 * y));
        const Eigen::Vector3d d = RayDirection(view.P, Eigen::Vector2d(x + 0.5, y + 0.5) + 0.4 * off)->normalized();
        const double t = HitDistance(capture.proxy, view.centre, d);
        if (!std::isfinite(t)) continue;
        Point p;
        p.x_in_world = view.centre + t * d;
        p.error_px = 0.1;
        for (std::size_t v = 0; v < capture.scene.views.size(); ++v) {
          const RenderView other = MakeRenderView(capture.scene, capture.scene.views[v]);
          const Eigen::Vector3d to = p.x_in_world - other.centre;
          const auto x_px = Project(other.P, p.x_in_world);
          if (x_px && HitDistance(capture.proxy, other.centre, to.normalized()) > to.norm() - 1e-6)
            p.track.push_back({ViewId{static_cast<std::int32_t>(v)}, *x_px});
        }
        points.push_back(p);
      }
  }
  return points;
}

// Singular values spread evenly, in their logarithms, from 1 to `condition`.
inline Eigen::Matrix4d RandomTransformation(unsigned seed, double condition) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  const auto rotation = [&] {
    Eigen::MatrixXd A(4, 4);
    for (int i = 0; i < 16; ++i) A(i / 4, i % 4) = normal(engine);
    return Eigen::Matrix4d(DecomposeSingular(A).U);
  };
  Eigen::Vector4d values;
  for (int i = 0; i < 4; ++i) values[i] = std::pow(condition, i / 3.0);
  const Eigen::Matrix4d left = rotation(), right = rotation();
  return left * values.asDiagonal() * right;
}

// P T^-1, rounded once: what a camera that is known to double precision is in the world X' = T X. An inverse in double
// would add its own error, which the condition of T makes as large as what is to be seen.
inline Matrix34d InWorldOf(const Matrix34d& P, const Eigen::Matrix4d& T) {
  using Long = Eigen::Matrix<long double, 4, 4>;
  const Long inverse = T.cast<long double>().inverse();
  return (P.cast<long double>() * inverse).cast<double>();
}
inline Plane InWorldOf(const Plane& plane, const Eigen::Matrix4d& T) {
  Matrix34d rows = Matrix34d::Zero();
  rows.row(0) = plane.transpose();
  return InWorldOf(rows, T).row(0).transpose();
}

// A metric scene in the world X' = T X, its plane at infinity carried along.
inline Scene Projective(const Scene& metric, const Eigen::Matrix4d& T) {
  Scene s = metric;
  s.frame = Frame::kProjective;
  for (std::size_t i = 0; i < s.views.size(); ++i) {
    s.views[i].P = InWorldOf(MakeRenderView(metric, metric.views[i]).P, T);
    s.views[i].size_px = SizePx(metric, metric.views[i]);
  }
  for (Point& p : s.points)
    p.X_in_world = (T.cast<long double>() * p.x_in_world.homogeneous().cast<long double>()).cast<double>();
  s.plane_at_infinity = InWorldOf(Plane(0, 0, 0, 1), T);
  s.active_proxy.clear();
  return s;
}

}  // namespace lumi::test
