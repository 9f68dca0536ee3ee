#include "timeperiodic/period_few_cycles.h"

#include <algorithm>
#include <cmath>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kFewestFrames = 8;   // shifts that are tried at least
constexpr std::size_t kLeastOverlap = 4;   // frames that two copies of the video still share at the longest shift ...
constexpr std::size_t kOverlapPart = 6;    // ... or this part of it: fewer are alike by chance
constexpr double kAsAlike = 0.1;           // correlations nearer than this are equal: the shorter shift counts
constexpr double kFalls = 0.05;            // that the correlation has to fall again after its peak
constexpr double kLeastCorrelation = 0.5;  // of the peak: below, noise and slow changes reach it
constexpr double kLeastRise = 0.3;         // of the peak over the least likeness before it: else all frames are alike
constexpr Eigen::Index kMostLeftOut = 6;   // that are left out in turn
constexpr double kFollows = 1.75;          // frames: steps beyond that lack a frame
constexpr double kNear = 0.5;              // frames: what a frame beside a gap stands for
constexpr double kLeastSigma = 0.2;        // frames: the answer is no better than the frame's own width

// The shift at the top of a parabola through three values, from the middle.
double Vertex(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

struct Shifted {
  double period = 0, correlation = 0;
};
// The shortest shift at which the video resembles itself as well as at any shift, after it has first become unlike.
std::optional<Shifted> ByShift(const std::vector<double>& rho, std::size_t frames) {
  const std::size_t overlap = std::max<std::size_t>(kLeastOverlap, frames / kOverlapPart);
  if (frames < kFewestFrames + overlap) return std::nullopt;
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
    if (rho[k] < best - kAsAlike) continue;
    // The correlation must fall again after the peak: one that grows up to the last shift is no return yet.
    if (*std::min_element(rho.begin() + static_cast<std::ptrdiff_t>(k),
                          rho.begin() + static_cast<std::ptrdiff_t>(last) + 1) > rho[k] - kFalls)
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

// The signals at whole frames after the first: between two frames that follow each other by a straight line, 0 where
// frames are missing. Rows are by time.
MatrixXd AtWholeFrames(const Signals& s) {
  const double begin = s.time.minCoeff();
  const auto n = static_cast<Eigen::Index>(std::lround(s.time.maxCoeff() - begin)) + 1;
  MatrixXd v = MatrixXd::Zero(n, s.values.cols());
  Eigen::Index i = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = static_cast<double>(k);
    while (i + 1 < s.time.size() && s.time[i + 1] - begin <= at) ++i;
    const double after = at - (s.time[i] - begin);
    const bool last = i + 1 == s.time.size();
    const double step = last ? 0 : s.time[i + 1] - s.time[i];
    if (!last && step <= kFollows)
      v.row(k) = (1 - after / step) * s.values.row(i) + after / step * s.values.row(i + 1);
    else if (after <= kNear)
      v.row(k) = s.values.row(i);
    else if (!last && step - after < kNear)
      v.row(k) = s.values.row(i + 1);
  }
  return v;
}

}  // namespace

std::vector<double> SelfSimilarity(const Signals& s, Eigen::Index max_shift) {
  const MatrixXd v = AtWholeFrames(s);
  const Eigen::Index n = v.rows();
  const VectorXd norm = v.rowwise().squaredNorm();
  const VectorXd seen = (norm.array() > 0).cast<double>();
  std::vector<double> rho(static_cast<std::size_t>(std::min(max_shift, n - 1) + 1), 0);
  ParallelEach(rho.size(), 4, [&](std::size_t j) {
    const auto k = static_cast<Eigen::Index>(j), m = n - k;
    const double product = (v.topRows(m).array() * v.bottomRows(m).array()).sum();
    const double a = norm.head(m).dot(seen.tail(m)), b = norm.tail(m).dot(seen.head(m));
    rho[j] = a + b > 0 ? 2 * product / (a + b) : 0;  // 1 - mean squared difference / mean energy
  });
  return rho;
}

namespace {

// The standard deviation of a period that is the mean of the frames' own periods. For each frame there is a shift at
// which a later frame resembles it most; the curvature of the difference there tells how sharply. These periods
// disagree where times are uneven or the motion slows down.
double Disagreement(const MatrixXd& v, double period) {
  constexpr Eigen::Index kReach = 3;  // frames to both sides: as far as a top belongs to this period
  const auto middle = static_cast<Eigen::Index>(std::lround(period));
  struct Own {
    double shift, weight;
  };
  std::vector<Own> own;
  const auto missing = [&](Eigen::Index i) { return v.row(i).squaredNorm() == 0; };
  for (Eigen::Index i = 0; i + middle + 1 < v.rows(); ++i) {
    if (missing(i)) continue;
    const auto difference = [&](Eigen::Index k) { return (v.row(i) - v.row(i + k)).squaredNorm(); };
    const Eigen::Index first = std::max<Eigen::Index>(middle - kReach, 1),
                       last = std::min(middle + kReach, v.rows() - 2 - i);
    Eigen::Index best = first;
    for (Eigen::Index k = first; k <= last; ++k)
      if (difference(k) < difference(best)) best = k;
    if (missing(i + best - 1) || missing(i + best) || missing(i + best + 1)) continue;
    const double before = difference(best - 1), at = difference(best), after = difference(best + 1);
    const double bend = before - 2 * at + after;
    if (at > before || at > after || !(bend > 0)) continue;  // still falling at the end of the reach
    own.push_back({static_cast<double>(best) + Vertex(-before, -at, -after), bend});
  }
  double weight = 0, sum = 0, square = 0;
  for (const Own& o : own) {
    weight += o.weight;
    sum += o.weight * o.shift;
  }
  if (own.size() < 2) return 0;
  for (const Own& o : own) square += std::pow(o.weight * (o.shift - sum / weight), 2);
  return std::sqrt(square) / weight;
}

}  // namespace

std::optional<PeriodEstimate> FromFewCycles(const Signals& s, const std::vector<double>& rho) {
  const auto n = static_cast<std::size_t>(s.time.size());
  const auto found = ByShift(rho, n);
  if (!found || found->correlation < kLeastCorrelation) return std::nullopt;
  const double lowest = *std::min_element(
      rho.begin(),
      rho.begin() + static_cast<std::ptrdiff_t>(std::min(rho.size(), static_cast<std::size_t>(found->period) + 1)));
  if (found->correlation - lowest < kLeastRise) return std::nullopt;
  PeriodEstimate e;
  e.few_cycles = true;
  e.period_frames = found->period;
  e.explained = found->correlation;
  const auto pairs = static_cast<Eigen::Index>(n) - static_cast<Eigen::Index>(std::lround(found->period));
  const Eigen::Index blocks = std::clamp<Eigen::Index>(pairs / 2, 2, kMostLeftOut);
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
  const double jackknife = std::sqrt((m - 1) / m * square);
  e.sigma_frames = std::max({kLeastSigma, jackknife, Disagreement(AtWholeFrames(s), found->period)});
  return e;
}

}  // namespace lumi
