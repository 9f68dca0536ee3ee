// How much of a stabilised picture the frames around it see, and with it how far it has to be cropped.
#pragma once

#include <vector>

#include "stabilize/filmed_scene.h"

namespace lumi {

struct ViewAreaOptions {
  int half_window = 5;  // frames before and after that may fill a picture (thesis sec. 6.4.3: 11 together)
  double least = 0.2;   // scales below this are not told apart
};

// The largest centred part of each picture, as a share of its width, all of whose border some frame of the window sees:
// 1 where nothing is missing, options.least where not even that much is seen. P: the stabilised matrices, one a frame
// of `film`.
std::vector<double> ViewScales(const FilmedScene& film, const std::vector<Matrix34d>& P,
                               const ViewAreaOptions& options);

// P with the centred part of the picture, `scale` wide, made to fill it.
Matrix34d CroppedTo(const Matrix34d& P, double scale);
// The same for matrices in pixels.
Matrix34d CroppedInPixels(const Matrix34d& P_px, const Eigen::Vector2i& size_px, double scale);

}  // namespace lumi
