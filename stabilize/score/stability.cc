#include "stabilize/score/stability.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

#include "scene/geometry/median.h"

namespace lumi::score {
namespace {

constexpr std::size_t kSlow = 5;  // frequencies, beside 0
constexpr std::size_t kLeastFrames = 2 * (kSlow + 1);
constexpr double kUnevenInterval = 0.1;  // of the median interval
constexpr double kUnevenShare = 0.02;    // of the intervals

}  // namespace

std::vector<double> PathEnergies(const std::vector<double>& path) {
  if (path.size() < 2) return {};
  const double mean = std::accumulate(path.begin(), path.end(), 0.0) / static_cast<double>(path.size());
  cv::Mat1d values(1, static_cast<int>(path.size()));
  for (std::size_t i = 0; i < path.size(); ++i) values(0, static_cast<int>(i)) = path[i] - mean;
  cv::Mat spectrum;
  cv::dft(values, spectrum, cv::DFT_COMPLEX_OUTPUT);
  std::vector<double> energies;
  for (std::size_t k = 1; k <= path.size() / 2; ++k) {
    const cv::Vec2d& f = spectrum.at<cv::Vec2d>(0, static_cast<int>(k));
    energies.push_back(f[0] * f[0] + f[1] * f[1]);
  }
  return energies;
}

std::optional<double> StabilityOf(const std::vector<double>& path, double still_rms) {
  if (path.size() < kLeastFrames) return std::nullopt;
  const double n = static_cast<double>(path.size()), mean = std::accumulate(path.begin(), path.end(), 0.0) / n;
  double square = 0;
  for (const double x : path) square += (x - mean) * (x - mean);
  if (std::sqrt(square / n) <= still_rms) return 1.0;
  const std::vector<double> energies = PathEnergies(path);
  const double slow = std::accumulate(energies.begin(), energies.begin() + kSlow, 0.0);
  return slow / std::accumulate(energies.begin() + kSlow, energies.end(), slow);
}

std::vector<double> WithoutLine(std::vector<double> path) {
  const double n = static_cast<double>(path.size()), middle = 0.5 * (n - 1);
  double mean = 0, slope = 0, square = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double t = static_cast<double>(i) - middle;
    mean += path[i] / n;
    slope += t * path[i];
    square += t * t;
  }
  if (square > 0) slope /= square;
  for (std::size_t i = 0; i < path.size(); ++i) path[i] -= mean + slope * (static_cast<double>(i) - middle);
  return path;
}

void MeasuredPath::Begin(double time_s) { times_s_ = {time_s}; }

void MeasuredPath::Add(double time_s, Step step, const Movement& movement) {
  times_s_.push_back(time_s);
  steps_.push_back(step);
  movements_.push_back(movement);
  failed_ += step == Step::kFailed;
}

int MeasuredPath::open_gap() const {
  int steps = 0;
  while (steps < static_cast<int>(steps_.size()) &&
         steps_[steps_.size() - 1 - static_cast<std::size_t>(steps)] == Step::kFailed)
    ++steps;
  return steps;
}

void MeasuredPath::Bridge(int steps, const Movement& movement) {
  for (std::size_t i = steps_.size() - static_cast<std::size_t>(steps); i < steps_.size(); ++i) {
    steps_[i] = Step::kBridged;
    movements_[i] = {movement.shift_px / steps, movement.rotation_rad / steps};
  }
}

MeasuredPath::Path MeasuredPath::Result() const {
  Path path;
  const std::size_t n = times_s_.size();
  std::vector<Eigen::Vector3d> at(n, Eigen::Vector3d::Zero());
  const auto movement = [&](std::size_t i) -> Eigen::Vector3d {
    return {movements_[i].shift_px.x(), movements_[i].shift_px.y(), movements_[i].rotation_rad};
  };
  for (std::size_t i = 0; i + 1 < n; ++i) {
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    if (steps_[i] == Step::kMeasured || steps_[i] == Step::kBridged) {
      step = movement(i);
    } else if (steps_[i] == Step::kFailed) {
      // The nearest measured steps of the same shot.
      int sides = 0;
      for (std::size_t before = i; before-- > 0 && steps_[before] != Step::kCut;)
        if (steps_[before] == Step::kMeasured) {
          step += movement(before);
          ++sides;
          break;
        }
      for (std::size_t after = i + 1; after < steps_.size() && steps_[after] != Step::kCut; ++after)
        if (steps_[after] == Step::kMeasured) {
          step += movement(after);
          ++sides;
          break;
        }
      if (sides == 2) step *= 0.5;
    }
    at[i + 1] = at[i] + step;
  }
  std::vector<double> intervals;
  for (std::size_t i = 0; i + 1 < n; ++i) intervals.push_back(times_s_[i + 1] - times_s_[i]);
  path.interval_s = Median(intervals);
  const auto odd = std::ranges::count_if(
      intervals, [&](double d) { return std::abs(d - path.interval_s) > kUnevenInterval * path.interval_s; });
  path.uneven = static_cast<double>(odd) > kUnevenShare * static_cast<double>(intervals.size());
  if (path.uneven) {
    std::vector<Eigen::Vector3d> even;
    std::size_t k = 0;
    for (std::size_t i = 0; times_s_[0] + static_cast<double>(i) * path.interval_s <= times_s_.back() + 1e-9; ++i) {
      const double t = times_s_[0] + static_cast<double>(i) * path.interval_s;
      while (k + 2 < n && times_s_[k + 1] <= t) ++k;
      const double share = std::clamp((t - times_s_[k]) / (times_s_[k + 1] - times_s_[k]), 0.0, 1.0);
      even.push_back((1 - share) * at[k] + share * at[k + 1]);
    }
    at = std::move(even);
  }
  for (const Eigen::Vector3d& p : at) {
    path.x_px.push_back(p.x());
    path.y_px.push_back(p.y());
    path.rotation_rad.push_back(p.z());
  }
  return path;
}

}  // namespace lumi::score
