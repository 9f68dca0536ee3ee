// A moving video's frames brought to one of them, so that what stands still stands still: corners of the reference are
// found again in every frame, their displacements are the few modes that a moving camera gives them (parallax
// included), and between corners the modes are smooth. What moves by itself fits no mode and takes no part.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "scene/program/progress.h"
#include "timeperiodic/frame_stack.h"
#include "timeperiodic/signals.h"

namespace lumi {

struct AlignOptions {
  int corners = 300;         // sought in the reference
  int modes = 8;             // of displacement, at most
  double min_aligned = 0.6;  // share of the frames
  int min_corners = 20;      // that stand still
};

struct Alignment {
  int reference = 0;        // the frame that the others are brought to
  std::vector<int> frames;  // those that could be, ascending
  // A row for each of `frames`: how much of each mode, unit variance, largest mode first. Tells the camera's place.
  Eigen::MatrixXd camera;
  int corners = 0;            // that stand still
  double residual_px = 0;     // median of what the modes leave of a corner's displacement, small pixels
  double motion_px = 0;       // rms displacement of the still corners, small pixels
  int width = 0, height = 0;  // of the small frames
  // Displacement modes at every pixel of the reference: pixels x (1 + modes), first the mean.
  Eigen::MatrixXf mode_x, mode_y;

  // Where the middle of a reference's pixel lies in aligned frame number `row` (of `frames`), small pixels.
  Eigen::Vector2f InFrame(Eigen::Index row, int pixel) const;
  // The row of a frame, or -1.
  Eigen::Index RowOf(int frame) const;
};

// Throws DataError: too little that stands still, a camera that goes too far.
Alignment AlignFrames(const FrameStack& stack, const AlignOptions& options, ProgressSink& progress);

// Aligned frames as they would look from the reference's camera.
PixelAt AlignedPixels(const FrameStack& stack, const Alignment& alignment);

// Regressors for the part of the frames' change that comes from the camera's place: its modes, and for the strongest
// also their products.
Eigen::MatrixXd CameraCovariates(const Alignment& alignment);

Signals MovingSignals(const FrameStack& stack, const Alignment& alignment, const SignalsOptions& options);

}  // namespace lumi
