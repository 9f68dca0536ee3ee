// How many frames one video started after another, from what moves in both: fixed cameras that look at one scene see
// its motion rise and fall at the same moments, whatever each sees of it.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/files/video_clock.h"
#include "scene/program/progress.h"

namespace lumi {

// A value a frame of the common clock: the logarithm of how much of the picture changes in a frame's time, beyond what
// coding changes (grey, 160 px wide), 0 for the first.
struct MotionSignal {
  std::vector<double> change;
  double fps = 0;  // of the common clock
};
// Frames that do not come at the common clock's steps are put on it (OnCommonClock). Throws InputError where no frame
// can be read.
MotionSignal MeasureMotion(const std::filesystem::path& video, const VideoClock& clock, double fps, ProgressSink& sink);

// When a frame is shown, in frames of the common clock after the video's first: whole where only the seconds' rounding
// is in between.
double CommonFrame(const VideoClock& clock, double time_s, double fps);

// Values at frames 0, 1, 2 ... of the common clock, by straight lines between those at `frames` (ascending from 0); the
// first frame, which has no frame before it, says nothing.
std::vector<double> OnCommonClock(const std::vector<double>& frames, const std::vector<double>& values);

struct Lag {
  int frames = 0;          // b's frame i shows the moment of a's frame i + frames
  double correlation = 0;  // -1 .. 1 over the overlap; 0 where there is nothing to compare
  int rival = 0;           // another lag that is nearly as likely (a repeating scene); the same where there is none
};
// The lag at which the two agree best, over overlaps of half the shorter one; of lags that agree as well as the best
// but for a twentieth, the one nearest 0.
Lag FindLag(const MotionSignal& a, const MotionSignal& b);

struct Synchronisation {
  std::vector<int> offsets;      // of each video: its frame i is frame i + offset of the common clock; the least is 0
  double least_correlation = 1;  // of the pairs that were used
  bool repeats = false;          // another offset would do nearly as well
};
// Each video tied to the others by the pairs that agree best (a maximum spanning tree). Throws DataError, naming the
// video, where nothing agrees with it.
Synchronisation Synchronise(const std::vector<MotionSignal>& signals, const std::vector<std::filesystem::path>& videos);

}  // namespace lumi
