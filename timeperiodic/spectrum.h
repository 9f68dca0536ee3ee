// Power of the signals over frequency, and where the harmonics of a period carry much of it: the places to look
// closely.
#pragma once

#include <vector>

#include "timeperiodic/signals.h"

namespace lumi {

constexpr double kNyquist = 0.5;   // cycles a frame: what is faster is seen folded back below
constexpr double kSameLine = 0.7;  // cycles over the video: frequencies nearer than this are one line

// Where frames show a frequency: folded back to 0 ... kNyquist. Cycles a frame.
double Folded(double cycles_per_frame);

struct Spectrum {
  double step = 0;  // cycles a frame, from one value to the next; the first is at 0
  // Share of the variance, up to half a cycle a frame; where times are no whole frames, several cycles: what is faster
  // then does not fold back.
  std::vector<double> power;
  bool folds = true;

  // Power at any frequency; where `folds`, one that frames do not show is folded back. 0 beyond what is known.
  double At(double cycles_per_frame) const;
  // Sum over harmonics 1 ... count of a fundamental.
  double HarmonicSum(double cycles_per_frame, int count) const;
};

// values: a row for each of `time` (frames): by FFT where these are whole frames, else with each value spread over the
// two nearest places of a grid eight times as fine, which leaves 98 % of an amplitude at half a cycle a frame. Shares
// are of `total`, the sum of squares that is 1.
Spectrum SpectrumOf(const Eigen::MatrixXd& values, const Eigen::VectorXd& time, double total);
Spectrum SpectrumOf(const Signals& signals);

// How far a line stands out of the spectrum around it: standard deviations of that, robustly. span: of all times,
// frames.
double LineEvidence(const Spectrum& spectrum, double cycles_per_frame, double span_frames);

// Fundamentals (cycles a frame) whose harmonics carry most, strongest first, for one and for several harmonics.
std::vector<double> LikelyFundamentals(const Spectrum& spectrum, double span_frames, double min_period,
                                       double max_period);

}  // namespace lumi
