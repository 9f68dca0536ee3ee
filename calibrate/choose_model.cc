#include "calibrate/choose_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "calibrate/fit.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr double kSameErrorPx = 1e-4;  // cross-validated errors nearer than this are one
constexpr std::size_t kLeastTrainingViews = 3;

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
  const std::size_t count = std::min(views.size(), static_cast<std::size_t>(folds));
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

std::size_t ChooseModel(const std::vector<LensModel>& models, const std::vector<HeldOutFit>& fits,
                        std::string& choice) {
  std::optional<std::size_t> best;
  for (std::size_t m = 0; m < models.size(); ++m)
    if (fits[m].rms_px && (!best || *fits[m].rms_px < *fits[*best].rms_px)) best = m;
  if (!best) {
    choice = "too few views to compare models: four are needed";
    return static_cast<std::size_t>(
        std::ranges::find_if(models, [](const LensModel& m) { return m.name == kSimplestUseful; }) - models.begin());
  }
  const std::vector<double>& least = fits[*best].squares;
  const auto n = static_cast<double>(least.size());
  const auto within_noise = [&](std::size_t m) {
    if (*fits[m].rms_px <= *fits[*best].rms_px + kSameErrorPx) return true;
    double mean = 0, variance = 0;
    for (std::size_t v = 0; v < least.size(); ++v) mean += (fits[m].squares[v] - least[v]) / n;
    for (std::size_t v = 0; v < least.size(); ++v)
      variance += std::pow(fits[m].squares[v] - least[v] - mean, 2) / (n - 1);
    return mean <= std::sqrt(variance / n) || ExtraTermsAreNoise(fits[*best].all, models[m]);
  };
  std::size_t chosen = *best;
  for (std::size_t m = 0; m < models.size(); ++m) {
    if (!fits[m].rms_px || !within_noise(m)) continue;
    const int terms = models[m].FreeCount(), fewest = models[chosen].FreeCount();
    if (terms < fewest || (terms == fewest && *fits[m].rms_px < *fits[chosen].rms_px)) chosen = m;
  }
  choice = fmt::format(
      "the fewest terms that do as well, within noise, as the smallest cross-validated error ({}, {:.4f} px)",
      models[*best].name, *fits[*best].rms_px);
  return chosen;
}

}  // namespace lumi
