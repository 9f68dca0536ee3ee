#include "calibrate/choose_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "calibrate/fit.h"
#include "scene/geometry/constants.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr double kSameErrorPx = 1e-4;  // cross-validated errors nearer than this are equal
constexpr std::size_t kLeastTrainingViews = 3;
constexpr double kSharedSigmas = 2;  // a focal length this near to the other models' agrees with theirs

// Whether the terms that `rich` frees and `lean` holds are jointly zero within three standard deviations of rich's own
// fit.
bool ExtraTermsAreNoise(const Calibration& rich, const LensModel& lean) {
  constexpr std::array<double, 8> kThreeSigma = {0,     9,     11.83, 14.16,
                                                 16.25, 18.21, 20.06, 21.85};  // quantiles of chi^2 at 99.73 %
  std::vector<int> extra;
  for (int term = 0; term < kTermCount; ++term) {
    const auto i = static_cast<std::size_t>(term);
    if (lean.free[i] && !rich.model.free[i]) return false;  // not nested: nothing is known
    if (rich.model.free[i] && !lean.free[i]) extra.push_back(term);
  }
  const Intrinsics rest = NominalIntrinsics(1, 0, 0);
  const auto n = static_cast<Eigen::Index>(extra.size());
  Eigen::MatrixXd covariance(n, n);
  Eigen::VectorXd value(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int term = extra[static_cast<std::size_t>(i)];
    value[i] = rich.intrinsics[term] - rest[term];
    for (Eigen::Index j = 0; j < n; ++j)
      covariance(i, j) = std::pow(rich.noise_px, 2) * rich.unit_covariance(term, extra[static_cast<std::size_t>(j)]);
  }
  return value.dot(SolveSymmetric(covariance, value).col(0)) <= kThreeSigma[extra.size()];
}

// Whether a model's held-out error equals the best model's within statistical noise.
bool WithinNoise(const HeldOutFit& fit, const HeldOutFit& best, const LensModel& model) {
  if (*fit.rms_px <= *best.rms_px + kSameErrorPx) return true;
  const auto n = static_cast<double>(best.squares.size());
  double mean = 0, variance = 0;
  for (std::size_t v = 0; v < best.squares.size(); ++v) mean += (fit.squares[v] - best.squares[v]) / n;
  for (std::size_t v = 0; v < best.squares.size(); ++v)
    variance += std::pow(fit.squares[v] - best.squares[v] - mean, 2) / (n - 1);
  return mean <= std::sqrt(variance / n) || ExtraTermsAreNoise(best.all, model);
}

// The focal length that most models that do as well as one another agree on, and its uncertainty.
struct SharedFocal {
  double median_px = 0, sigma_px = 0;  // sigma: the larger of their median own one and of their scatter (by MAD)
  bool IsSharedBy(const Calibration& c) const {
    return std::abs(c.intrinsics[kFx] - median_px) <= kSharedSigmas * std::max(sigma_px, c.Sigma(kFx, c.noise_px));
  }
};
SharedFocal FocalOf(const std::vector<HeldOutFit>& fits, const std::vector<char>& as_good) {
  std::vector<double> focals, sigmas, deviations;
  for (std::size_t m = 0; m < fits.size(); ++m)
    if (as_good[m]) {
      focals.push_back(fits[m].all.intrinsics[kFx]);
      sigmas.push_back(fits[m].all.Sigma(kFx, fits[m].all.noise_px));
    }
  const double median = Median(focals);
  for (const double f : focals) deviations.push_back(std::abs(f - median));
  return {median, std::max(Median(sigmas), kSigmaPerMad * Median(deviations))};
}

// Root mean square difference between this model's answer and those of the models that do as well, less the difference
// to be expected where this model is right: a model with more terms scatters by more, namely by the difference of the
// variances about the leaner model's answer (the basis of Hausman's test).
PixelTerms SpreadAround(const Calibration& chosen, const std::vector<HeldOutFit>& fits,
                        const std::vector<char>& as_good) {
  const auto spread = [&](double PixelTerms::*term) {
    double squares = 0, count = 0;
    for (std::size_t m = 0; m < fits.size(); ++m) {
      if (!as_good[m]) continue;
      const Calibration& c = fits[m].all;
      const double by_noise =
          std::pow(c.PixelSigmas(c.noise_px).*term, 2) - std::pow(chosen.PixelSigmas(chosen.noise_px).*term, 2);
      squares += std::pow(c.Pixels().*term - chosen.Pixels().*term, 2) - std::max(0.0, by_noise);
      ++count;
    }
    return std::sqrt(std::max(0.0, squares / count));
  };
  return {spread(&PixelTerms::fx), spread(&PixelTerms::fy), spread(&PixelTerms::cx), spread(&PixelTerms::cy)};
}

struct FoldOutcome {
  bool usable = false;
  std::string why;
  std::vector<double> squares;  // one a view of the fold
  double seconds = 0;
};

struct Fold {
  std::vector<BoardView> training, held_out;
  std::vector<std::size_t> training_index, held_out_index;
};

std::vector<Fold> MakeFolds(const std::vector<BoardView>& views, int folds) {
  std::size_t count = std::min(views.size(), static_cast<std::size_t>(folds));
  // Of few views more folds than asked for: a fold leaves enough of them.
  const auto largest = [&] { return (views.size() + count - 1) / count; };
  while (count < views.size() && views.size() - largest() < kLeastTrainingViews) ++count;
  std::vector<Fold> all(count);
  for (std::size_t f = 0; f < count; ++f)
    for (std::size_t v = 0; v < views.size(); ++v) {
      const bool out = v % count == f;
      (out ? all[f].held_out : all[f].training).push_back(views[v]);
      (out ? all[f].held_out_index : all[f].training_index).push_back(v);
    }
  return all;
}

std::vector<Rigid3> Pick(const std::vector<Rigid3>& poses, const std::vector<std::size_t>& index) {
  std::vector<Rigid3> picked;
  for (const std::size_t i : index) picked.push_back(poses[i]);
  return picked;
}

}  // namespace

CalibrationStart Restrict(CalibrationStart start, const LensModel& model) {
  const Intrinsics rest = NominalIntrinsics(start.intrinsics[kFx], 0, 0);
  for (int term = 0; term < kTermCount; ++term)
    if (!model.free[static_cast<std::size_t>(term)]) start.intrinsics[term] = rest[term];
  return start;
}

long UsedCorners(const std::vector<BoardView>& views) {
  long count = 0;
  for (const BoardView& view : views)
    for (std::size_t i = 0; i < view.corners_px.size(); ++i) count += view.Used(i) ? 1 : 0;
  return count;
}

std::vector<HeldOutFit> FitModels(const Board& board, const std::vector<BoardView>& views,
                                  const std::vector<LensModel>& models, const CalibrationStart& start, int fold_count) {
  std::vector<HeldOutFit> fits(models.size());
  ParallelEach(models.size(), 1, [&](std::size_t m) {
    fits[m].all = Refine(board, views, {models[m], 0, kFullIterations}, Restrict(start, models[m]));
  });

  std::vector<Fold> folds = MakeFolds(views, fold_count);
  if (std::ranges::any_of(folds, [](const Fold& f) { return f.training.size() < kLeastTrainingViews; })) folds.clear();
  std::vector<FoldOutcome> outcomes(models.size() * folds.size());
  ParallelEach(outcomes.size(), 1, [&](std::size_t i) {
    const std::size_t m = i / folds.size();
    const Calibration& whole = fits[m].all;
    const Fold& fold = folds[i % folds.size()];
    if (!whole.usable) return;
    const Calibration c = Refine(board, fold.training, {models[m], 0, kFullIterations},
                                 {whole.intrinsics, Pick(whole.cam_from_board, fold.training_index)});
    outcomes[i].seconds = c.seconds;
    outcomes[i].usable = c.usable;
    outcomes[i].why = c.why;
    if (c.usable)
      outcomes[i].squares =
          HeldOutSquares(board, fold.held_out, c.intrinsics, Pick(whole.cam_from_board, fold.held_out_index));
  });

  const auto corners = static_cast<double>(UsedCorners(views));
  for (std::size_t m = 0; m < models.size(); ++m) {
    HeldOutFit& fit = fits[m];
    fit.why_not = fit.all.why;
    fit.seconds = fit.all.seconds;
    if (!fit.all.usable || folds.empty()) continue;
    fit.squares.assign(views.size(), 0);
    bool whole = true;
    for (std::size_t f = 0; f < folds.size() && whole; ++f) {
      const FoldOutcome& outcome = outcomes[m * folds.size() + f];
      fit.seconds += outcome.seconds;
      whole = outcome.usable;
      if (!whole) fit.why_not = fmt::format("without fold {}: {}", f + 1, outcome.why);
      for (std::size_t i = 0; i < outcome.squares.size(); ++i)
        fit.squares[folds[f].held_out_index[i]] = outcome.squares[i];
    }
    if (whole) fit.rms_px = std::sqrt(std::accumulate(fit.squares.begin(), fit.squares.end(), 0.0) / corners);
  }
  return fits;
}

ModelChoice ChooseModel(const std::vector<LensModel>& models, const std::vector<HeldOutFit>& fits) {
  ModelChoice choice;
  std::optional<std::size_t> best;
  for (std::size_t m = 0; m < models.size(); ++m)
    if (fits[m].rms_px && (!best || *fits[m].rms_px < *fits[*best].rms_px)) best = m;
  if (!best) {
    choice.why = "too few views to compare models: four are needed";
    choice.model = static_cast<std::size_t>(
        std::ranges::find_if(models, [](const LensModel& m) { return m.name == kSimplestUseful; }) - models.begin());
    return choice;
  }
  for (std::size_t m = 0; m < models.size(); ++m)
    choice.as_good.push_back(fits[m].rms_px && WithinNoise(fits[m], fits[*best], models[m]));
  const SharedFocal shared = FocalOf(fits, choice.as_good);
  std::optional<std::size_t> fewest, apart;  // of all that do as well; of those that share the focal length
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (!choice.as_good[m]) continue;
    const auto leaner = [&](const std::optional<std::size_t>& than) {
      const int terms = models[m].FreeCount(), other = than ? models[*than].FreeCount() : 0;
      return !than || terms < other || (terms == other && *fits[m].rms_px < *fits[*than].rms_px);
    };
    const bool shares = shared.IsSharedBy(fits[m].all);
    if (!shares && leaner(apart)) apart = m;
    if (shares && leaner(fewest)) fewest = m;
  }
  choice.model = *fewest;  // the median itself shares it
  choice.spread_px = SpreadAround(fits[choice.model].all, fits, choice.as_good);
  choice.why = fmt::format(
      "the fewest terms that do as well, within noise, as the smallest cross-validated error ({}, {:.4f} px)",
      models[*best].name, *fits[*best].rms_px);
  if (apart && models[*apart].FreeCount() < models[choice.model].FreeCount())
    choice.why += fmt::format(", and share the others' focal length ({:.2f} px; {} has {:.2f})", shared.median_px,
                              models[*apart].name, fits[*apart].all.intrinsics[kFx]);
  return choice;
}

}  // namespace lumi
