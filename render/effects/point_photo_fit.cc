#include "render/effects/point_photo_fit.h"

#include <algorithm>
#include <cmath>

namespace lumi {

PointPhotoFit FitPointsAndPhotos(const std::vector<PhotoSample>& samples, std::size_t points, std::size_t photos,
                                 const PointPhotoFitOptions& options) {
  const auto huber = [&](double residual) {
    return std::abs(residual) <= options.huber ? 1.0 : options.huber / std::abs(residual);
  };
  PointPhotoFit fit;
  fit.log_photo.assign(photos, 0.0);
  std::vector<double> level(points, 0.0);
  // Solves the points given the photos, then the photos given the points.
  for (int round = 0; round < options.rounds; ++round) {
    std::vector<double> sum(points, 0.0), count(points, 0.0);
    for (const PhotoSample& s : samples) {
      const double w = round == 0 ? 1 : huber(s.log_value - level[s.point] - fit.log_photo[s.photo]);
      sum[s.point] += w * (s.log_value - fit.log_photo[s.photo]);
      count[s.point] += w;
    }
    for (std::size_t p = 0; p < points; ++p)
      if (count[p] > 0) level[p] = sum[p] / count[p];
    std::vector<double> total(photos, 0.0);
    fit.weight_sum.assign(photos, 0.0);
    fit.square_sum.assign(photos, 0.0);
    for (const PhotoSample& s : samples) {
      const double residual = s.log_value - level[s.point] - fit.log_photo[s.photo], w = huber(residual);
      total[s.photo] += w * (s.log_value - level[s.point]);
      fit.weight_sum[s.photo] += w;
      fit.square_sum[s.photo] += w * residual * residual;
    }
    double mean = 0, known = 0;
    for (std::size_t v = 0; v < photos; ++v)
      if (fit.weight_sum[v] > 0) {
        fit.log_photo[v] = total[v] / (fit.weight_sum[v] + options.prior);
        mean += fit.log_photo[v];
        ++known;
      }
    for (std::size_t v = 0; v < photos; ++v)
      if (fit.weight_sum[v] > 0) fit.log_photo[v] -= mean / std::max(1.0, known);
  }
  return fit;
}

}  // namespace lumi
