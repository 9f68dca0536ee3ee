// Power of the signals over frequency, and where the harmonics of a period carry much of it: the places to look closely.
#pragma once

#include <vector>

#include "timeperiodic/signals.h"

namespace lumi {

struct Spectrum {
  double step = 0;            // cycles a frame, from one value to the next; the first is at 0
  std::vector<double> power;  // share of the variance, up to half a cycle a frame

  // At any frequency, folded back to where frames show it.
  double At(double cycles_per_frame) const;
  // Sum over harmonics 1 ... count of a fundamental.
  double HarmonicSum(double cycles_per_frame, int count) const;
};

Spectrum SpectrumOf(const Signals& signals);

// Fundamentals (cycles a frame) whose harmonics carry most, strongest first, for one and for several harmonics.
std::vector<double> LikelyFundamentals(const Spectrum& spectrum, double span_frames, double min_period, double max_period);

}  // namespace lumi
