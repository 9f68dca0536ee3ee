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

// start: values of all terms; a term that a model holds is set to its resting value.
std::vector<HeldOutFit> FitModels(const Board& board, const std::vector<BoardView>& views,
                                  const std::vector<LensModel>& models, const CalibrationStart& start, int fold_count);

// Which model is chosen, and how far the answers of the others that do as well differ from its own.
struct ModelChoice {
  std::size_t model = 0;
  std::string why;            // one line
  std::vector<char> as_good;  // of each model, whether its held-out error is the best's within noise; none: unknown
  // By how much the answers of those differ, beyond what the corners' noise explains (standard deviations, px).
  PixelTerms spread_px;
};

// Models do as well as the best where their held-out error is within one standard error of its (over views, paired), or
// where they lack only terms which are zero within their own noise: with few views the standard error is itself rough,
// and the best of many models is one by luck. Of these the one with the fewest terms is taken whose focal length the
// others share; a lean model may be as good on the boards and buy that with a focal length of its own.
ModelChoice ChooseModel(const std::vector<LensModel>& models, const std::vector<HeldOutFit>& fits);

// Held terms at their resting values.
CalibrationStart Restrict(CalibrationStart start, const LensModel& model);

// Corners that no outlier test has left out.
long UsedCorners(const std::vector<BoardView>& views);

}  // namespace lumi
