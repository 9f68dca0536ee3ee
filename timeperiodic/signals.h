// What varies in the frames of a video, as a few signals over time: the strongest principal components of the pixels
// that move. Exposure (a gain a frame, from the pixels that stand still) is taken out, and what the camera's place
// explains.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "timeperiodic/frame_stack.h"

namespace lumi {

struct Signals {
  Eigen::MatrixXd
      values;  // a row a frame, a column a component, strongest first; means 0, what `nuisance` explains taken out
  Eigen::VectorXd time;    // of each row, in frames
  std::vector<int> frame;  // of each row, in the video
  // Orthonormal columns: 1, and of a moving video what tells the camera's place. Periods are fitted beside them.
  Eigen::MatrixXd nuisance;
  // A column each of what changes the look of what moves: the camera's place, unit variance. Harmonics are fitted with
  // and without being multiplied by them. No columns for a fixed video.
  Eigen::MatrixXd modulation;
  int video_frames = 0;         // of the whole video
  double moving_share = 0;      // of the picture
  double moving_deviation = 0;  // median over the moving pixels, code values
  double gain_spread = 0;       // standard deviation of the frames' exposure, share; 0 where it does not drift
};

struct SignalsOptions {
  int components = 24;         // signals, >= 1
  int pixels = 1200;           // pixels and channels that they come from, strongest variation first, >= 8
  double min_deviation = 2.0;  // of a moving pixel over time, code values
  double noise_factor = 4;     // its variance over that of pixels that stand still
};

// Pixel p (y width + x) of frame i, RGB: three values; a value below 0: not seen there.
using PixelAt = std::function<void(int frame, int pixel, float* rgb)>;

// camera: a row a frame of what tells its place, without columns for a fixed video; frames: the rows that are used.
// Throws DataError where nothing moves.
Signals SignalsOf(const FrameStack& stack, const std::vector<int>& frames, const Eigen::MatrixXd& camera,
                  const PixelAt& pixel, const SignalsOptions& options);
// Of a video from a tripod.
Signals FixedSignals(const FrameStack& stack, const SignalsOptions& options);

}  // namespace lumi
