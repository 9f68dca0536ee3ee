#include "timeperiodic/period.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/program/error.h"
#include "timeperiodic/harmonic_fit.h"
#include "timeperiodic/least_squares.h"
#include "timeperiodic/period_few_cycles.h"
#include "timeperiodic/period_search.h"
#include "timeperiodic/period_time.h"
#include "timeperiodic/spectrum.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Eigen::Index kFewestFramesOfAll = 8;
constexpr Eigen::Index kMostShift = 4000;  // frames: two minutes and more, at a cost of its square
// A multiple that predicts held-out cycles better by this factor is named in a warning.
constexpr double kClearlyBetter = 1.2;
// Below this share of the variance there is a warning: it was seen with wrong periods. (With a moving camera, parallax
// is most of what is not explained; a fifth is explained where the period is right to a ten-thousandth.)
constexpr double kWeak = 0.15;
constexpr double kMinCycles = 2.2;     // for fits that are validated on other cycles
constexpr double kResolved = 4;        // frames: from here on motion between frames is less than a quarter turn
constexpr Eigen::Index kTrend = 3;     // half waves over the video: slower than a period that is filmed twice
constexpr double kCameraShare = 0.8;   // of the camera's movement explained by the scene's period: commensurate
constexpr int kMostInStep = 4;         // periods of the scene that one of the camera may take ...
constexpr double kMoreInStep = 0.1;    // ... where so much more of its movement is explained than by fewer
constexpr double kMuchShorter = 4;     // times: harmonics of a period that fold back onto a longer one
constexpr double kFoldedShare = 0.6;   // of what the short one explains: the long one explains at least this
constexpr double kFewBetter = 0.15;    // correlation by which one long cycle beats what repeats faster within it
constexpr std::size_t kMostShown = 9;  // candidates
constexpr double kSameRatio = 0.01;    // two periods' ratio is called a half, third ... within this
// Plots: shifts of four periods, and 600 periods from a fifth of the taken one to five times it.
constexpr double kShownPeriods = 4.2, kShownTimes = 5;
constexpr int kShownSteps = 600, kShownHarmonics = 4;

std::vector<double> Aliases(double period) {
  // 1 / T + k and k - 1 / T for k = 1: all others are shorter still.
  std::vector<double> all{1 / (1 + 1 / period)};
  if (period > 1) all.push_back(1 / (1 - 1 / period));
  std::erase_if(all, [&](double p) { return std::abs(p - period) < 1e-9; });
  return all;
}

// Takes out changes slower than any period that two cycles show (a codec that settles, light that fades): harmonics of
// short periods fold back to these frequencies.
Signals WithoutTrend(const Signals& s) {
  const double begin = s.time.minCoeff(), span = s.time.maxCoeff() - begin;
  if (!(span > 0)) return s;
  MatrixXd all(s.nuisance.rows(), s.nuisance.cols() + kTrend);
  all.leftCols(s.nuisance.cols()) = s.nuisance;
  for (Eigen::Index k = 0; k < kTrend; ++k)
    all.col(s.nuisance.cols() + k) =
        ((s.time.array() - begin) * (std::numbers::pi * static_cast<double>(k + 1) / span)).cos();
  Signals out = s;
  out.nuisance = OrthonormalSpan(all);
  out.values -= out.nuisance * (out.nuisance.transpose() * out.values);
  return out;
}

std::string RelationOf(double period, double taken) {
  const struct {
    double ratio;
    const char* name;
  } kKnown[] = {{1, "taken"},  {0.5, "half"}, {1.0 / 3, "third"}, {0.25, "quarter"},
                {2, "double"}, {3, "triple"}, {4, "quadruple"}};
  for (const auto& k : kKnown)
    if (std::abs(period / taken / k.ratio - 1) < kSameRatio) return k.name;
  return "other";
}

// What all steps look at.
struct PeriodTask {
  const Signals& given;
  const Signals& steady;  // without trend
  const PeriodOptions& options;
  std::vector<double> rho;  // self-similarity by shift
  double max_period;        // frames, for fits that are validated on other cycles
  double span;              // of all times, frames
};

// Whether a short period is a long one seen through its harmonics: one of them, beyond half the frame rate, folds back
// to where the long one has its first ones.
bool FoldsOnto(const Refined& taken, double period, double span) {
  if (taken.period * kMuchShorter > period) return false;
  for (int h = 2; h <= taken.fit.harmonics; ++h) {
    const double f = h / taken.period;
    if (f <= kNyquist) continue;
    for (const int k : {1, 2})
      if (std::abs(Folded(f) - k / period) < kSameLine / span) return true;
  }
  return false;
}

// The estimate from few cycles, where there are too few for harmonics, or where one long cycle explains much more than
// what repeats faster within it. (A moving camera that comes back to its place makes shifted frames alike, too.)
std::optional<PeriodEstimate> FewCyclesInstead(const PeriodTask& task, const std::optional<Refined>& taken,
                                               bool moving_camera) {
  if (taken && moving_camera) return std::nullopt;
  const auto few = FromFewCycles(task.given, task.rho);
  const PeriodOptions& o = task.options;
  if (!few || few->period_frames < o.min_period || (o.max_period > 0 && few->period_frames > o.max_period))
    return std::nullopt;
  if (!taken) return few;
  // At the shortest shifts frames are alike because little has moved.
  std::size_t unlike = 1;
  while (unlike + 1 < task.rho.size() && task.rho[unlike + 1] < task.rho[unlike]) ++unlike;
  double own = taken->fit.explained * task.steady.values.squaredNorm() / task.given.values.squaredNorm();
  const bool folds = FoldsOnto(*taken, few->period_frames, task.span);
  for (double p = taken->period; !folds && p < task.max_period * 1.05; p += taken->period)
    if (const auto k = static_cast<std::size_t>(std::lround(p)); k >= unlike && k < task.rho.size())
      own = std::max(own, task.rho[k]);
  if (few->period_frames > task.max_period && few->explained > (folds ? kFoldedShare * own : own + kFewBetter))
    return few;
  return std::nullopt;
}

void DescribeFewCycles(const std::vector<double>& rho, double span, PeriodEstimate& e) {
  e.candidates.push_back({e.period_frames, "taken", e.explained, 0});
  for (const double ratio : {0.5, 2.0})
    if (const auto k = static_cast<std::size_t>(std::lround(ratio * e.period_frames));
        k < rho.size() && static_cast<double>(k) < span - 3)
      e.candidates.push_back({static_cast<double>(k), ratio < 1 ? "half" : "double", rho[k], 0});
  e.warnings.push_back(fmt::format("only {:.1f} periods were filmed: the period is known to about {:.1f} frames",
                                   span / e.period_frames, e.sigma_frames));
}

// The taken period, its fractions and multiples, and what else was found.
std::vector<PeriodCandidate> ListCandidates(const PeriodTask& task, const HarmonicFit& fit,
                                            const std::vector<Refined>& all, double taken, const PeriodEstimate& e) {
  std::vector<PeriodCandidate> list{{e.period_frames, "taken", e.explained, e.harmonics}};
  for (const double ratio : {1.0 / 3, 0.5, 2.0, 3.0}) {
    const double p = ratio * e.period_frames;
    if (p < task.options.min_period || p > task.max_period) continue;
    const CrossValidation cv = fit.CrossValidate(p, MostHarmonics(task.steady));
    list.push_back({p, RelationOf(p, e.period_frames), cv.explained, cv.harmonics});
  }
  for (const Refined& r : all)
    if (RelationOf(r.period, taken) == "other" && list.size() < kMostShown)
      list.push_back({r.period, "other", r.fit.explained, r.fit.harmonics});
  return list;
}

void WarnOfHarmonics(PeriodEstimate& e) {
  for (const PeriodCandidate& k : e.candidates)
    if ((k.relation == "half" || k.relation == "third") && k.explained > kNearlyAsGood * e.explained) {
      e.ambiguous = true;
      e.warnings.push_back(fmt::format(
          "a {} of it ({:.4g} frames) explains {:.0f} % of what it does: like blades of a rotor; where they are alike "
          "to you, take that",
          k.relation, k.period_frames, 100 * k.explained / e.explained));
    }
  for (const PeriodCandidate& k : e.candidates)
    if ((k.relation == "double" || k.relation == "triple") && k.explained > kClearlyBetter * e.explained) {
      e.ambiguous = true;
      e.warnings.push_back(
          fmt::format("{} times it ({:.4g} frames) explains more, but too few of them were filmed to be sure: film "
                      "longer, or say the period",
                      k.relation == "double" ? "two" : "three", k.period_frames));
    }
  if (e.explained < kWeak)
    e.warnings.push_back(
        fmt::format("only {:.0f} % of what moves repeats with it: the period may be wrong; a video from a tripod tells "
                    "it best (lumi-timeperiodic calibrate --fixed-video)",
                    100 * std::max(0.0, e.explained)));
  if (e.drifts)
    e.warnings.push_back(fmt::format(
        "the period drifts by {:+.2f} % (+-{:.2f}) from the beginning to the end; {:.6g} frames is its mean",
        e.drift_percent, e.drift_sigma_percent, e.period_frames));
  for (const Slip& slip : e.slips)
    e.warnings.push_back(slip.frames > 0 ? fmt::format("{} frame{} dropped before frame {}", slip.frames,
                                                       slip.frames > 1 ? "s were" : " was", slip.frame)
                                         : fmt::format("{} frame{} doubled before frame {}", -slip.frames,
                                                       slip.frames < -1 ? "s were" : " was", slip.frame));
}

void WarnOfAliases(PeriodEstimate& e) {
  if (!(e.period_frames < kResolved)) return;
  e.aliases_frames = Aliases(e.period_frames);
  std::string periods;
  for (const double p : e.aliases_frames) periods += fmt::format("{}{:.4g}", periods.empty() ? "" : " or ", p);
  e.warnings.push_back(
      fmt::format("the scene moves by more than a quarter of its period between frames: it may be aliased, a period of "
                  "{} frames looks the "
                  "same; film at a higher frame rate to tell",
                  periods));
}

// Warns where the camera moves in step with the period, or with a few periods: explaining the camera's movement may
// then have removed the scene's own, longer period.
void WarnOfCameraInStep(const Signals& s, const MatrixXd& camera, double span, PeriodEstimate& e) {
  int in_step = 1;
  for (int k = 1; k <= kMostInStep && k * e.period_frames < span; ++k)
    if (const double share = CameraShare(s, camera, k * e.period_frames); share > e.camera_share + kMoreInStep)
      e.camera_share = share, in_step = k;
  if (e.camera_share > kCameraShare)
    e.warnings.push_back(
        fmt::format("the camera's own movement repeats every {}period{} ({:.0f} % of it): what the scene does and what "
                    "the camera does cannot be "
                    "told apart; wave the camera faster or slower",
                    in_step > 1 ? fmt::format("{} ", in_step) : "", in_step > 1 ? "s" : "", 100 * e.camera_share));
}

void AddPlots(const PeriodTask& task, const HarmonicFit& fit, PeriodEstimate& e) {
  const auto shown =
      std::min<std::size_t>(task.rho.size(), static_cast<std::size_t>(kShownPeriods * e.period_frames) + 8);
  for (std::size_t k = 0; k < shown; ++k) e.similarity.emplace_back(static_cast<double>(k), task.rho[k]);
  const double least = std::max(2.0, e.period_frames / kShownTimes),
               most = std::min(task.max_period, kShownTimes * e.period_frames);
  for (int i = 0; i <= kShownSteps; ++i) {
    const double p = least * std::pow(most / least, i / static_cast<double>(kShownSteps));
    if (p > 0 && std::isfinite(p)) e.periodogram.emplace_back(p, fit.Explained(p, kShownHarmonics));
  }
}

}  // namespace

std::optional<std::string> Validate(const PeriodOptions& o) {
  if (!(o.min_period >= 2))
    return "the shortest period must be at least 2 frames: shorter ones cannot be told from longer ones";
  if (o.max_period != 0 && !(o.max_period > o.min_period)) return "the longest period must exceed the shortest";
  if (!(o.min_explained >= 0 && o.min_explained < 1)) return "the least explained share must be from 0 to below 1";
  return std::nullopt;
}

void RequireResolved(double period) {
  if (!(period >= 2))
    throw DataError(fmt::format("a period of {:.4g} frames is aliased: below 2 frames it looks like {:.4g} frames",
                                period, 1 / Folded(1 / period)),
                    "film at a higher frame rate");
}

PeriodEstimate CountedPeriod(int a, int b, int periods, const std::vector<double>& time) {
  if (periods < 1) throw UsageError("--count must be at least 1");
  if (a < 0 || b < 0 || a == b) throw UsageError("--frames takes two different frame numbers, from 0");
  PeriodEstimate e;
  const double apart =
      time.empty() ? b - a : time.at(static_cast<std::size_t>(b)) - time.at(static_cast<std::size_t>(a));
  e.period_frames = std::abs(apart) / periods;
  // Each of the two frames is chosen to the nearest whole frame: its error is uniform within half a frame.
  e.sigma_frames = std::sqrt(2.0 / 12) / periods;
  e.cycles = periods;
  e.explained = 1;
  RequireResolved(e.period_frames);
  e.candidates.push_back({e.period_frames, "taken", 1, 0});
  return e;
}

PeriodEstimate EstimatePeriod(const Signals& given, const MatrixXd& camera, const PeriodOptions& options) {
  if (const auto wrong = Validate(options)) throw UsageError(*wrong);
  const Eigen::Index n = given.time.size();
  const DataError nothing("nothing repeats in this video: no period predicts one part of it from the others",
                          "film several periods, from a tripod or with a background that stands still");
  if (n < kFewestFramesOfAll)
    throw DataError(fmt::format("{} frames are too few for a period", n), "film several periods");
  const Signals s = WithoutTrend(given);
  if (!(s.values.squaredNorm() > 0)) throw nothing;
  HarmonicFit fit(s, s.modulation.cols() > 0);
  PeriodTask task{
      given,     s, options, SelfSimilarity(given, std::min<Eigen::Index>(n - 1, kMostShift)), fit.span() / kMinCycles,
      fit.span()};
  if (options.max_period > 0) task.max_period = std::min(task.max_period, options.max_period);
  std::optional<Refined> taken;
  std::vector<Refined> all;
  if (task.max_period > options.min_period * 1.01) {
    all = CandidatePeriods(fit, s, camera, options, task.max_period);
    taken = TakePeriod(fit, s, all, options, task.max_period);
  }
  const auto few = FewCyclesInstead(task, taken, camera.cols() > 0);
  if (!taken && !few) throw nothing;

  PeriodEstimate e;
  if (few) {
    e = *few;
    DescribeFewCycles(task.rho, fit.span(), e);
  } else {
    TimedPeriod timed = FitTime(fit, s, *taken, options.min_period);
    e.period_frames = timed.period, e.sigma_frames = timed.sigma;
    e.harmonics = timed.harmonics;
    e.explained = timed.explained;
    e.slips = std::move(timed.slips);
    e.drift_percent = timed.drift_percent, e.drift_sigma_percent = timed.drift_sigma_percent, e.drifts = timed.drifts;
    e.candidates = ListCandidates(task, fit, all, taken->period, e);
    WarnOfHarmonics(e);
  }
  e.cycles = fit.span() / e.period_frames;
  WarnOfAliases(e);
  WarnOfCameraInStep(s, camera, fit.span(), e);
  AddPlots(task, fit, e);
  return e;
}

}  // namespace lumi
