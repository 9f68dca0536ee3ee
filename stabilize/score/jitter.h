// What trembles in a video: the movement of its features above 1 Hz, in pixels.
//
// A feature's place at frame c minus the parabola through its places within 0.7 s of c, fitted by least squares with
// weights 1 - (t / 0.73 s)^2 (at 30 frames a second), at c itself. Of a movement A cos(2 pi f t) that leaves A G(f),
// G(f) = 1 - sum_k w_k cos(2 pi f t_k): half of it at 1 Hz (0.46 at 30 frames a second, 0.44 at 60), all of it (0.94
// to 1.08) above 1.4 Hz, 0.05 at 0.5 Hz, 0.01 at 0.3 Hz, nothing of a constant speed or acceleration. Only features
// seen in all of the 1.4 s count, so that no track's end adds to it; a cut ends all tracks.
//
// A frame's jitter is the median over its features, so that less than half of them may be on things that move by
// themselves; the video's is the root mean square over frames.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <vector>

#include "stabilize/score/corner_follower.h"

namespace lumi::score {

struct JitterResult {
  std::optional<double>
      jitter_px;  // none: the video is shorter than 1.4 s, slower than 5 frames a second, or without features
  std::optional<double> all_px;     // root mean square over all features of all frames: what moves by itself, too
  std::optional<double> step_px;    // the same as jitter_px of its change from one frame to the next
  int frames = 0;                   // that count
  std::vector<double> of_frame_px;  // a value a frame, not-a-number where there is none
};

// The weights of the fit at the middle time: value = sum w_k x_k. Empty for fewer than 7 times.
std::vector<double> ParabolaWeights(const std::vector<double>& times_s, double middle_s, double interval_s);

class JitterMeter {
 public:
  explicit JitterMeter(double fps);
  // Times ascending; corners by ascending track.
  void Add(double time_s, const std::vector<FollowedCorner>& corners);
  JitterResult Result() const;

 private:
  struct Residual {
    long track;
    Eigen::Vector2d px;
  };
  void Measure(std::size_t centre);

  double interval_s_;
  struct Frame {
    double time_s;
    std::vector<FollowedCorner> corners;
  };
  std::deque<Frame> frames_;  // those that a window may still need
  std::size_t first_ = 0;     // index of frames_.front()
  std::size_t next_ = 0;      // the centre to be measured next
  double begin_s_ = 0;
  std::vector<double> of_frame_px_;
  std::vector<Residual> last_;
  double square_sum_ = 0, step_square_sum_ = 0, all_square_sum_ = 0;
  long all_count_ = 0;
  int measured_ = 0, steps_ = 0;
};

}  // namespace lumi::score
