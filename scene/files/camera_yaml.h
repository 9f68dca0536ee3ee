// OpenCV/ROS camera.yaml: image_width, image_height, camera_matrix, distortion_model (plumb_bob, fisheye),
// distortion_coefficients. OpenCV puts the first pixel's centre at (0, 0); converted here, at its door.
#pragma once

#include <filesystem>

#include "scene/model/camera.h"

namespace lumi {

// plumb_bob with k3 = 0 -> OPENCV, fisheye -> OPENCV_FISHEYE. Skew or k3 beyond 0 cannot be held by COLMAP's models:
// InputError says so (undistort the photos first). ROS's own layout and cv::FileStorage's are both read.
Camera ReadCameraYaml(const std::filesystem::path& path);
void WriteCameraYaml(const Camera& camera, const std::filesystem::path& path);

// What a calibration can know beyond COLMAP's models. Pixels as everywhere here (first centre at (0.5, 0.5)).
struct PlumbBobCamera {
  int width_px = 0, height_px = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0, skew = 0;  // in pixels
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
};
// OpenCV's own functions do not read the skew from camera_matrix, ROS's do.
void WriteCameraYaml(const PlumbBobCamera& camera, const std::filesystem::path& path);

}  // namespace lumi
