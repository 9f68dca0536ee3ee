#include "render/effects/white_balance.h"

#include <algorithm>
#include <cmath>

#include "render/effects/point_photo_fit.h"

namespace lumi {
namespace {

constexpr double kRatioHuber = 0.1;   // log units: coloured highlights and occlusions lie beyond
constexpr int kRatioRounds = 60;      // a cast that drifts slowly along a video passes through many short tracks
constexpr double kEnoughRatios = 20;  // samples: a photo with fewer is unknown
constexpr double kMostRatio = 2;      // a larger ratio is not a camera's white balance

struct RatioFit {
  PointPhotoFit fit;
  double low = 0, high = 0, error = 0;
};

RatioFit FitRatio(const std::vector<ColorSample>& samples, std::size_t channel, std::size_t points, std::size_t views) {
  std::vector<PhotoSample> ratios;
  ratios.reserve(samples.size());
  for (const ColorSample& s : samples)
    ratios.push_back({s.point, s.photo, std::log(static_cast<double>(s.rgb[channel]) / static_cast<double>(s.rgb[1]))});
  RatioFit out{FitPointsAndPhotos(ratios, points, views, {.huber = kRatioHuber, .rounds = kRatioRounds})};
  for (std::size_t v = 0; v < views; ++v) {
    const double weight = out.fit.weight_sum[v];
    double& b = out.fit.log_photo[v];
    b = weight < kEnoughRatios ? 0 : std::clamp(b, -std::log(kMostRatio), std::log(kMostRatio));
    if (weight < kEnoughRatios) continue;
    out.low = std::min(out.low, b);
    out.high = std::max(out.high, b);
    out.error = std::max(out.error, std::sqrt(out.fit.square_sum[v] / weight / weight));
  }
  return out;
}

}  // namespace

WhiteBalances EstimateWhiteBalances(const std::vector<ColorSample>& samples, std::size_t points, std::size_t views) {
  WhiteBalances out;
  out.of_view.assign(views, {1, 1, 1});
  if (samples.empty()) return out;
  const RatioFit red = FitRatio(samples, 0, points, views), blue = FitRatio(samples, 2, points, views);
  for (std::size_t v = 0; v < views; ++v) {
    const double r = red.fit.log_photo[v], b = blue.fit.log_photo[v], mean = (r + b) / 3;
    out.of_view[v] = {std::exp(r - mean), std::exp(-mean), std::exp(b - mean)};
  }
  const RatioFit& more = red.high - red.low > blue.high - blue.low ? red : blue;
  out.spread = std::exp(more.high - more.low);
  out.noise = std::exp(2 * 2.6 * more.error);  // 99 % of a normal error, at both ends
  return out;
}

}  // namespace lumi
