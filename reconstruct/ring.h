// Cameras that are assumed when nothing else is known: a turntable, that is cameras on a circle, looking at its centre,
// evenly spaced in the order of the photos' names.
#pragma once

#include <filesystem>
#include <vector>

#include "reconstruct/known_cameras.h"
#include "reconstruct/options.h"
#include "reconstruct/photos.h"

namespace lumi {

struct RingGeometry {
  double focal_px = 0;
  double elevation_rad = 0;  // of the cameras above the object, seen from the centre
  double step_rad = 0;       // from one photo to the next; negative: clockwise seen from above
  double pan_rad = 0;        // the optical axis passes this much to the right of the circle's axis
  double roll_rad = 0;       // the camera's turn about its optical axis, clockwise seen from behind it
};
// Pose of photo `index`: camera at distance 1 from the origin, world z upwards. (Where on its axis the circle's
// "centre" lies is free: it is where the optical axis comes nearest, so that no tilt is needed beside the elevation.)
Rigid3 RingPose(const RingGeometry& ring, int index);

// Throws DataError where the photos do not determine what is searched.
std::vector<HeldView> AssumeRing(const Capture& capture, const ReconstructOptions& options,
                                 const std::filesystem::path& database, ProgressSink& sink);

}  // namespace lumi
