#include "reconstruct/factorization/cull.h"

#include <algorithm>
#include <cmath>

#include "scene/geometry/median.h"

namespace lumi {
namespace {

// With two views, noise leaves a quarter of its variance in the residuals; a smaller share is not trusted.
constexpr double kLeastRedundancy = 0.1;
// The median length of a two-dimensional Gaussian vector, in standard deviations of a coordinate.
const double kMedianOfRayleigh = std::sqrt(2 * std::log(2.0));

}  // namespace

CullResult Cull(const ImagePoints& points, ProjectiveModel& model, const CullOptions& options) {
  CullResult result;
  const std::vector<double> errors = InlierErrorsPx(points, model);
  if (errors.empty()) return result;
  // Cameras and points adapt to the noise: the fewer sights there are for each parameter, the smaller the remaining
  // errors.
  const double numbers = 3.0 * model.SolvedCount() + 11.0 * model.PlacedCount() - 15.0,
               measured = 2.0 * static_cast<double>(errors.size());
  const double left = std::max(1 - numbers / measured, kLeastRedundancy);
  result.sigma_px = Median(errors) / kMedianOfRayleigh / std::sqrt(left);
  result.limit_px = std::clamp(options.sigmas * result.sigma_px, options.least_px, options.most_px);
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    if (!model.solved[t]) continue;
    int inliers = 0, here = 0;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& sight = points.tracks[t][k];
      if (!model.placed[static_cast<std::size_t>(sight.frame)]) continue;
      ++here;
      model.inlier[t][k] = ReprojectionErrorPx(points, model, sight, t) <= result.limit_px;
      inliers += model.inlier[t][k];
    }
    result.culled += here - inliers;
    if (inliers < options.min_sights) {
      model.solved[t] = 0;
      ++result.tracks_dropped;
    } else {
      result.sights += inliers;
    }
  }
  return result;
}

}  // namespace lumi
