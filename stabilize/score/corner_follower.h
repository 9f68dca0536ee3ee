// Corners followed through a video frame by frame, nothing kept of it but the last frame. Without the patches of
// scene/tracks, which hold a track to its place over seconds: here steps and what is faster than a second count.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "scene/model/image.h"
#include "stabilize/score/homography.h"

namespace lumi::score {

struct FollowedCorner {
  long track = 0;  // ascending in a frame; never used again
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();
};

struct FollowedFrame {
  std::vector<FollowedCorner> corners;  // seen in this frame, those that begin here too
  std::vector<PointPair> steps;         // from the frame before to this one
  bool cut = false;                     // nearly all corners were lost at once: a new shot begins here
};

class CornerFollower {
 public:
  CornerFollower();
  ~CornerFollower();
  // grey: one channel, of one size throughout.
  FollowedFrame Add(const Image8& grey);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lumi::score
