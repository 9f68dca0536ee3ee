// The period of a scene from the signals of a video (thesis, section 7.2.1, where two frames that look alike are sought
// by eye and the periods between them counted).
//
// Periods whose harmonics carry much of the spectrum are candidates, with their halves, thirds and multiples. Each is
// refined and judged by how well it predicts cycles that it was not fitted to; the shortest that predicts as well as
// any is the fundamental. Frames that were dropped or doubled, and a period that drifts, are found in how far frames
// lead the fit.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "timeperiodic/signals.h"

namespace lumi {

struct PeriodOptions {
  double min_period = 2;       // frames, >= 2
  double max_period = 0;       // frames; 0: as the video's length allows
  double min_explained = 0.1;  // share of the variance that a period must predict, 0 to 1
};
std::optional<std::string> Validate(const PeriodOptions& options);

struct PeriodCandidate {
  double period_frames = 0;
  std::string relation;  // to the one taken: "taken", "half", "third", "double", "triple", "other"
  double explained = 0;  // share of the variance in cycles that the fit has not seen
  int harmonics = 0;
};

// From `frame` on, frames come so many later than their numbers say: dropped ones > 0, doubled ones < 0.
struct Slip {
  int frame = 0;
  int frames = 0;
};

struct PeriodEstimate {
  double period_frames = 0;
  double sigma_frames = 0;  // standard deviation, from how consistently the parts of the video agree
  double cycles = 0;        // that the video shows
  double explained = 0;
  int harmonics = 0;
  std::vector<PeriodCandidate> candidates;  // the taken one first
  bool ambiguous = false;                   // a half or third is nearly as plausible
  std::vector<double> aliases_frames;  // periods below or near 2 frames that would look the same; empty where motion is
                                       // slow enough to tell
  double drift_percent = 0;            // of the period, from the video's beginning to its end
  double drift_sigma_percent = 0;
  bool drifts = false;  // beyond chance
  std::vector<Slip> slips;
  double camera_share = 0;  // of the camera's own movement that repeats with this period
  bool few_cycles = false;  // less than about two: by correlation of the video with itself
  std::vector<std::string> warnings;
  // For a plot: correlation of the video with itself, shifted; what the harmonics of a period carry.
  std::vector<std::pair<double, double>> similarity;   // shift in frames, correlation
  std::vector<std::pair<double, double>> periodogram;  // period in frames, share of the variance
};

// camera: a row for each row of the signals, what tells the camera's place; without columns for a fixed one. Throws
// DataError where nothing repeats.
PeriodEstimate EstimatePeriod(const Signals& signals, const Eigen::MatrixXd& camera, const PeriodOptions& options);

// From two frames that look alike and the periods between them. `time`: of all frames, in frames; empty: 0, 1, 2 ...
// Throws UsageError, DataError (below 2 frames: aliased).
PeriodEstimate CountedPeriod(int frame_a, int frame_b, int periods, const std::vector<double>& time = {});

// Throws DataError for a period that frames cannot show.
void RequireResolved(double period_frames);

}  // namespace lumi
