// How much of a camera's path is slow: the stability score of Liu, Yuan, Tan, Sun (Bundled camera paths, SIGGRAPH 2013,
// section 5.1).
//
// A path of N frames has the frequencies 0, 1, ... N / 2 cycles a video. Energy of the 2nd to the 6th lowest (1 to 5
// cycles) over that of all but the lowest: 1 = only slow movement. Of a path of cosines a_k cos(2 pi k t / N) it is
// sum_1..5 a_k^2 / sum a_k^2. A constant speed is a saw tooth to it: 0.89 for a long video, not 1.
#pragma once

#include <optional>
#include <vector>

#include "stabilize/score/homography.h"

namespace lumi::score {

// Energies at 1 ... N / 2 cycles a video.
std::vector<double> PathEnergies(const std::vector<double>& path);

// None for fewer than 12 frames, where no frequency is above the 6th lowest. 1 for a path that stays within still_rms
// (root mean square about its mean): nothing moves that could be slow or fast.
std::optional<double> StabilityOf(const std::vector<double>& path, double still_rms);

// The path less the straight line that fits it best: nothing is left of a constant speed.
std::vector<double> WithoutLine(std::vector<double> path);

// The path of a camera as its picture's movement adds up: of its middle and its rotation. What cannot be measured takes
// the mean of the steps on either side, or its share of a movement across the gap; over a cut the path goes on from
// where it was.
class MeasuredPath {
 public:
  enum class Step { kMeasured, kFailed, kBridged, kCut };
  void Begin(double time_s);
  void Add(double time_s, Step step, const Movement& movement);
  // Of the last so many steps, which are kFailed until now, together.
  void Bridge(int steps, const Movement& movement);
  struct Path {
    std::vector<double> x_px, y_px, rotation_rad;  // a value a frame, the first is 0
    double interval_s = 0;  // between two of them: times that are not uniform are made so, by straight lines
    bool uneven = false;    // they were not
  };
  Path Result() const;
  int failed() const { return failed_; }  // the bridged ones too
  int open_gap() const;                   // kFailed steps at the end
  int frames() const { return static_cast<int>(times_s_.size()); }

 private:
  std::vector<double> times_s_;
  std::vector<Step> steps_;  // the first one is of the second frame
  std::vector<Movement> movements_;
  int failed_ = 0;
};

}  // namespace lumi::score
