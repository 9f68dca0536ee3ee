// Which lens model the data ask for: each is fitted to all views and, for its held-out error, to all but a fold of
// them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/refine.h"

namespace lumi {

constexpr const char* kSimplestUseful = "square-k1k2";  // the fewest terms that most lenses can do with
constexpr int kFullIterations = 200;                    // at most, of a fit that is kept

// A model's fit to all views, and what the folds say of it.
struct HeldOutFit {
  Calibration all;
  std::optional<double> rms_px;  // cross-validated
  std::vector<double> squares;   // of each view, held out
  std::string why_not;
  double seconds = 0;
};

// start: of all terms; those that a model holds rest.
std::vector<HeldOutFit> FitModels(const Board& board, const std::vector<BoardView>& views,
                                  const std::vector<LensModel>& models, const CalibrationStart& start, int fold_count);

// The fewest terms whose held-out error is within one standard error of the best's (over views, paired), or that lack
// only terms which are zero within their own noise: with few views the standard error is itself rough, and the best of
// many models is one by luck.
// `choice`: why, one line.
std::size_t ChooseModel(const std::vector<LensModel>& models, const std::vector<HeldOutFit>& fits, std::string& choice);

// Held terms at their resting values.
CalibrationStart Restrict(CalibrationStart start, const LensModel& model);

// Corners that no outlier test has left out.
long UsedCorners(const std::vector<BoardView>& views);

}  // namespace lumi
