// Signals as a sum of harmonics of one period, fitted by least squares beside what is no part of it
// (Signals::nuisance), at the frames' own times: harmonics beyond half the frame rate are taken as they fold back.
#pragma once

#include <Eigen/Core>

#include "timeperiodic/signals.h"

namespace lumi {

struct CrossValidation {
  double explained =
      0;  // share of the signals' variance, in cycles that the fit has not seen; below 0: worse than nothing
  int harmonics = 0;      // how many do best
  int essential = 0;      // the fewest that do within 0.02 of that
  Eigen::VectorXd error;  // of each frame there, squared, in the signals' units
};

class HarmonicFit {
 public:
  // The signals must outlive it. modulated: harmonics also multiplied by Signals::modulation.
  explicit HarmonicFit(const Signals& signals, bool modulated = false);

  // The time that harmonics are fitted at in place of the frames' own, in frames (a row of the signals each).
  void SetTime(const Eigen::VectorXd& time);
  const Eigen::VectorXd& time() const { return time_; }

  // Share of the signals' variance that `harmonics` of the period explain. In (0, 1).
  double Explained(double period, int harmonics) const;
  // Over cycles in turn; the number of harmonics that does best, up to max_harmonics.
  CrossValidation CrossValidate(double period, int max_harmonics) const;
  CrossValidation CrossValidate(double period, int first, int last) const;
  // The period near `start` (within `reach` cycles over the whole video) that explains most.
  double Refine(double start, int harmonics, double reach) const;

  // What the fit leaves.
  Eigen::MatrixXd Rest(double period, int harmonics) const;

  // How far each frame is ahead of the fit, in frames (positive: it shows what the fit shows later), and how much that
  // says.
  struct Offsets {
    Eigen::VectorXd lead;    // a frame each
    Eigen::VectorXd weight;  // squared slope of the fit there
  };
  Offsets FrameOffsets(double period, int harmonics) const;

  // Standard deviation of the period that explains most, frames. What the fit leaves errs together within each of
  // `blocks` parts of the video, which a camera's movement makes it do (the sandwich estimate, clustered). The period
  // itself where the signals tell nothing of it.
  double PeriodSigma(double period, int harmonics, Eigen::Index blocks) const;

  double span() const { return span_; }  // of all times, frames

 private:
  Eigen::MatrixXd Basis(double period, int harmonics) const;
  const Signals& signals_;
  Eigen::VectorXd time_;
  bool modulated_ = false;
  double span_ = 0, total_ = 0;
};

}  // namespace lumi
