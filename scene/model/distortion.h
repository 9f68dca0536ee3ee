// What a lens does to a point on the plane z = 1: OpenCV's polynomial (undistorted to distorted, the inverse of the
// direction that the thesis writes in Sec. 2.2.3), which every camera model but the fisheye has, or the first terms of
// it.
#pragma once

#include <Eigen/Core>
#include <optional>

namespace lumi {

// T: double or ceres::Jet.
template <typename T>
struct DistortionTerms {
  T k1{}, k2{}, p1{}, p2{}, k3{};
};
using Distortion = DistortionTerms<double>;

template <typename T>
Eigen::Matrix<T, 2, 1> Distort(const DistortionTerms<T>& c, const Eigen::Matrix<T, 2, 1>& u) {
  const T &x = u[0], &y = u[1], r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  return {x * radial + 2.0 * c.p1 * x * y + c.p2 * (r2 + 2.0 * x * x),
          y * radial + 2.0 * c.p2 * x * y + c.p1 * (r2 + 2.0 * y * y)};
}

// nullopt beyond the fold of the polynomial, where it grows again, mirrored, and a pixel would be seen a second time.
std::optional<Eigen::Vector2d> Undistort(const Distortion& lens, const Eigen::Vector2d& distorted);

}  // namespace lumi
