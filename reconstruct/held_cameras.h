// Points from COLMAP's matches with all cameras held: matches that agree with the known epipolar geometry are joined to
// tracks, and each track is triangulated without its outliers. (With the cameras known, the raw matches can be judged
// one by one; COLMAP's own verification, which estimates each pair's geometry, needs more of them than hard photos
// give.)
#pragma once

#include <filesystem>
#include <vector>

#include "reconstruct/known_cameras.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct HeldTriangulationOptions {
  double max_error_px = 4;     // epipolar distance of a match, reprojection error of an observation
  double min_angle_deg = 1.5;  // between the widest two rays of a point
};

// Views without points stay in the scene: their cameras were given. image_folder is left empty.
Scene TriangulateHeld(const std::vector<HeldView>& views, const std::filesystem::path& database,
                      const HeldTriangulationOptions& options, ProgressSink& sink);

}  // namespace lumi
