// How many frames one video started after another, from what moves in both: fixed cameras that look at one scene see
// its motion rise and fall at the same moments, whatever each sees of it.
#pragma once

#include <filesystem>
#include <vector>

#include "scene/program/progress.h"

namespace lumi {

// A value a frame: the logarithm of how much of the picture changed since the frame before, beyond what coding changes
// (grey, 160 px wide), 0 for the first.
struct MotionSignal {
  std::vector<double> change;
  double fps = 0;
};
// Throws InputError where no frame can be read.
MotionSignal MeasureMotion(const std::filesystem::path& video, ProgressSink& sink);

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
