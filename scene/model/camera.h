// Intrinsics in COLMAP's models. Camera frame: x right, y down, z forward. Pixels: centre of the upper-left pixel at
// (0.5, 0.5), as COLMAP and OpenGL have it (OpenCV's integers are converted at its door, see files/opencv_pixels.h).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lumi {

// Values are COLMAP's model ids.
enum class CameraModel : int {
  kSimplePinhole = 0,  // f, cx, cy
  kPinhole = 1,        // fx, fy, cx, cy
  kSimpleRadial = 2,   // f, cx, cy, k
  kRadial = 3,         // f, cx, cy, k1, k2
  kOpenCV = 4,         // fx, fy, cx, cy, k1, k2, p1, p2
  kOpenCVFisheye = 5,  // fx, fy, cx, cy, k1, k2, k3, k4
};

std::string_view Name(CameraModel model);                             // "PINHOLE", ...
std::optional<CameraModel> CameraModelFromName(std::string_view name);
std::optional<CameraModel> CameraModelFromId(int id);
int ParameterCount(CameraModel model);

struct Camera {
  CameraModel model = CameraModel::kPinhole;
  int width_px = 0;
  int height_px = 0;
  std::vector<double> params;  // COLMAP's order, see CameraModel

  static Camera Pinhole(int width_px, int height_px, double fx_px, double fy_px, double cx_px, double cy_px);

  Eigen::Vector2d FocalPx() const;
  Eigen::Vector2d PrincipalPointPx() const;
  Eigen::Matrix3d K() const;          // without distortion
  bool IsPinhole() const;             // no distortion term, or all of them zero

  // Pixel of a point in the camera frame; nullopt at or behind the camera (fisheye: nullopt only at the centre).
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& x_in_cam) const;
  // Point on the plane z = 1 (fisheye beyond 90 degrees: nullopt) seen at a pixel; nullopt where the distortion has no
  // inverse there (the pixel lies beyond the fold of the polynomial).
  std::optional<Eigen::Vector2d> Normalized(const Eigen::Vector2d& x_px) const;

  // The same camera for photos scaled to another size; the aspect may change by rounding only (else the focal lengths
  // and principal point are scaled per axis, and a single-focal model becomes its two-focal equivalent where needed).
  Camera Scaled(int new_width_px, int new_height_px) const;
  // The same lens with another focal length (of a model with one, its x counts) and principal point.
  Camera WithPinhole(const Eigen::Vector2d& focal_px, const Eigen::Vector2d& principal_point_px) const;
};

// What is wrong with a camera (counts, sizes, NaN, focal lengths <= 0), or nullopt.
std::optional<std::string> Validate(const Camera& camera);

}  // namespace lumi
