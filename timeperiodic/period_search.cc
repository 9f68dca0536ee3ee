#include "timeperiodic/period_search.h"

#include <algorithm>
#include <cmath>

#include "scene/program/parallel_each.h"
#include "timeperiodic/spectrum.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Refining: harmonics that are sure to be there and reach far, then those of the fit. Reaches are in cycles over the
// video: two periods less than kFirstReach apart are one peak of the fit.
constexpr int kFirstHarmonics = 3;
constexpr double kFirstReach = 0.3, kReach = 0.1;
constexpr int kScreenHarmonics = 6;   // with these candidates are ranked
constexpr std::size_t kClosely = 10;  // candidates that are cross-validated

constexpr double kAsGood =
    0.002;  // share of the variance: a longer period that predicts no more than this better is a multiple
constexpr double kSignificant = 3;  // standard errors
constexpr Eigen::Index kBlockFrames = 8, kFewestBlocks = 4,
                       kMostBlocks = 24;  // of frames that err together, for a standard error
constexpr double kAliasShare = 0.6;       // of what an alias explains: what it folds back to explains at least this
constexpr double kSlowerAlias = 0.5;      // of its highest frequency: what it folds back to is this much slower

constexpr double kLine = 8;           // standard deviations that a line of the spectrum must stand out by to be one
constexpr double kFirstLine = 6;      // the same, of a fundamental by itself
constexpr int kFewestLines = 3;       // that speak for a multiple where its fundamental does not
constexpr int kLinesOfMultiple = 4;   // harmonics of the period whose multiples are looked at
constexpr double kMostEvidence = 50;  // standard deviations of one line that count: no single line outweighs all others
constexpr double kGround =
    2;  // cycles over the video: a line must be so far from frequency 0 to have neighbours to stand out from
constexpr int kMostMultiples = 3;    // doublings or treblings in a row
constexpr double kMuchLonger = 1.5;  // a multiple, not the period itself refined
// A camera's movement gives lines beside the harmonics' that the fit lacks, also where a multiple has its own: with a
// moving camera a multiple has to predict nearly as well as the period itself.
constexpr double kAsGoodMoving = 0.96;

constexpr Eigen::Index kCameraAxes = 3;  // of the camera's movement, the strongest
constexpr double kCamerasOwn = 0.5;      // of the camera's movement explained: the period is the camera's ...
constexpr double kScenesOwn = 0.3;       // ... where another one explains this part of what it explains of the scene

constexpr double kChance = 14;  // over the frames' number: share that the best of many periods may predict by chance

// Mean difference of squared errors and its standard error, from blocks of frames that err together.
struct Paired {
  double mean = 0, error = 0;
};
Paired Compare(const VectorXd& a, const VectorXd& b, double total) {
  const Eigen::Index blocks = std::clamp<Eigen::Index>(a.size() / kBlockFrames, kFewestBlocks, kMostBlocks);
  VectorXd d(blocks);
  for (Eigen::Index k = 0; k < blocks; ++k) {
    const Eigen::Index begin = k * a.size() / blocks, end = (k + 1) * a.size() / blocks;
    d[k] = (a.segment(begin, end - begin).sum() - b.segment(begin, end - begin).sum()) / total *
           static_cast<double>(blocks);
  }
  Paired p;
  p.mean = d.mean();
  p.error =
      std::sqrt((d.array() - p.mean).square().sum() / static_cast<double>(blocks - 1) / static_cast<double>(blocks));
  return p;
}

// Candidates refined and cross-validated, best first.
std::vector<Refined> Judge(const HarmonicFit& fit, const std::vector<double>& periods, double min_period,
                           double max_period, int most) {
  std::vector<std::pair<double, double>> ranked(periods.size());
  ParallelEach(periods.size(), 1, [&](std::size_t i) {
    const double p = fit.Refine(periods[i], kFirstHarmonics, kFirstReach);
    ranked[i] = {-fit.Explained(p, kScreenHarmonics), p};
  });
  std::ranges::sort(ranked);
  std::vector<Refined> all;
  for (const auto& [value, p] : ranked) {
    if (p < min_period || p > max_period) continue;
    const bool known = std::ranges::any_of(
        all, [&](const Refined& r) { return std::abs(1 / r.period - 1 / p) < kFirstReach / fit.span(); });
    if (known) continue;
    all.push_back({p, {}});
    if (all.size() == kClosely) break;
  }
  ParallelEach(all.size(), 1, [&](std::size_t i) {
    all[i].fit = fit.CrossValidate(all[i].period, most);
    all[i].period = fit.Refine(all[i].period, std::max(1, all[i].fit.harmonics), kReach);
    all[i].fit = fit.CrossValidate(all[i].period, most);
  });
  std::ranges::sort(all, [](const Refined& a, const Refined& b) { return a.fit.explained > b.fit.explained; });
  return all;
}

// The shortest that predicts as well as the best.
std::size_t Fundamental(const std::vector<Refined>& all, double total, double span) {
  // A short period with many harmonics folds back onto those of a long one with few: the highest frequency tells them
  // apart.
  const auto frequency = [&](std::size_t i) { return all[i].fit.essential / all[i].period; };
  const auto is_alias_of = [&](std::size_t i, std::size_t j) {
    if (all[j].fit.explained < kAliasShare * all[i].fit.explained || frequency(j) > kSlowerAlias * frequency(i))
      return false;
    for (int k = 2; k <= all[i].fit.harmonics; ++k) {
      const double f = k / all[i].period;
      if (f > kNyquist && std::abs(Folded(f) - 1 / all[j].period) < kSameLine / span) return true;
    }
    return false;
  };
  const auto plain = [&](std::size_t i) {
    for (std::size_t j = 0; j < all.size(); ++j)
      if (j != i && is_alias_of(i, j)) return false;
    return true;
  };
  std::size_t best = 0;
  while (best + 1 < all.size() && !plain(best)) ++best;
  std::size_t taken = best;
  for (std::size_t i = best + 1; i < all.size(); ++i) {
    if (all[i].period >= all[taken].period || !plain(i)) continue;
    const Paired worse = Compare(all[i].fit.error, all[best].fit.error, total);
    if (worse.mean < kAsGood || worse.mean < kSignificant * worse.error) taken = i;
  }
  return taken;
}

// A multiple of the period, where the spectrum has lines that only the multiple explains. (Blades that are nearly alike
// differ by less than a fit with all of the multiple's harmonics loses to noise.)
double WithItsLines(const HarmonicFit& fit, double period, int harmonics, double max_period, double total) {
  for (int round = 0; round < kMostMultiples; ++round) {
    const Spectrum rest = SpectrumOf(fit.Rest(period, harmonics), fit.time(), total);
    int factor = 1;
    double most = 0;
    for (const int m : {2, 3}) {
      if (m * period > max_period) continue;
      int lines = 0;
      double evidence = 0, first = 0;
      for (int h = 1; h <= kLinesOfMultiple * m; ++h) {
        if (h % m == 0) continue;
        const double f = h / (m * period);
        // Too near to frequency 0, or to a line that the period has as well: there are no neighbours to stand out from.
        if (Folded(f) * fit.span() < kGround) continue;
        const double e = LineEvidence(rest, f, fit.span());
        evidence += std::min(e, kMostEvidence);
        if (e > kLine) ++lines;
        if (h < m) first = std::max(first, e);
      }
      if ((lines >= kFewestLines || first > kFirstLine) && evidence > most) {
        factor = m;
        most = evidence;
      }
    }
    if (factor == 1) return period;
    period *= factor;
    harmonics = std::min(harmonics * factor, kMaxHarmonics);
  }
  return period;
}

}  // namespace

// What the period explains of the camera's movement.
double CameraShare(const Signals& s, const MatrixXd& camera, double period) {
  if (camera.cols() == 0) return 0;
  Signals own;
  own.time = s.time;
  own.nuisance = MatrixXd::Constant(camera.rows(), 1, 1 / std::sqrt(static_cast<double>(camera.rows())));
  own.values = camera.leftCols(std::min<Eigen::Index>(camera.cols(), kCameraAxes));
  own.values.rowwise() -= own.values.colwise().mean().eval();
  const HarmonicFit fit(own);
  if (!(own.values.squaredNorm() > 0)) return 0;
  return std::max(0.0, fit.CrossValidate(period, kFirstHarmonics).explained);
}

std::vector<Refined> CandidatePeriods(const HarmonicFit& fit, const Signals& s, const MatrixXd& camera,
                                      const PeriodOptions& options, double max_period) {
  std::vector<double> periods;
  for (const double f : LikelyFundamentals(SpectrumOf(s), fit.span(), options.min_period, max_period))
    periods.push_back(1 / f);
  const std::size_t own = periods.size();
  for (std::size_t i = 0; i < own; ++i)
    for (const double ratio : {0.25, 1.0 / 3, 0.5, 2.0, 3.0, 4.0})
      if (const double p = ratio * periods[i]; p >= options.min_period && p <= max_period) periods.push_back(p);
  CheckInterrupted();
  std::vector<Refined> all = Judge(fit, periods, options.min_period, max_period, MostHarmonics(s));
  if (all.empty() || camera.cols() == 0) return all;
  // A period of the camera's own movement is not the scene's, where another candidate is.
  std::vector<Refined> scene;
  for (const Refined& r : all)
    if (CameraShare(s, camera, r.period) < kCamerasOwn) scene.push_back(r);
  if (!scene.empty() && scene[0].fit.explained > std::max(options.min_explained, kScenesOwn * all[0].fit.explained))
    return scene;
  return all;
}

std::optional<Refined> TakePeriod(const HarmonicFit& fit, const Signals& s, const std::vector<Refined>& all,
                                  const PeriodOptions& options, double max_period) {
  const double total = s.values.squaredNorm();
  if (all.empty() ||
      !(all[0].fit.explained >= std::max(options.min_explained, kChance / static_cast<double>(s.time.size()))))
    return std::nullopt;
  const Refined taken = all[Fundamental(all, total, fit.span())];
  const double longer = WithItsLines(fit, taken.period, std::max(1, taken.fit.harmonics), max_period, total);
  if (!(longer > kMuchLonger * taken.period)) return taken;
  const int most = MostHarmonics(s);
  const int harmonics =
      std::min(most, std::max(2, static_cast<int>(std::lround(taken.fit.harmonics * longer / taken.period))));
  const double refined = fit.Refine(longer, std::min(harmonics, kScreenHarmonics), 2 * kReach);
  const Refined whole{refined, fit.CrossValidate(refined, most)};
  const double least = s.modulation.cols() > 0 ? kAsGoodMoving : kNearlyAsGood;
  return whole.fit.explained > least * taken.fit.explained ? whole : taken;
}

}  // namespace lumi
