// Photos' homographies over planes of the proxy, as linear functions of the view's pixels.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "render/cpu/layers.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/measures/prefilter.h"

namespace lumi {

// A linear function of the view's pixels, in double until it is moved to a reference pixel.
using LinearD = Eigen::RowVector3d;  // times (x_px, y_px, 1)

// f about the centre of pixel (x, y).
inline Linear About(const LinearD& f, int x, int y) {
  return {static_cast<float>(f[0] * (x + 0.5) + f[1] * (y + 0.5) + f[2]), static_cast<float>(f[0]),
          static_cast<float>(f[1])};
}

// (u w, v w, w) / depth = A (x, y, 1) - e / depth, where 1 / depth is linear on a plane.
class PhotoMaps {
 public:
  explicit PhotoMaps(const ViewSetup& setup) {
    const RelativeSources& r = setup.sources;
    maps_.resize(static_cast<std::size_t>(r.count));
    for (std::size_t j = 0; j < maps_.size(); ++j) {
      Eigen::Matrix3d M;
      for (int i = 0; i < 9; ++i) M(i / 3, i % 3) = r.m[i][j];
      maps_[j].A = M * setup.ray_from_pixel;
      const Eigen::Vector3d D(r.dx[j], r.dy[j], r.dz[j]);
      maps_[j].e = M * D;
      maps_[j].centre = setup.desired.P.leftCols<3>() * D;
    }
  }
  // In the photo's own pixels, about pixel (x, y).
  PhotoMap On(std::size_t photo, const LinearD& inverse_depth, int x, int y) const {
    const Map& m = maps_[photo];
    return {About(m.A.row(0) - m.e[0] * inverse_depth, x, y), About(m.A.row(1) - m.e[1] * inverse_depth, x, y),
            About(m.A.row(2) - m.e[2] * inverse_depth, x, y)};
  }
  // The same for pixels with depths of their own.
  PhotoMap AtDepths(std::size_t photo, int x, int y) const {
    const Map& m = maps_[photo];
    PhotoMap map{About(m.A.row(0), x, y), About(m.A.row(1), x, y), About(m.A.row(2), x, y)};
    map.u.d = static_cast<float>(-m.e[0]);
    map.v.d = static_cast<float>(-m.e[1]);
    map.w.d = static_cast<float>(-m.e[2]);
    return map;
  }
  // How much nearer a plane is to the photo's centre than to the view's (FacingRatio).
  double Facing(std::size_t photo, const LinearD& inverse_depth) const {
    return FacingRatio(1 - inverse_depth.dot(maps_[photo].centre), 1.0);
  }
  // Depth in the photo over depth in the view.
  double DepthRatio(std::size_t photo, const LinearD& inverse_depth, const Eigen::Vector2d& x_px) const {
    const Map& m = maps_[photo];
    return (m.A.row(2) - m.e[2] * inverse_depth).dot(x_px.homogeneous());
  }

 private:
  struct Map {
    Eigen::Matrix3d A;
    Eigen::Vector3d e;
    Eigen::Vector3d
        centre;  // the photo's, in the view's pixels, homogeneous: n.D / n.p is the plane's inverse depth there
  };
  std::vector<Map> maps_;
};

// The same map in pixels of a level.
inline PhotoMap Scaled(const PhotoMap& map, float su, float sv) {
  return {{map.u.c * su, map.u.x * su, map.u.y * su, map.u.d * su},
          {map.v.c * sv, map.v.x * sv, map.v.y * sv, map.v.d * sv},
          map.w};
}

}  // namespace lumi
