// Photos as a pinhole camera without skew would have taken them: all that a calibration knows of the lens is resampled
// away. What scenes need of COLMAP's models is in files/undistort.cc.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "scene/model/camera.h"
#include "scene/model/image.h"

namespace lumi {

// Of the photo's size, with the largest field of view that lies wholly inside the photo: one factor on both focal
// lengths, the principal point moved only as far as that needs. Throws DataError where the distortion leaves none.
Camera PinholeInside(const Camera& camera);

// A pixel's ray as its point on z = 1, where it has one.
using RayOfPixel = std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector2d& x_px)>;
// The same of any lens. Where the photo's border has no ray, the outermost pixel towards the principal point that has
// one stands for it.
Camera PinholeInside(const Eigen::Vector2i& size_px, const Eigen::Vector2d& focal_px,
                     const Eigen::Vector2d& principal_point_px, const RayOfPixel& ray);

// For as many photos as wanted; any thread may use one.
class Undistorter {
 public:
  Undistorter(const Camera& camera, const Camera& pinhole);  // camera: of any lens
  Image8 operator()(const Image8& photo) const;              // of the camera's size; bicubic
  Image8 Mask(const Image8& mask) const;                     // of any size, one channel; the nearest pixel, 0 outside

 private:
  int width_ = 0, height_ = 0;  // of the result
  int source_width_ = 0, source_height_ = 0;
  std::vector<float> x_, y_;  // the photo's pixel (OpenCV's convention) for each pixel of the result
};

}  // namespace lumi
