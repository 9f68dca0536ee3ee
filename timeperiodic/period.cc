#include "timeperiodic/period.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "timeperiodic/harmonic_fit.h"
#include "timeperiodic/least_squares.h"
#include "timeperiodic/spectrum.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A multiple that predicts so much more of cycles the fit has not seen is not dismissed without a word.
constexpr double kClearlyBetter = 1.2;
// A moving camera's parallax is most of what is left over (a fifth is explained where the period is right to a ten-thousandth); less than
// this was seen with wrong periods.
constexpr double kWeak = 0.15;
constexpr double kMinCycles = 2.2;  // for fits that are validated on other cycles
constexpr int kMaxHarmonics = 32;
constexpr int kScreenHarmonics = 6;    // with these candidates are ranked
constexpr std::size_t kClosely = 10;   // candidates that are cross-validated
constexpr double kAsGood = 0.002;      // share of the variance: a longer period that predicts no more than this better is a multiple
constexpr double kSignificant = 3;     // standard errors
constexpr double kAliasShare = 0.6;    // of what an alias explains: what it folds back to explains at least this
constexpr int kMaxModulated = 12;      // harmonics, where each is multiplied by the camera's place too
constexpr double kNearlyAsGood = 0.8;  // of what the taken period explains: worth telling
constexpr double kResolved = 4;        // frames: from here on motion between frames is less than a quarter turn
constexpr double kLine = 8;            // standard deviations that a line of the spectrum must stand out by to be one
constexpr double kFirstLine = 6;       // the same, of a fundamental by itself
constexpr double kChance = 14;         // over the frames' number: share that the best of many periods may predict by chance
constexpr Eigen::Index kTrend = 3;     // half waves over the video: slower than a period that is filmed twice
constexpr double kSlip = 0.6;          // frames that a lead must jump by
constexpr double kCameraShare = 0.8;   // of the camera's movement explained by the scene's period: commensurate

struct Refined {
  double period = 0;
  CrossValidation fit;
};

// Mean difference of squared errors and its standard error, from blocks of frames that err together.
struct Paired {
  double mean = 0, error = 0;
};
Paired Compare(const VectorXd& a, const VectorXd& b, double total) {
  const Eigen::Index blocks = std::clamp<Eigen::Index>(a.size() / 8, 4, 24);
  VectorXd d(blocks);
  for (Eigen::Index k = 0; k < blocks; ++k) {
    const Eigen::Index begin = k * a.size() / blocks, end = (k + 1) * a.size() / blocks;
    d[k] = (a.segment(begin, end - begin).sum() - b.segment(begin, end - begin).sum()) / total * static_cast<double>(blocks);
  }
  Paired p;
  p.mean = d.mean();
  p.error = std::sqrt((d.array() - p.mean).square().sum() / static_cast<double>(blocks - 1) / static_cast<double>(blocks));
  return p;
}

// Correlation of the signals with themselves, shifted by whole frames.
std::vector<double> SelfSimilarity(const Signals& s, Eigen::Index max_shift) {
  // Rows by time: frames that are missing are 0 in both.
  const double begin = s.time.minCoeff();
  const auto n = static_cast<Eigen::Index>(std::lround(s.time.maxCoeff() - begin)) + 1;
  MatrixXd v = MatrixXd::Zero(n, s.values.cols());
  VectorXd norm = VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < s.time.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(std::lround(s.time[i] - begin));
    v.row(at) = s.values.row(i);
    norm[at] = s.values.row(i).squaredNorm();
  }
  const VectorXd seen = (norm.array() > 0).cast<double>();
  std::vector<double> rho(static_cast<std::size_t>(std::min(max_shift, n - 1) + 1), 0);
  ParallelFor(rho.size(), 4, [&](std::size_t from, std::size_t to) {
    for (std::size_t j = from; j < to; ++j) {
      const auto k = static_cast<Eigen::Index>(j), m = n - k;
      const double product = (v.topRows(m).array() * v.bottomRows(m).array()).sum();
      const double a = norm.head(m).dot(seen.tail(m)), b = norm.tail(m).dot(seen.head(m));
      rho[j] = a + b > 0 ? 2 * product / (a + b) : 0;  // 1 - mean squared difference / mean energy
    }
  });
  return rho;
}

// The shift at the top of a parabola through three values, from the middle.
double Vertex(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

struct Shifted {
  double period = 0, correlation = 0;
};
// The shortest shift at which the video is as like itself as at any, after it has first become unlike.
std::optional<Shifted> ByShift(const std::vector<double>& rho, std::size_t frames) {
  const std::size_t overlap = std::max<std::size_t>(4, frames / 6);
  if (frames < 8 + overlap) return std::nullopt;
  const std::size_t last = std::min(rho.size() - 1, frames - overlap);
  std::size_t first = 1;
  while (first < last && rho[first + 1] < rho[first]) ++first;
  double best = -1;
  std::vector<std::size_t> peaks;
  for (std::size_t k = first + 1; k < last; ++k)
    if (rho[k] >= rho[k - 1] && rho[k] > rho[k + 1]) {
      peaks.push_back(k);
      best = std::max(best, rho[k]);
    }
  for (const std::size_t k : peaks) {
    if (rho[k] < best - 0.1) continue;
    // It is seen to end as well: likeness that grows up to the last shift is no return yet.
    if (*std::min_element(rho.begin() + static_cast<std::ptrdiff_t>(k), rho.begin() + static_cast<std::ptrdiff_t>(last) + 1) >
        rho[k] - 0.05)
      continue;
    return Shifted{static_cast<double>(k) + Vertex(rho[k - 1], rho[k], rho[k + 1]), rho[k]};
  }
  return std::nullopt;
}

Signals Rows(const Signals& s, const std::vector<Eigen::Index>& rows) {
  Signals part = s;
  part.values = s.values(rows, Eigen::all);
  part.time = s.time(rows);
  part.nuisance = s.nuisance(rows, Eigen::all);
  if (s.modulation.cols() > 0) part.modulation = s.modulation(rows, Eigen::all);
  return part;
}

// Less than two periods filmed. The error: how far the answer moves as parts of the video are left out.
std::optional<PeriodEstimate> FromFewCycles(const Signals& s, const std::vector<double>& rho) {
  const auto n = static_cast<std::size_t>(s.time.size());
  const auto found = ByShift(rho, n);
  if (!found || found->correlation < 0.5) return std::nullopt;
  const double lowest = *std::min_element(
      rho.begin(), rho.begin() + static_cast<std::ptrdiff_t>(std::min(rho.size(), static_cast<std::size_t>(found->period) + 1)));
  if (found->correlation - lowest < 0.3) return std::nullopt;
  PeriodEstimate e;
  e.few_cycles = true;
  e.period_frames = found->period;
  e.explained = found->correlation;
  const auto pairs = static_cast<Eigen::Index>(n) - static_cast<Eigen::Index>(std::lround(found->period));
  const Eigen::Index blocks = std::clamp<Eigen::Index>(pairs / 2, 2, 6);
  std::vector<double> left_out;
  for (Eigen::Index b = 0; b < blocks; ++b) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(n); ++i)
      if (i < b * pairs / blocks || i >= (b + 1) * pairs / blocks) rows.push_back(i);
    const Signals part = Rows(s, rows);
    const auto r = SelfSimilarity(part, static_cast<Eigen::Index>(rho.size()));
    const auto k = static_cast<std::size_t>(std::lround(found->period));
    std::size_t top = k;
    for (const std::size_t j : {k - 1, k + 1})
      if (j + 1 < r.size() && r[j] > r[top]) top = j;
    if (top + 1 < r.size()) left_out.push_back(static_cast<double>(top) + Vertex(r[top - 1], r[top], r[top + 1]));
  }
  double mean = 0, square = 0;
  for (const double p : left_out) mean += p / static_cast<double>(left_out.size());
  for (const double p : left_out) square += (p - mean) * (p - mean);
  const auto m = static_cast<double>(left_out.size());
  e.sigma_frames = std::max(0.2, std::sqrt((m - 1) / m * square));  // jackknife; a frame's own width is the floor
  return e;
}

// What the period explains of the camera's movement.
double CameraShare(const Signals& s, const MatrixXd& camera, double period) {
  if (camera.cols() == 0) return 0;
  Signals own;
  own.time = s.time;
  own.nuisance = MatrixXd::Constant(camera.rows(), 1, 1 / std::sqrt(static_cast<double>(camera.rows())));
  own.values = camera.leftCols(std::min<Eigen::Index>(camera.cols(), 3));
  own.values.rowwise() -= own.values.colwise().mean().eval();
  const HarmonicFit fit(own);
  if (!(own.values.squaredNorm() > 0)) return 0;
  return std::max(0.0, fit.CrossValidate(period, 3).explained);
}

std::vector<double> Aliases(double period) {
  // 1 / T + k and k - 1 / T for k = 1: all others are shorter still.
  std::vector<double> all{1 / (1 + 1 / period)};
  if (period > 1) all.push_back(1 / (1 - 1 / period));
  std::erase_if(all, [&](double p) { return std::abs(p - period) < 1e-9; });
  return all;
}

// Frames that lead the fit by whole frames from some frame on. Leads are compared before and after each frame.
std::vector<std::pair<Eigen::Index, int>> FindSlips(const HarmonicFit& fit, double period, int harmonics) {
  const auto offsets = fit.FrameOffsets(period, harmonics);
  const Eigen::Index n = offsets.lead.size();
  const Eigen::Index window = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(0.35 * period), 10, 60);
  if (n < 4 * window) return {};
  const auto weighted = [&](Eigen::Index begin, Eigen::Index end) {
    std::vector<std::pair<double, double>> v;
    double sum = 0;
    for (Eigen::Index i = begin; i < end; ++i) v.emplace_back(offsets.lead[i], offsets.weight[i]), sum += offsets.weight[i];
    std::sort(v.begin(), v.end());
    double half = 0;
    for (const auto& [lead, weight] : v)
      if ((half += weight) >= 0.5 * sum) return lead;
    return 0.0;
  };
  VectorXd jump = VectorXd::Zero(n);
  for (Eigen::Index i = window; i + window <= n; ++i) jump[i] = weighted(i, i + window) - weighted(i - window, i);
  // What jumps as far elsewhere is noise.
  std::vector<double> size;
  for (Eigen::Index i = window; i + window <= n; ++i) size.push_back(std::abs(jump[i]));
  std::nth_element(size.begin(), size.begin() + static_cast<std::ptrdiff_t>(size.size() / 2), size.end());
  const double usual = size[size.size() / 2];
  std::vector<std::pair<Eigen::Index, int>> slips;
  Eigen::Index at = 0;
  const double most = jump.cwiseAbs().maxCoeff(&at);
  if (most > std::max(kSlip, 5 * usual) && std::lround(jump[at]) != 0) {
    // The plateau's middle.
    Eigen::Index first = at, last = at;
    while (first > window && jump[first - 1] * jump[at] > 0 && std::abs(jump[first - 1]) > 0.9 * most) --first;
    while (last + 1 + window <= n && jump[last + 1] * jump[at] > 0 && std::abs(jump[last + 1]) > 0.9 * most) ++last;
    slips.emplace_back((first + last) / 2, static_cast<int>(std::lround(jump[at])));
  }
  return slips;
}

// What is slower than any period that two cycles show - a codec that settles, light that fades - explained away: harmonics
// of short periods fold back to there.
Signals WithoutTrend(const Signals& s) {
  const double begin = s.time.minCoeff(), span = s.time.maxCoeff() - begin;
  if (!(span > 0)) return s;
  MatrixXd all(s.nuisance.rows(), s.nuisance.cols() + kTrend);
  all.leftCols(s.nuisance.cols()) = s.nuisance;
  for (Eigen::Index k = 0; k < kTrend; ++k)
    all.col(s.nuisance.cols() + k) = ((s.time.array() - begin) * (3.141592653589793 * static_cast<double>(k + 1) / span)).cos();
  Signals out = s;
  out.nuisance = OrthonormalSpan(all);
  out.values -= out.nuisance * (out.nuisance.transpose() * out.values);
  return out;
}

std::string RelationOf(double period, double taken) {
  const struct {
    double ratio;
    const char* name;
  } kKnown[] = {{1, "taken"}, {0.5, "half"}, {1.0 / 3, "third"}, {0.25, "quarter"}, {2, "double"}, {3, "triple"}, {4, "quadruple"}};
  for (const auto& k : kKnown)
    if (std::abs(period / taken / k.ratio - 1) < 0.01) return k.name;
  return "other";
}

// Candidates refined and cross-validated, best first.
std::vector<Refined> Judge(const HarmonicFit& fit, std::vector<double> periods, double min_period, double max_period, int most) {
  std::vector<std::pair<double, double>> ranked(periods.size());
  ParallelFor(periods.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double p = fit.Refine(periods[i], 3, 0.3);
      ranked[i] = {-fit.Explained(p, kScreenHarmonics), p};
    }
  });
  std::sort(ranked.begin(), ranked.end());
  std::vector<Refined> all;
  for (const auto& [value, p] : ranked) {
    if (p < min_period || p > max_period) continue;
    const bool known =
        std::any_of(all.begin(), all.end(), [&](const Refined& r) { return std::abs(1 / r.period - 1 / p) < 0.3 / fit.span(); });
    if (known) continue;
    all.push_back({p, {}});
    if (all.size() == kClosely) break;
  }
  ParallelFor(all.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      all[i].fit = fit.CrossValidate(all[i].period, most);
      all[i].period = fit.Refine(all[i].period, std::max(1, all[i].fit.harmonics), 0.1);
      all[i].fit = fit.CrossValidate(all[i].period, most);
    }
  });
  std::sort(all.begin(), all.end(), [](const Refined& a, const Refined& b) { return a.fit.explained > b.fit.explained; });
  return all;
}

// The shortest that predicts as well as the best.
std::size_t Fundamental(const std::vector<Refined>& all, double total, double span) {
  // A short period with many harmonics folds back onto those of a long one with few: the highest frequency tells them apart.
  const auto frequency = [&](std::size_t i) { return all[i].fit.essential / all[i].period; };
  const auto is_alias_of = [&](std::size_t i, std::size_t j) {
    if (all[j].fit.explained < kAliasShare * all[i].fit.explained || frequency(j) > 0.5 * frequency(i)) return false;
    for (int k = 2; k <= all[i].fit.harmonics; ++k) {
      const double f = k / all[i].period, folded = std::abs(f - std::round(f));
      if (f > 0.5 && std::abs(folded - 1 / all[j].period) < 0.7 / span) return true;
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

// A multiple, where lines of the spectrum say so that the period does not have: blades that are nearly alike differ by
// less than a fit with all of the multiple's harmonics loses to noise.
double WithItsLines(const HarmonicFit& fit, double period, int harmonics, double max_period, double total) {
  for (int round = 0; round < 3; ++round) {
    const Spectrum rest = SpectrumOf(fit.Rest(period, harmonics), fit.time(), total);
    int factor = 1;
    double most = 0;
    for (const int m : {2, 3}) {
      if (m * period > max_period) continue;
      int lines = 0;
      double evidence = 0, first = 0;
      for (int h = 1; h <= 4 * m; ++h) {
        if (h % m == 0) continue;
        const double f = h / (m * period), folded = std::abs(f - std::round(f));
        // Too near to nothing, or to a line that is there anyway: no ground to stand out of.
        if (folded * fit.span() < 2) continue;
        const double e = LineEvidence(rest, f, fit.span());
        evidence += std::min(e, 50.0);
        if (e > kLine) ++lines;
        if (h < m) first = std::max(first, e);
      }
      if ((lines >= 3 || first > kFirstLine) && evidence > most) {
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

// Leads of parts of the video against their time: a polynomial, weighted by what each part says.
PolynomialFit LeadOverTime(const HarmonicFit& fit, double period, int harmonics, int degree) {
  const auto offsets = fit.FrameOffsets(period, harmonics);
  const Eigen::Index n = offsets.lead.size();
  const double cycles = fit.span() / period;
  const Eigen::Index parts = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(2 * cycles), 6, 40);
  std::vector<double> t, lead, weight;
  for (Eigen::Index k = 0; k < parts; ++k) {
    const Eigen::Index begin = k * n / parts, end = (k + 1) * n / parts;
    const VectorXd w = offsets.weight.segment(begin, end - begin);
    if (!(w.sum() > 0)) continue;
    // Time from the video's middle in units of its length: powers stay apart.
    t.push_back((fit.time().segment(begin, end - begin).dot(w) / w.sum() - fit.time().mean()) / fit.span());
    lead.push_back(offsets.lead.segment(begin, end - begin).dot(w) / w.sum());
    weight.push_back(w.sum());
  }
  const auto map = [](const std::vector<double>& v) { return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())); };
  return FitPolynomial(map(t), map(lead), map(weight), degree);
}

}  // namespace

std::optional<std::string> Validate(const PeriodOptions& o) {
  if (!(o.min_period >= 2)) return "the shortest period must be at least 2 frames: shorter ones cannot be told from longer ones";
  if (o.max_period != 0 && !(o.max_period > o.min_period)) return "the longest period must exceed the shortest";
  if (!(o.min_explained >= 0 && o.min_explained < 1)) return "the least explained share must be from 0 to below 1";
  return std::nullopt;
}

void RequireResolved(double period) {
  if (!(period >= 2))
    throw DataError(fmt::format("a period of {:.4g} frames is aliased: below 2 frames it looks like {:.4g} frames", period,
                                1 / std::abs(1 / period - std::round(1 / period))),
                    "film at a higher frame rate");
}

PeriodEstimate CountedPeriod(int a, int b, int periods) {
  if (periods < 1) throw UsageError("--count must be at least 1");
  if (a < 0 || b < 0 || a == b) throw UsageError("--frames takes two different frame numbers, from 0");
  PeriodEstimate e;
  e.period_frames = std::abs(b - a) / static_cast<double>(periods);
  // Either frame is the best of its neighbours: uniform within half a frame.
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
  if (n < 8) throw DataError(fmt::format("{} frames are too few for a period", n), "film several periods");
  const Signals s = WithoutTrend(given);
  const double total = s.values.squaredNorm();
  if (!(total > 0)) throw nothing;
  const bool modulated = s.modulation.cols() > 0;
  const int most = modulated ? kMaxModulated : kMaxHarmonics;
  HarmonicFit fit(s, modulated);
  const std::vector<double> rho = SelfSimilarity(given, std::min<Eigen::Index>(n - 1, 4000));

  double max_period = fit.span() / kMinCycles;
  if (options.max_period > 0) max_period = std::min(max_period, options.max_period);
  PeriodEstimate e;
  std::optional<Refined> taken;
  std::vector<Refined> all;
  const Spectrum spectrum = SpectrumOf(s);
  if (max_period > options.min_period * 1.01) {
    std::vector<double> periods;
    for (const double f : LikelyFundamentals(spectrum, fit.span(), options.min_period, max_period)) periods.push_back(1 / f);
    const std::size_t own = periods.size();
    for (std::size_t i = 0; i < own; ++i)
      for (const double ratio : {0.25, 1.0 / 3, 0.5, 2.0, 3.0, 4.0})
        if (const double p = ratio * periods[i]; p >= options.min_period && p <= max_period) periods.push_back(p);
    CheckInterrupted();
    all = Judge(fit, periods, options.min_period, max_period, most);
    if (!all.empty() && camera.cols() > 0) {
      // What the camera does itself is no period of the scene, where another one is there.
      std::vector<Refined> scene;
      for (const Refined& r : all)
        if (CameraShare(s, camera, r.period) < 0.5) scene.push_back(r);
      if (!scene.empty() && scene[0].fit.explained > std::max(options.min_explained, 0.3 * all[0].fit.explained)) all = scene;
    }
    if (!all.empty() && all[0].fit.explained >= std::max(options.min_explained, kChance / static_cast<double>(n))) {
      taken = all[Fundamental(all, total, fit.span())];
      const double longer = WithItsLines(fit, taken->period, std::max(1, taken->fit.harmonics), max_period, total);
      if (longer > 1.5 * taken->period) {
        const int harmonics = std::min(most, std::max(2, static_cast<int>(std::lround(taken->fit.harmonics * longer / taken->period))));
        const double refined = fit.Refine(longer, std::min(harmonics, 6), 0.2);
        const Refined whole{refined, fit.CrossValidate(refined, most)};
        if (whole.fit.explained > kNearlyAsGood * taken->fit.explained) taken = whole;
      }
    }
  }

  // Too few cycles for that, or one that is much better by itself than what repeats faster within it.
  // (A moving camera that comes back to where it was looks the same to a shift.)
  std::optional<PeriodEstimate> few;
  if (!taken || camera.cols() == 0) few = FromFewCycles(given, rho);
  if (few && options.max_period > 0 && few->period_frames > options.max_period) few.reset();
  if (few && few->period_frames < options.min_period) few.reset();
  if (taken && few) {
    double own = -1;
    for (double p = taken->period; p < max_period * 1.05; p += taken->period)
      if (const auto k = static_cast<std::size_t>(std::lround(p)); k < rho.size()) own = std::max(own, rho[k]);
    if (few->period_frames > max_period && few->explained > std::max(own, taken->fit.explained * total / given.values.squaredNorm()) + 0.15)
      taken.reset();
    else
      few.reset();
  }
  if (!taken && !few) throw nothing;

  if (few) {
    e = *few;
    e.candidates.push_back({e.period_frames, "taken", e.explained, 0});
    for (const double ratio : {0.5, 2.0})
      if (const auto k = static_cast<std::size_t>(std::lround(ratio * e.period_frames));
          k < rho.size() && static_cast<double>(k) < fit.span() - 3)
        e.candidates.push_back({static_cast<double>(k), ratio < 1 ? "half" : "double", rho[k], 0});
    e.warnings.push_back(fmt::format("only {:.1f} periods were filmed: the period is known to about {:.1f} frames",
                                     fit.span() / e.period_frames, e.sigma_frames));
  } else {
    // Dropped and doubled frames first, one after the other: each shifts all that follow.
    VectorXd time = s.time;
    double period = taken->period;
    int harmonics = std::max(1, taken->fit.harmonics);
    for (int round = 0; round < 20; ++round) {
      const auto slips = FindSlips(fit, period, std::min(harmonics, 3));
      if (slips.empty()) break;
      const double before = fit.CrossValidate(period, harmonics, harmonics).explained;
      const VectorXd old = time;
      const auto [at, frames] = slips[0];
      for (Eigen::Index i = at; i < n; ++i) time[i] += frames;
      fit.SetTime(time);
      const double p = fit.Refine(period, std::min(harmonics, 3), 0.5 * std::abs(frames) / period + 0.1);
      if (fit.CrossValidate(p, harmonics, harmonics).explained < before + 0.0005) {
        fit.SetTime(time = old);
        break;
      }
      period = p;
      e.slips.push_back({s.frame[static_cast<std::size_t>(at)], frames});
    }
    std::sort(e.slips.begin(), e.slips.end(), [](const Slip& a, const Slip& b) { return a.frame < b.frame; });

    // A drift bends the phase; straightened a little at a time, with few harmonics first: many see but a short way.
    const VectorXd slipped = time;
    VectorXd bend = VectorXd::Zero(n);
    PolynomialFit lead;
    const bool can_bend = fit.span() / period >= 3;
    double c = 0;
    for (int round = 0; can_bend && round < 6; ++round) {
      const int h = round < 2 ? std::min(harmonics, 2) : harmonics;
      lead = LeadOverTime(fit, period, h, 2);
      c += lead.coefficient[2];
      const VectorXd u = (slipped.array() - slipped.mean()) / fit.span();
      bend = c * u.array().square();
      fit.SetTime(slipped + bend);
      period = fit.Refine(period, h, 0.15);
      if (round >= 2 && std::abs(lead.coefficient[2]) < 1e-3) break;
    }
    if (can_bend) {
      lead = LeadOverTime(fit, period, harmonics, 2);
      // Lead c u^2, u from -1/2 to 1/2 over the span: the phase runs faster by 2 c u / span.
      e.drift_percent = -200 * c / fit.span();
      e.drift_sigma_percent = 200 * lead.sigma[2] / fit.span();
      e.drifts = std::abs(e.drift_percent) > std::max(0.02, 4 * e.drift_sigma_percent) && std::abs(c) > 0.05;
    }
    if (!e.drifts) {
      fit.SetTime(slipped);
      period = fit.Refine(period, harmonics, 0.1);
    }
    const CrossValidation final_fit = fit.CrossValidate(period, most);
    if (final_fit.explained > 0) harmonics = final_fit.harmonics;
    period = std::max(options.min_period, fit.Refine(period, harmonics, 0.1));  // at 2 frames the fit is flat, and wanders below
    lead = LeadOverTime(fit, period, harmonics, 1);
    e.period_frames = period;
    e.sigma_frames = period * lead.sigma[1] / fit.span();
    e.explained = std::max(final_fit.explained, taken->fit.explained);
    e.harmonics = harmonics;

    e.candidates.push_back({period, "taken", e.explained, harmonics});
    std::vector<double> shown{1.0 / 3, 0.5, 2.0, 3.0};
    for (const double ratio : shown) {
      const double p = ratio * period;
      if (p < options.min_period || p > max_period) continue;
      const CrossValidation cv = fit.CrossValidate(p, most);
      e.candidates.push_back({p, RelationOf(p, period), cv.explained, cv.harmonics});
    }
    for (const Refined& r : all)
      if (RelationOf(r.period, taken->period) == "other" && e.candidates.size() < 9)
        e.candidates.push_back({r.period, "other", r.fit.explained, r.fit.harmonics});
    for (const PeriodCandidate& k : e.candidates) {
      if ((k.relation == "half" || k.relation == "third") && k.explained > kNearlyAsGood * e.explained) {
        e.ambiguous = true;
        e.warnings.push_back(
            fmt::format("a {} of it ({:.4g} frames) explains {:.0f} % of what it does: like blades of a rotor; where they are alike "
                        "to you, take that",
                        k.relation, k.period_frames, 100 * k.explained / e.explained));
      }
    }
    for (const PeriodCandidate& k : e.candidates) {
      if ((k.relation == "double" || k.relation == "triple") && k.explained > kClearlyBetter * e.explained) {
        e.ambiguous = true;
        e.warnings.push_back(fmt::format("{} times it ({:.4g} frames) explains more, but too few of them were filmed to be sure: film longer, or say the period",
                                         k.relation == "double" ? "two" : "three", k.period_frames));
      }
    }
    if (e.explained < kWeak)
      e.warnings.push_back(fmt::format("only {:.0f} % of what moves repeats with it: the period may be wrong; a video from a tripod tells it best (lumi-timeperiodic calibrate --fixed-video)",
                                       100 * std::max(0.0, e.explained)));
    if (e.drifts)
      e.warnings.push_back(fmt::format("the period drifts by {:+.2f} % (+-{:.2f}) from the beginning to the end; {:.6g} frames is its mean",
                                       e.drift_percent, e.drift_sigma_percent, e.period_frames));
    for (const Slip& slip : e.slips)
      e.warnings.push_back(
          slip.frames > 0
              ? fmt::format("{} frame{} dropped before frame {}", slip.frames, slip.frames > 1 ? "s were" : " was", slip.frame)
              : fmt::format("{} frame{} doubled before frame {}", -slip.frames, slip.frames < -1 ? "s were" : " was", slip.frame));
  }
  e.cycles = fit.span() / e.period_frames;
  if (e.period_frames < kResolved) {
    e.aliases_frames = Aliases(e.period_frames);
    std::string periods;
    for (const double p : e.aliases_frames) periods += fmt::format("{}{:.4g}", periods.empty() ? "" : " or ", p);
    e.warnings.push_back(fmt::format(
        "the scene moves by more than a quarter of its period between frames: it may be aliased, a period of {} frames looks the "
        "same; film at a higher frame rate to tell",
        periods));
  }
  // With it, or every few of it: what a camera in step explains may have hidden the whole period of the scene.
  int in_step = 1;
  for (int k = 1; k <= 4 && k * e.period_frames < fit.span(); ++k)
    if (const double share = CameraShare(s, camera, k * e.period_frames); share > e.camera_share + 0.1) e.camera_share = share, in_step = k;
  if (e.camera_share > kCameraShare)
    e.warnings.push_back(fmt::format(
        "the camera's own movement repeats every {}period{} ({:.0f} % of it): what the scene does and what the camera does cannot be "
        "told apart; wave the camera faster or slower",
        in_step > 1 ? fmt::format("{} ", in_step) : "", in_step > 1 ? "s" : "", 100 * e.camera_share));
  const auto shown = std::min<std::size_t>(rho.size(), static_cast<std::size_t>(4.2 * e.period_frames) + 8);
  for (std::size_t k = 0; k < shown; ++k) e.similarity.emplace_back(static_cast<double>(k), rho[k]);
  for (int i = 0; i <= 600; ++i) {
    const double p = std::max(2.0, e.period_frames / 5) *
                     std::pow(std::min(max_period, 5 * e.period_frames) / std::max(2.0, e.period_frames / 5), i / 600.0);
    if (p > 0 && std::isfinite(p)) e.periodogram.emplace_back(p, fit.Explained(p, 4));
  }
  return e;
}

}  // namespace lumi
