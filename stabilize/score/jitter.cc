#include "stabilize/score/jitter.h"

#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"

namespace lumi::score {
namespace {

constexpr double kHalfWindow_s = 0.7;
constexpr std::size_t kLeastTimes = 7;
constexpr std::size_t kLeastFeatures = 8;  // in a frame
constexpr double kSlack = 1e-6;            // of times

}  // namespace

std::vector<double> ParabolaWeights(const std::vector<double>& times_s, double middle_s, double interval_s) {
  if (times_s.size() < kLeastTimes) return {};
  const auto n = static_cast<Eigen::Index>(times_s.size());
  Eigen::MatrixXd A(n, 3);
  Eigen::VectorXd w(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = (times_s[static_cast<std::size_t>(i)] - middle_s) / (kHalfWindow_s + interval_s);
    A.row(i) << 1, t, t * t;
    w[i] = std::max(0.0, 1 - t * t);
  }
  const auto inverse = InverseOf(A.transpose() * w.asDiagonal() * A, 1e-12);
  if (!inverse) return {};
  const Eigen::VectorXd weights = (inverse->row(0) * A.transpose() * w.asDiagonal()).transpose();
  return {weights.begin(), weights.end()};
}

JitterMeter::JitterMeter(double fps) : interval_s_(1 / fps) {}

void JitterMeter::Add(double time_s, const std::vector<FollowedCorner>& corners) {
  if (of_frame_px_.empty()) begin_s_ = time_s;
  frames_.push_back({time_s, corners});
  of_frame_px_.push_back(std::numeric_limits<double>::quiet_NaN());
  // A window is full when the next frame would lie outside.
  while (next_ - first_ < frames_.size() &&
         time_s + interval_s_ > frames_[next_ - first_].time_s + kHalfWindow_s + kSlack)
    Measure(next_++);
  while (!frames_.empty() && next_ - first_ < frames_.size() &&
         frames_.front().time_s < frames_[next_ - first_].time_s - kHalfWindow_s - kSlack) {
    frames_.pop_front();
    ++first_;
  }
}

void JitterMeter::Measure(std::size_t index) {
  const std::size_t centre = index - first_;
  const double middle_s = frames_[centre].time_s;
  std::vector<Residual> residuals;
  if (begin_s_ - interval_s_ < middle_s - kHalfWindow_s - kSlack) {
    std::size_t begin = 0, end = frames_.size();
    while (frames_[begin].time_s < middle_s - kHalfWindow_s - kSlack) ++begin;
    while (frames_[end - 1].time_s > middle_s + kHalfWindow_s + kSlack) --end;
    std::vector<double> times_s;
    for (std::size_t i = begin; i < end; ++i) times_s.push_back(frames_[i].time_s);
    const std::vector<double> weights = ParabolaWeights(times_s, middle_s, interval_s_);
    if (!weights.empty()) {
      // Tracks ascend in every frame: one pass through all of them at once.
      std::vector<std::size_t> at(end - begin, 0);
      for (const FollowedCorner& c : frames_[centre].corners) {
        Eigen::Vector2d residual = c.x_px;
        bool throughout = true;
        for (std::size_t i = begin; i < end && throughout; ++i) {
          const std::vector<FollowedCorner>& there = frames_[i].corners;
          std::size_t& k = at[i - begin];
          while (k < there.size() && there[k].track < c.track) ++k;
          throughout = k < there.size() && there[k].track == c.track;
          if (throughout) residual -= weights[i - begin] * there[k].x_px;
        }
        if (throughout) residuals.push_back({c.track, residual});
      }
    }
  }
  if (residuals.size() < kLeastFeatures) residuals.clear();
  if (!residuals.empty()) {
    std::vector<double> squares;
    for (const Residual& r : residuals) {
      squares.push_back(r.px.squaredNorm());
      all_square_sum_ += squares.back();
    }
    all_count_ += static_cast<long>(squares.size());
    const double square = Median(squares);
    square_sum_ += square;
    ++measured_;
    of_frame_px_[index] = std::sqrt(square);
    std::vector<double> steps;
    std::size_t k = 0;
    for (const Residual& r : residuals) {
      while (k < last_.size() && last_[k].track < r.track) ++k;
      if (k < last_.size() && last_[k].track == r.track) steps.push_back((r.px - last_[k].px).squaredNorm());
    }
    if (steps.size() >= kLeastFeatures) {
      step_square_sum_ += Median(steps);
      ++steps_;
    }
  }
  last_ = std::move(residuals);
}

JitterResult JitterMeter::Result() const {
  JitterResult result;
  result.frames = measured_;
  result.of_frame_px = of_frame_px_;
  if (measured_ > 0) {
    result.jitter_px = std::sqrt(square_sum_ / measured_);
    result.all_px = std::sqrt(all_square_sum_ / static_cast<double>(all_count_));
  }
  if (steps_ > 0) result.step_px = std::sqrt(step_square_sum_ / steps_);
  return result;
}

}  // namespace lumi::score
