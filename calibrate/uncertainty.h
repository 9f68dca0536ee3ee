// How far a calibration may be off, as pixels in the picture: the projection of a fixed direction, moved by the
// covariance of the intrinsics, less what a turn of the camera would undo (after mrcal's projection uncertainty: a
// principal point that shifts with the poses is no error).
#pragma once

#include <vector>

#include "calibrate/refine.h"

namespace lumi {

struct UncertaintyMap {
  int columns = 0, rows = 0;  // of the grid, from border to border of the photo
  std::vector<double>
      sigma_px;  // Shape (rows * columns): standard deviation of the position; NaN where the distortion has no inverse
  double median_px = 0, largest_px = 0;
};

UncertaintyMap ProjectionUncertainty(const Calibration& calibration, int width_px, int height_px, int columns = 25,
                                     int rows = 19);

}  // namespace lumi
