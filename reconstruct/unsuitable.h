// Photos whose lens no camera model here holds: 360-degree ones and stitched panoramas, circular fisheyes. Told by what
// their files say, or by their pixels where these leave no doubt.
#pragma once

#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "scene/model/image.h"
#include "scene/program/progress.h"

namespace lumi {

// Moves them to capture.unreadable, each with its reason and what to do. A fisheye is kept where the user gives its
// camera (--camera, --poses).
void LeaveOutUnsuitable(Capture& capture, const ReconstructOptions& options, ProgressSink& sink);

// A panorama of all directions: twice as wide as high, its left edge goes on at its right one in detail (neither in its
// middle), and each of the outermost rows, a single direction, has one colour.
bool LooksEquirectangular(const Image8& photo);

// The picture of a circular fisheye: a bright disc in the middle, its rim all around sharply against black.
struct ImageCircle {
  double x = 0, y = 0, radius = 0;  // of the photo's shorter side, from its upper left corner
};
std::optional<ImageCircle> FindImageCircle(const Image8& photo);

}  // namespace lumi
