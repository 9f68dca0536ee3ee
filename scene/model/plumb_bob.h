// A camera as a calibration knows it: the thesis's five intrinsics (Sec. 2.2.2) and OpenCV's distortion (undistorted to distorted, the inverse
// of the direction that the thesis writes in Sec. 2.2.3). Skew and k3 are beyond the models of COLMAP that scenes are kept in (camera.h).
//
//   const Eigen::Vector2d x_px = Project(camera, {X / Z, Y / Z});
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

namespace lumi {

// Pixels: centre of the first one at (0.5, 0.5).
struct PlumbBobCamera {
  int width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0, skew = 0;  // in pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  // For photos of another size; each axis has its own factor.
  PlumbBobCamera Scaled(int new_width_px, int new_height_px) const;
};

// What the lens does to a point (x, y) on the plane z = 1. T: double or ceres::Jet.
template <typename T>
void Distort(const T& k1, const T& k2, const T& p1, const T& p2, const T& k3, const T& x, const T& y, T* distorted_x, T* distorted_y) {
  const T r2 = x * x + y * y;
  const T radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  *distorted_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  *distorted_y = y * radial + 2.0 * p2 * x * y + p1 * (r2 + 2.0 * y * y);
}

// Of a point on the plane z = 1: its pixel.
Eigen::Vector2d Project(const PlumbBobCamera& camera, const Eigen::Vector2d& x);
// The point on z = 1 that is seen at a pixel; nullopt beyond the fold of the polynomial.
std::optional<Eigen::Vector2d> Unproject(const PlumbBobCamera& camera, const Eigen::Vector2d& pixel);

// Whether the radial part grows all the way from the centre to the radius whose square is s_end. Beyond its fold a polynomial may grow again,
// mirrored, and a pixel would be seen a second time.
bool IsInsideFold(double k1, double k2, double k3, double s_end);

// What is wrong with it (sizes, NaN, focal lengths <= 0), or nullopt.
std::optional<std::string> Validate(const PlumbBobCamera& camera);

}  // namespace lumi
