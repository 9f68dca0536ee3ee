#include "reconstruct/factorization/ransac.h"

#include <cmath>

namespace lumi {

int TrialsNeeded(double inlier_share, int sample_size, const RansacOptions& options) {
  const double clean = std::pow(inlier_share, sample_size);  // of a sample
  if (!(clean > 0)) return options.max_trials;
  const double trials = clean < 1 ? std::ceil(std::log1p(-options.confidence) / std::log1p(-clean)) : 1;
  return static_cast<int>(std::clamp(trials, static_cast<double>(std::min(options.min_trials, options.max_trials)),
                                     static_cast<double>(options.max_trials)));
}

}  // namespace lumi
