// Where something moves, as masks: pixels of the aligned frames that change by more than the camera explains, and those
// that change with the scene's period.
#pragma once

#include <optional>

#include "timeperiodic/align.h"

namespace lumi {

struct MovingPartsOptions {
  double min_deviation = 4;   // code values, of what the camera does not explain
  double min_periodic = 1.5;  // code values, deviation of what repeats with the period
  double grow = 0.015;  // masks are grown by this share of the picture's width: shadows' edges, the field's errors
};

struct MovingParts {
  Image8 mask;       // of the reference, small pixels, one channel: 255 = moves
  double share = 0;  // of the picture
};

// period: frames; nullopt: what varies at all.
MovingParts FindMovingParts(const FrameStack& stack, const Alignment& alignment, std::optional<double> period,
                            const MovingPartsOptions& options);

// The same in a frame's own pixels, as COLMAP's masks are: one channel of the video's size, 0 = moves (ignore), 255 =
// stands still. A frame that could not be aligned takes the mask of the nearest one that could.
Image8 FrameMask(const FrameStack& stack, const Alignment& alignment, const MovingParts& parts, int frame);

}  // namespace lumi
