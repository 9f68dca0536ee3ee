// Photos as a pinhole camera without skew would have taken them: distortion and skew resampled away.
#pragma once

#include "calibrate/intrinsics.h"
#include "scene/model/camera.h"
#include "scene/model/image.h"

namespace lumi {

// Of the photo's size, with the largest field of view that lies wholly inside the photo. Throws DataError where the distortion leaves none.
Camera PinholeInside(const Intrinsics& intrinsics, int width_px, int height_px);

// Bicubic, for as many photos as wanted.
class Undistorter {
 public:
  Undistorter(const Intrinsics& intrinsics, const Camera& pinhole);
  Image8 operator()(const Image8& photo) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<float> x_, y_;  // the photo's pixel (OpenCV's convention) for each pixel of the result
};

}  // namespace lumi
