#include "timeperiodic/spectrum.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "scene/geometry/constants.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kOversampling = 8;
constexpr int kFinerGrid = 8;      // places a frame, where times are no whole frames
constexpr double kWhole = 1e-5;    // frames: nearer to a whole one is whole; 1e9 seconds of 30 frames hold 4e-6
constexpr std::size_t kPeaks = 6;  // looked at closely for each number of harmonics

bool IsWhole(double frames) { return std::abs(frames - std::round(frames)) < kWhole; }

}  // namespace

double Folded(double f) { return std::abs(f - std::round(f)); }

double Spectrum::At(double f) const {
  if (folds) f = Folded(f);
  const auto i = static_cast<std::size_t>(std::lround(std::abs(f) / step));
  if (!folds && i >= power.size()) return 0;
  return power[std::min(i, power.size() - 1)];
}

double Spectrum::HarmonicSum(double f, int count) const {
  double sum = 0;
  for (int h = 1; h <= count; ++h) sum += At(h * f);
  return sum;
}

Spectrum SpectrumOf(const Signals& signals) {
  return SpectrumOf(signals.values, signals.time, signals.values.squaredNorm());
}

double LineEvidence(const Spectrum& spectrum, double f, double span) {
  const auto at = [&](double offset) { return spectrum.At(f + offset / span); };
  std::vector<double> around;
  for (double offset = 2; offset <= 14; offset += 0.5) {
    around.push_back(at(offset));
    around.push_back(at(-offset));
  }
  const double median = Median(around);
  for (double& v : around) v = std::abs(v - median);
  const double deviation = std::max(kSigmaPerMad * Median(std::move(around)), 0.1 * median + 1e-12);
  return (at(0) - median) / deviation;
}

Spectrum SpectrumOf(const Eigen::MatrixXd& values, const Eigen::VectorXd& time, double sum_of_squares) {
  const Eigen::Index n = values.rows();
  const double begin = n > 0 ? time.minCoeff() : 0;
  const double end = n > 0 ? time.maxCoeff() : 1;
  Spectrum spectrum;
  for (Eigen::Index i = 0; i < n; ++i) spectrum.folds = spectrum.folds && IsWhole(time[i] - begin);
  const int fine = spectrum.folds ? 1 : kFinerGrid,
            length = fine * cv::getOptimalDFTSize(kOversampling * (static_cast<int>(end - begin) + 2));
  spectrum.step = static_cast<double>(fine) / length;
  spectrum.power.assign(static_cast<std::size_t>(length / 2 + 1), 0);
  const double total = std::max(1e-300, sum_of_squares);
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    cv::Mat row = cv::Mat::zeros(1, length, CV_64F), out;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double place = fine * (time[i] - begin);
      const auto at = static_cast<int>(spectrum.folds ? std::lround(place) : std::lround(std::floor(place)));
      const double share = spectrum.folds ? 0 : place - at;
      row.at<double>(0, at) += (1 - share) * values(i, c);
      if (share > 0) row.at<double>(0, at + 1) += share * values(i, c);
    }
    cv::dft(row, out, cv::DFT_COMPLEX_OUTPUT);
    for (std::size_t k = 0; k < spectrum.power.size(); ++k) {
      const auto z = out.at<cv::Vec2d>(0, static_cast<int>(k));
      spectrum.power[k] += 2 * (z[0] * z[0] + z[1] * z[1]) / (static_cast<double>(n) * total);
    }
  }
  return spectrum;
}

std::vector<double> LikelyFundamentals(const Spectrum& spectrum, double span, double min_period, double max_period) {
  std::vector<double> found;
  for (const int harmonics : {1, 2, 4, 12}) {
    const double step = 1 / (4 * span * harmonics), low = 1 / max_period, high = 1 / min_period;
    const auto count = static_cast<std::size_t>((high - low) / step) + 1;
    std::vector<double> sum(count);
    ParallelEach(count, 1024,
                 [&](std::size_t i) { sum[i] = spectrum.HarmonicSum(low + step * static_cast<double>(i), harmonics); });
    std::vector<std::pair<double, double>> peaks;
    for (std::size_t i = 0; i < count; ++i) {
      const bool rises = i == 0 || sum[i] >= sum[i - 1], falls = i + 1 == count || sum[i] > sum[i + 1];
      if (rises && falls) peaks.emplace_back(-sum[i], low + step * static_cast<double>(i));
    }
    std::ranges::sort(peaks);
    std::size_t taken = 0;
    for (const auto& [value, f] : peaks) {
      const bool known = std::ranges::any_of(found, [&](double g) { return std::abs(g - f) < 0.5 / span; });
      if (known) continue;
      found.push_back(f);
      if (++taken == kPeaks) break;
    }
  }
  return found;
}

}  // namespace lumi
