// When frames were taken, by how far they lead the fit of a period: frames that were dropped or doubled, and a period
// that drifts.
#pragma once

#include <vector>

#include "timeperiodic/period_search.h"

namespace lumi {

struct TimedPeriod {
  double period = 0, sigma = 0;  // frames
  int harmonics = 0;
  double explained = 0;
  std::vector<Slip> slips;  // by frame
  double drift_percent = 0, drift_sigma_percent = 0;
  bool drifts = false;
};

// `fit` is left at the times that were found.
TimedPeriod FitTime(HarmonicFit& fit, const Signals& signals, const Refined& taken, double min_period);

}  // namespace lumi
