// OpenCV/ROS camera.yaml: image_width, image_height, camera_matrix, distortion_model (plumb_bob, fisheye),
// distortion_coefficients. OpenCV puts the first pixel's centre at (0, 0); reading and writing convert.
#pragma once

#include <filesystem>

#include "scene/model/camera.h"

namespace lumi {

// All that such a file can say.
struct CameraYaml {
  Camera camera;                // kPlumbBob or kOpenCVFisheye
  bool says_distortion = true;  // false: the file has no coefficients, they were taken as 0
};
// ROS's own layout and cv::FileStorage's are both read. Throws InputError.
CameraYaml ReadWholeCameraYaml(const std::filesystem::path& path);

// plumb_bob with k3 = 0 -> OPENCV (PINHOLE where all is 0), fisheye -> OPENCV_FISHEYE. Skew or k3 beyond 0 cannot be
// held by COLMAP's models: InputError says so (undistort the photos first).
Camera ReadCameraYaml(const std::filesystem::path& path);

// Of any model. OpenCV's own functions do not read the skew from camera_matrix, ROS's do.
void WriteCameraYaml(const Camera& camera, const std::filesystem::path& path);

}  // namespace lumi
