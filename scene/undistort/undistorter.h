// Photos as a pinhole camera without skew would have taken them: all that a calibration knows of the lens is resampled away. What scenes need of
// COLMAP's models is in files/undistort.cc.
#pragma once

#include <vector>

#include "scene/model/camera.h"
#include "scene/model/image.h"
#include "scene/model/plumb_bob.h"

namespace lumi {

// Of the photo's size, with the largest field of view that lies wholly inside the photo. Throws DataError where the distortion leaves none.
Camera PinholeInside(const PlumbBobCamera& camera);

// For as many photos as wanted; any thread may use one.
class Undistorter {
 public:
  Undistorter(const PlumbBobCamera& camera, const Camera& pinhole);
  Image8 operator()(const Image8& photo) const;  // of the camera's size; bicubic
  Image8 Mask(const Image8& mask) const;         // of any size, one channel; the nearest pixel, 0 outside

 private:
  int width_ = 0, height_ = 0;      // of the result
  int source_width_ = 0, source_height_ = 0;
  std::vector<float> x_, y_;        // the photo's pixel (OpenCV's convention) for each pixel of the result
};

}  // namespace lumi
