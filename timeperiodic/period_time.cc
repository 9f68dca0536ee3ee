#include "timeperiodic/period_time.h"

#include <algorithm>
#include <cmath>

#include "scene/geometry/median.h"
#include "timeperiodic/least_squares.h"
#include "timeperiodic/spectrum.h"

namespace lumi {
namespace {

using Eigen::VectorXd;

// A slip: leads of a window before and after each frame differ.
constexpr double kSlip = 0.6;         // frames that a lead must jump by ...
constexpr double kUnusual = 5;        // ... and of the usual jump: what jumps as far elsewhere is noise
constexpr double kWindowPart = 0.35;  // of a period: a window sees fast and slow parts of the movement ...
constexpr Eigen::Index kLeastWindow = 10, kMostWindow = 60;  // ... frames
constexpr double kPlateau = 0.9;      // of the largest jump: its neighbours jump as far, the slip is in their middle
constexpr int kMostSlips = 20;        // that are undone, one after the other
constexpr int kSlipHarmonics = 3;     // more of them would explain a slip as movement
constexpr double kSlipGain = 0.0005;  // share of the variance that the fit must gain by it

// A drift: leads over time, a parabola.
constexpr double kCyclesToBend = 3;                // of fewer the drift cannot be told from harmonics
constexpr int kBendRounds = 6, kCoarseRounds = 2;  // the first with kCoarseHarmonics: many see but a short way
constexpr int kCoarseHarmonics = 2;
constexpr double kBendDone = 1e-3;  // frames
constexpr double kMostBent = 0.5;   // cycles over the video: a period that a bend moves farther is another one
constexpr double kLeastDriftPercent = 0.02, kDriftSigmas = 4,
                 kLeastBend = 0.05;                        // beyond all three (percent, sigmas, frames): it drifts
constexpr double kTimeReach = 0.1, kBendReach = 0.15;      // cycles over the video, of a refined period
constexpr Eigen::Index kFewestParts = 6, kMostParts = 40;  // of the video, two a cycle

// With a moving camera, how its place changes the look of what moves is not all that the fit takes it for: errors are
// so many times what its scatter says (period_bench).
constexpr double kMovingCamera = 3;

// Frames that lead the fit by whole frames from some frame on. Leads are compared before and after each frame.
std::vector<std::pair<Eigen::Index, int>> FindSlips(const HarmonicFit& fit, double period, int harmonics) {
  const auto offsets = fit.FrameOffsets(period, harmonics);
  const Eigen::Index n = offsets.lead.size();
  const Eigen::Index window =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(kWindowPart * period), kLeastWindow, kMostWindow);
  if (n < 4 * window) return {};
  const auto weighted = [&](Eigen::Index begin, Eigen::Index end) {
    std::vector<std::pair<double, double>> v;
    double sum = 0;
    for (Eigen::Index i = begin; i < end; ++i)
      v.emplace_back(offsets.lead[i], offsets.weight[i]), sum += offsets.weight[i];
    std::ranges::sort(v);
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
  const double usual = Median(std::move(size));
  std::vector<std::pair<Eigen::Index, int>> slips;
  Eigen::Index at = 0;
  const double most = jump.cwiseAbs().maxCoeff(&at);
  if (most > std::max(kSlip, kUnusual * usual) && std::lround(jump[at]) != 0) {
    // The plateau's middle.
    Eigen::Index first = at, last = at;
    while (first > window && jump[first - 1] * jump[at] > 0 && std::abs(jump[first - 1]) > kPlateau * most) --first;
    while (last + 1 + window <= n && jump[last + 1] * jump[at] > 0 && std::abs(jump[last + 1]) > kPlateau * most)
      ++last;
    slips.emplace_back((first + last) / 2, static_cast<int>(std::lround(jump[at])));
  }
  return slips;
}

// Of a period near a whole number of frames, a harmonic beyond half the frame rate folds back beside a slower one, and
// stands in for a shift of it: the period is known as well as the harmonics that do not fold agree with it.
constexpr double kFoldedBeside = 0.5;  // cycles over the video
int HarmonicsThatDoNotFold(double period) { return std::max(1, static_cast<int>(kNyquist * period)); }
bool FoldsOntoItself(double period, int harmonics, double span) {
  const int plain = HarmonicsThatDoNotFold(period);
  for (int h = plain + 1; h <= harmonics; ++h) {
    for (int slow = 1; slow <= plain; ++slow)
      if (std::abs(Folded(h / period) - slow / period) < kFoldedBeside / span) return true;
  }
  return false;
}

// The video's, two a cycle.
Eigen::Index Parts(const HarmonicFit& fit, double period) {
  return std::clamp<Eigen::Index>(static_cast<Eigen::Index>(2 * fit.span() / period), kFewestParts, kMostParts);
}

// Leads of parts of the video against their time: a polynomial, weighted by what each part says.
PolynomialFit LeadOverTime(const HarmonicFit& fit, double period, int harmonics, int degree) {
  const auto offsets = fit.FrameOffsets(period, harmonics);
  const Eigen::Index n = offsets.lead.size();
  const Eigen::Index parts = Parts(fit, period);
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
  const auto map = [](const std::vector<double>& v) {
    return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  return FitPolynomial(map(t), map(lead), map(weight), degree);
}

// Dropped and doubled frames, one after the other: each shifts all that follow. The time without them; the period is
// refined on the way.
VectorXd UndoSlips(HarmonicFit& fit, const Signals& s, int harmonics, double& period, std::vector<Slip>& found) {
  VectorXd time = s.time;
  for (int round = 0; round < kMostSlips; ++round) {
    const auto slips = FindSlips(fit, period, std::min(harmonics, kSlipHarmonics));
    if (slips.empty()) break;
    const double before = fit.CrossValidate(period, harmonics, harmonics).explained;
    const VectorXd old = time;
    const auto [at, frames] = slips[0];
    time.tail(time.size() - at).array() += frames;
    fit.SetTime(time);
    const double p =
        fit.Refine(period, std::min(harmonics, kSlipHarmonics), 0.5 * std::abs(frames) / period + kTimeReach);
    if (fit.CrossValidate(p, harmonics, harmonics).explained < before + kSlipGain) {
      fit.SetTime(time = old);
      break;
    }
    period = p;
    found.push_back({s.frame[static_cast<std::size_t>(at)], frames});
  }
  std::ranges::sort(found, [](const Slip& a, const Slip& b) { return a.frame < b.frame; });
  return time;
}

}  // namespace

TimedPeriod FitTime(HarmonicFit& fit, const Signals& s, const Refined& taken, double min_period) {
  TimedPeriod t;
  t.period = taken.period;
  t.harmonics = std::max(1, taken.fit.harmonics);
  const double widened = s.modulation.cols() > 0 ? kMovingCamera : 1;
  const VectorXd slipped = UndoSlips(fit, s, t.harmonics, t.period, t.slips);
  // A drift bends the phase; straightened a little at a time.
  if (fit.span() / t.period >= kCyclesToBend) {
    const double unbent = t.period;
    double c = 0;
    for (int round = 0; round < kBendRounds; ++round) {
      const int h = round < kCoarseRounds ? std::min(t.harmonics, kCoarseHarmonics) : t.harmonics;
      const double more = LeadOverTime(fit, t.period, h, 2).coefficient[2];
      c += more;
      const VectorXd u = (slipped.array() - slipped.mean()) / fit.span();
      fit.SetTime(slipped + c * u.array().square().matrix());
      t.period = fit.Refine(t.period, h, kBendReach);
      if (round >= kCoarseRounds && std::abs(more) < kBendDone) break;
    }
    // Lead c u^2, u from -1/2 to 1/2 over the span: the phase runs faster by 2 c u / span.
    t.drift_percent = -200 * c / fit.span();
    t.drift_sigma_percent = 200 * widened * LeadOverTime(fit, t.period, t.harmonics, 2).sigma[2] / fit.span();
    if (std::abs(1 / t.period - 1 / unbent) * fit.span() > kMostBent) {
      t.period = unbent;
      t.drift_percent = 0;
    }
    t.drifts = std::abs(t.drift_percent) > std::max(kLeastDriftPercent, kDriftSigmas * t.drift_sigma_percent) &&
               std::abs(c) > kLeastBend;
  }
  if (!t.drifts) {
    fit.SetTime(slipped);
    t.period = fit.Refine(t.period, t.harmonics, kTimeReach);
  }
  const CrossValidation last = fit.CrossValidate(t.period, MostHarmonics(s));
  if (last.explained > 0) t.harmonics = last.harmonics;
  // At 2 frames the fit is flat, and wanders below.
  t.period = std::max(min_period, fit.Refine(t.period, t.harmonics, kTimeReach));
  t.sigma = widened * fit.PeriodSigma(t.period, t.harmonics, Parts(fit, t.period));
  t.explained = std::max(last.explained, taken.fit.explained);
  if (FoldsOntoItself(t.period, t.harmonics, fit.span())) {
    const double by_others = fit.Refine(t.period, HarmonicsThatDoNotFold(t.period), kTimeReach);
    t.sigma = std::max(t.sigma, std::abs(by_others - t.period));
  }
  return t;
}

}  // namespace lumi
