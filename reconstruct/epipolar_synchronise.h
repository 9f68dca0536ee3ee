// Several videos of one scene brought together exactly, once their cameras are known. How much motion a camera sees
// depends on where it stands (what turns shows its sides to one after the other), so lags found from the amount alone
// are off by a few frames. But a moving point moves in one plane through both cameras' centres, and for both cameras in
// the same moment. Motion is therefore compared plane by plane (motion along epipolar lines over time; Ben-Artzi et
// al., "Camera calibration from dynamic silhouettes using motion barcodes", CVPR 2016, compare whether there is any;
// with so many planes, how much there is says more).
#pragma once

#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "scene/files/video_clock.h"
#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"
#include "scene/program/progress.h"

namespace lumi {

// One video: what moves in its frames, in small pictures, and the camera that took them.
struct WatchedMotion {
  using Pixels = std::vector<std::pair<std::int32_t, float>>;  // row by row, and by how many grey values more than
                                                               // coding may change it
  Camera camera;                                               // of the small pictures
  Rigid3 cam_from_world;
  std::vector<Pixels> change;      // a frame against the one before; the first frame's is empty
  std::vector<Pixels> foreground;  // a frame against the median of all
};

// At most so many frames from `first` on: as many as synchronising needs.
constexpr int kWatchedFrames = 600;
// Frames are those nearest to whole frames of the common clock, of `fps` and counted from the video's first. `camera`:
// the video's own, at any size. Throws InputError where no frame can be read.
WatchedMotion WatchMotion(const std::filesystem::path& video, const VideoClock& clock, double fps, int first,
                          const Camera& camera, const Rigid3& cam_from_world, ProgressSink& sink);

struct OffsetCorrections {
  std::vector<int> frames;  // to be added to the offsets
  double correlation = 0;   // mean over the pairs of cameras, -1 .. 1; 0: nothing to compare, and nothing is corrected
};
// `offsets`: frame i of a video is the common clock's frame i + offset. The corrections, of 6 frames at most, under
// which the motions that all pairs of cameras see in their common planes correlate best: the largest sum of -log(1 -
// correlation^2), which is the log-likelihood up to a factor.
OffsetCorrections CorrectOffsets(const std::vector<WatchedMotion>& videos, const std::vector<int>& offsets);

}  // namespace lumi
