// Overlapping sub-sequences (thesis sec. 6.4.1): factorisation wants most tracks seen in most frames, which holds over
// a part of a video only. Neighbouring windows share frames and tracks, by which they are merged again.
#pragma once

#include <string>
#include <vector>

#include "reconstruct/factorization/projective_model.h"

namespace lumi {

struct WindowOptions {
  int length = 20;      // frames in a window, >= 2
  int overlap = 10;     // frames shared by neighbours, 1 ... length - 1
  int min_shared = 50;  // a window is shortened, to half its length at most, while fewer tracks last from its
                        // first to its last frame; the overlap is then half of it at most
  int stride = 1;       // of a video only every stride-th frame, and the last one, are in windows; >= 1
  bool ordered = true;  // frames are a video's; false: groups of photos that share tracks
};
// What is wrong with the options, or empty.
std::string Validate(const WindowOptions& options);

struct FrameWindow {
  std::vector<int> frames;  // ascending
  std::vector<int> tracks;  // those with at least two sights in `frames`, ascending
};

// Every frame that has tracks (see stride) is in a window; the last ones may be longer than they need to be.
std::vector<FrameWindow> SplitIntoWindows(const ImagePoints& points, const WindowOptions& options);

// The tracks with at least two sights in `frames` (ascending).
FrameWindow MakeWindow(const ImagePoints& points, std::vector<int> frames);

// The window alone: frame and track numbers are positions in FrameWindow::frames and FrameWindow::tracks.
ImagePoints Extract(const ImagePoints& points, const FrameWindow& window);

}  // namespace lumi
