// A silhouette from a box around the object (Rother, Kolmogorov & Blake 2004, "GrabCut"; OpenCV's).
#pragma once

#include <Eigen/Core>

#include "scene/model/image.h"

namespace lumi {

// box_px: left, top, right, bottom, in pixels from the upper left corner; what lies outside is background. Throws
// DataError where the box, cut to the photo, leaves no background or no object to learn from.
Image8 SilhouetteFromBox(const Image8& photo, const Eigen::Vector4d& box_px, int iterations = 5);

}  // namespace lumi
