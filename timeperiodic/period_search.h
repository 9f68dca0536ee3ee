// The period whose harmonics predict best cycles that they were not fitted to; the shortest of those that predict
// alike.
#pragma once

#include <optional>
#include <vector>

#include "timeperiodic/harmonic_fit.h"
#include "timeperiodic/period.h"

namespace lumi {

constexpr int kMaxHarmonics = 32;
constexpr int kMaxModulated = 12;      // harmonics, where each is multiplied by the camera's place too
constexpr double kNearlyAsGood = 0.8;  // of what the taken period explains: worth telling
inline int MostHarmonics(const Signals& signals) {
  return signals.modulation.cols() > 0 ? kMaxModulated : kMaxHarmonics;
}

struct Refined {
  double period = 0;
  CrossValidation fit;
};

// What the period explains of the camera's movement.
double CameraShare(const Signals& signals, const Eigen::MatrixXd& camera, double period);

// Candidates refined and cross-validated, best first. fit: of these signals.
std::vector<Refined> CandidatePeriods(const HarmonicFit& fit, const Signals& signals, const Eigen::MatrixXd& camera,
                                      const PeriodOptions& options, double max_period);

// The fundamental among them, or a multiple of it whose own lines the spectrum shows. None where the best is no better
// than chance.
std::optional<Refined> TakePeriod(const HarmonicFit& fit, const Signals& signals,
                                  const std::vector<Refined>& candidates, const PeriodOptions& options,
                                  double max_period);

}  // namespace lumi
