#include "render/radiance/optimum/sum_to_one.h"

#include <algorithm>
#include <numeric>

namespace lumi {

double SumToOne(WeightSum how, std::vector<double>& w, const std::vector<double>& z, double& sum_before) {
  const double sum = std::accumulate(w.begin(), w.end(), 0.0);
  sum_before = sum;
  switch (how) {
    case WeightSum::kRenormalise: {
      const double divisor = std::max(sum, kSmallestSum);
      for (double& x : w) x /= divisor;
      return 1 - sum / divisor;
    }
    case WeightSum::kConstrained: {
      const double z_sum = std::accumulate(z.begin(), z.end(), 0.0);
      const double lambda = (1 - sum) / std::max(z_sum, kSmallestSum);
      for (std::size_t i = 0; i < w.size(); ++i) w[i] += lambda * z[i];
      return 1 - sum - lambda * z_sum;
    }
    case WeightSum::kLocalMean: break;
  }
  return 1 - sum;
}

}  // namespace lumi
