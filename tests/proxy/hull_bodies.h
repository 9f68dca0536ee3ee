// Bodies whose silhouettes and volumes are known: each pixel's ray is asked whether it meets the body.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "proxy/hull/silhouette_cone.h"

namespace lumi::test {

// Does the ray from `eye` along `direction` meet it?
using Body = std::function<bool(const Eigen::Vector3d& eye, const Eigen::Vector3d& direction)>;

inline Body Ellipsoid(const Eigen::Vector3d& radii, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  return [=](const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) {
    const Eigen::Vector3d o = (eye - centre).cwiseQuotient(radii), d = direction.cwiseQuotient(radii);
    const double b = o.dot(d);
    return b < 0 && b * b >= d.squaredNorm() * (o.squaredNorm() - 1);
  };
}

inline Body Block(const Eigen::Vector3d& half, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  return [=](const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) {
    double from = 0, to = 1e300;
    for (int a = 0; a < 3; ++a) {
      double near = (centre[a] - half[a] - eye[a]) / direction[a], far = (centre[a] + half[a] - eye[a]) / direction[a];
      if (near > far) std::swap(near, far);
      from = std::max(from, near);
      to = std::min(to, far);
    }
    return from <= to;
  };
}

inline Body Union(Body a, Body b) {
  return [a = std::move(a), b = std::move(b)](const Eigen::Vector3d& eye, const Eigen::Vector3d& d) {
    return a(eye, d) || b(eye, d);
  };
}

// A ring around the z axis, walked along the ray.
inline Body Torus(double ring, double tube) {
  return [=](const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) {
    const Eigen::Vector3d d = direction.normalized();
    const double middle = -eye.dot(d), reach = ring + tube;
    double t = middle - 1.2 * reach;
    while (t < middle + 1.2 * reach) {
      const Eigen::Vector3d x = eye + t * d;
      const double away = std::hypot(std::hypot(x.x(), x.y()) - ring, x.z()) - tube;
      if (away < 1e-4) return true;
      t += away;
    }
    return false;
  };
}

struct Shot {
  int width = 320, height = 320;
  double focal_px = 490;
  Eigen::Vector2d principal_px = {160, 160};
};

inline Matrix34d LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Shot& shot = {}) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x =
      (std::abs(z.z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY()).cross(z).normalized();
  Eigen::Matrix3d K = Eigen::Matrix3d::Identity(), R;
  K.diagonal() << shot.focal_px, shot.focal_px, 1;
  K.col(2).head<2>() = shot.principal_px;
  R << x.transpose(), z.cross(x).transpose(), z.transpose();
  Matrix34d P;
  P.leftCols<3>() = K * R;
  P.col(3) = -P.leftCols<3>() * eye;
  return P;
}

inline SilhouetteView Photograph(const Body& body, const Eigen::Vector3d& eye,
                                 const Eigen::Vector3d& target = Eigen::Vector3d::Zero(), const Shot& shot = {}) {
  SilhouetteView view;
  view.P = LookAt(eye, target, shot);
  view.mask = Image8(shot.width, shot.height, 1);
  const Eigen::Matrix3d rays = view.P.leftCols<3>().inverse();
  for (int y = 0; y < shot.height; ++y) {
    for (int x = 0; x < shot.width; ++x) {
      if (body(eye, rays * Eigen::Vector3d(x + 0.5, y + 0.5, 1))) view.mask.At(x, y, 0) = 255;
    }
  }
  return view;
}

// Evenly around (a Fibonacci lattice), looking at the origin.
inline std::vector<SilhouetteView> Around(const Body& body, int count, double distance = 5, const Shot& shot = {}) {
  std::vector<SilhouetteView> views;
  for (int n = 0; n < count; ++n) {
    const double z = 1 - (2 * n + 1.0) / count, r = std::sqrt(1 - z * z),
                 turn = n * std::numbers::pi * (3 - std::sqrt(5.0));
    views.push_back(Photograph(body, distance * Eigen::Vector3d(r * std::cos(turn), r * std::sin(turn), z),
                               Eigen::Vector3d::Zero(), shot));
    views.back().name = "view" + std::to_string(n);
  }
  return views;
}

// The same photos of a world of another unit and origin.
inline std::vector<SilhouetteView> Moved(std::vector<SilhouetteView> views, double scale,
                                         const Eigen::Vector3d& translation) {
  for (SilhouetteView& v : views) {
    // x_old = (x_new - translation) / scale
    v.P.col(3) -= v.P.leftCols<3>() * translation / scale;
    v.P.leftCols<3>() /= scale;
  }
  return views;
}

}  // namespace lumi::test
