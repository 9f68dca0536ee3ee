// Random samples and the model that most data agree with (RANSAC, Fischler & Bolles 1981): one loop, one score and one
// count of trials for all that this folder estimates among outliers. The score is the sum of squared errors, each no
// more than the limit's (MSAC, Torr & Zisserman 2000), so that of two models with as many inliers the nearer wins. The
// same seed draws the same samples.
//
//   Consensus<Matrix3d, decltype(error)> best(n, limit_px * limit_px, error);            // error(model, i): squared
//   const RansacSummary drawn = DrawModels<4>({.max_trials = 1000}, n, random, best, [&](const auto& sample) { return
//   best.Offer(Fit(sample)); });
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

namespace lumi {

struct RansacOptions {
  int min_trials = 1;
  int max_trials = 1000;
  int sample_size = 0;         // that the confidence is about; 0: the sample's own
  double confidence = 0.9999;  // that a sample without outlier was among those drawn, 0 to 1
};

struct RansacSummary {
  int trials = 0;          // samples drawn: 0 where there are fewer data than a sample has
  bool confident = false;  // they were enough; false: stopped at max_trials, or no model explains anything
};

// Samples to draw so that one of them holds no outlier with this confidence, between options.min_trials and max_trials.
int TrialsNeeded(double inlier_share, int sample_size, const RansacOptions& options);

// N different ones of 0 ... n - 1; n >= N.
template <std::size_t N>
std::array<std::size_t, N> DrawSample(std::size_t n, std::mt19937_64& random) {
  std::array<std::size_t, N> sample;
  for (auto at = sample.begin(); at != sample.end(); ++at) {
    do *at = random() % n;
    while (std::find(sample.begin(), at, *at) != at);
  }
  return sample;
}

// The best of the models that are offered. SquaredError(model, i): of datum i; infinity, not not-a-number, where there
// is none.
template <typename Model, typename SquaredError>
class Consensus {
 public:
  Consensus(std::size_t count, double limit2, SquaredError error)
      : count_(count), limit2_(limit2), error_(error), score_(static_cast<double>(count) * limit2) {}

  // Whether it is better than all before it; one that explains nothing is not.
  bool Offer(const Model& model) {
    double score = 0;
    for (std::size_t i = 0; i < count_ && score < score_; ++i) score += std::min(limit2_, error_(model, i));
    if (!(score < score_)) return false;
    score_ = score;
    best_ = model;
    found_ = true;
    return true;
  }

  bool found() const { return found_; }
  const Model& best() const { return best_; }  // where found
  int InlierCount() const {
    int count = 0;
    for (std::size_t i = 0; found_ && i < count_; ++i) count += error_(best_, i) < limit2_;
    return count;
  }
  std::vector<char> Inliers() const {
    std::vector<char> inlier(count_, 0);
    for (std::size_t i = 0; found_ && i < count_; ++i) inlier[i] = error_(best_, i) < limit2_;
    return inlier;
  }
  double InlierShare() const { return static_cast<double>(InlierCount()) / static_cast<double>(count_); }

 private:
  std::size_t count_;
  double limit2_;
  SquaredError error_;
  double score_;
  Model best_{};
  bool found_ = false;
};

// Samples of N out of `population`; propose(sample) offers what it makes of one to `consensus` and says whether the
// best has changed.
template <std::size_t N, typename Model, typename SquaredError, typename Propose>
RansacSummary DrawModels(const RansacOptions& options, std::size_t population, std::mt19937_64& random,
                         const Consensus<Model, SquaredError>& consensus, const Propose& propose) {
  RansacSummary summary;
  if (population < N) return summary;
  const int size = options.sample_size > 0 ? options.sample_size : static_cast<int>(N);
  const auto needed_now = [&] {
    return consensus.found() ? TrialsNeeded(consensus.InlierShare(), size, options) : options.max_trials;
  };
  for (int needed = needed_now(); summary.trials < needed; ++summary.trials)
    if (propose(DrawSample<N>(population, random))) needed = std::min(needed, needed_now());
  RansacOptions unbounded = options;
  unbounded.max_trials = std::numeric_limits<int>::max();
  summary.confident = consensus.found() && summary.trials >= TrialsNeeded(consensus.InlierShare(), size, unbounded);
  return summary;
}

}  // namespace lumi
