// Several videos of one scene brought together exactly, once their cameras are known. How much a camera sees something move depends on where it
// stands (what turns shows its sides to one after the other), so lags found from that alone are off by a few frames. What does not depend on it:
// a point that moves does so in one plane through both cameras' centres, and for both in the same moment. Motion is therefore compared plane by
// plane (motion along epipolar lines over time; Ben-Artzi et al., "Camera calibration from dynamic silhouettes using motion barcodes", CVPR 2016,
// compare whether there is any; with so many planes, how much there is says more).
#pragma once

#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"
#include "scene/program/progress.h"

namespace lumi {

// One video: what changes from frame to frame, in small pictures, and the camera that took them.
struct WatchedMotion {
  Camera camera;                                                        // of the small pictures
  Rigid3 cam_from_world;
  std::vector<std::vector<std::pair<std::int32_t, float>>> frames;      // pixel (row by row) and change, grey values beyond what coding changes; the first frame's is empty
};

// `camera`: the video's own, at any size. Throws InputError where no frame can be read.
WatchedMotion WatchMotion(const std::filesystem::path& video, const Camera& camera, const Rigid3& cam_from_world, ProgressSink& sink);

struct RefinedOffsets {
  std::vector<int> offsets;   // as Synchronisation's; the least is 0
  double correlation = 0;     // mean over the pairs of cameras, -1 .. 1; 0: nothing to compare, and the offsets are those given
};
// The offsets near those given (6 frames and less from them) at which the motion in the planes of all pairs of cameras correlates best.
RefinedOffsets RefineOffsets(const std::vector<WatchedMotion>& videos, const std::vector<int>& offsets);

}  // namespace lumi
