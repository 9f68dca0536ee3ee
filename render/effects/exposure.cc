#include "render/effects/exposure.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "render/effects/point_photo_fit.h"

namespace lumi {
namespace {

constexpr double kHuber = 0.1;  // log units: highlights and occlusions lie beyond
constexpr double kEnough = 20;  // samples: fewer say nothing of a photo

// Corrections of samples; nullptr: none. `channel`, `falloff`: one for each view.
struct SampleCorrection {
  const std::vector<std::array<double, 3>>* channel = nullptr;
  const std::vector<RadialFalloff>* falloff = nullptr;

  double LogValue(const ColorSample& s) const {
    Eigen::Vector3f c(s.rgb[0], s.rgb[1], s.rgb[2]);
    if (channel)
      for (int k = 0; k < 3; ++k) c[k] /= static_cast<float>((*channel)[s.photo][static_cast<std::size_t>(k)]);
    const double log_value = std::log(static_cast<double>(c.mean()));
    return falloff ? log_value - std::log((*falloff)[s.photo].At(s.r2)) : log_value;
  }
};

PointPhotoFit FitGains(const std::vector<ColorSample>& colors, std::size_t points, std::size_t views,
                       const SampleCorrection& correction) {
  std::vector<PhotoSample> samples;
  samples.reserve(colors.size());
  for (const ColorSample& s : colors) samples.push_back({s.point, s.photo, correction.LogValue(s)});
  return FitPointsAndPhotos(samples, points, views, {kHuber});
}

std::vector<double> GainsOf(const PointPhotoFit& fit) {
  std::vector<double> gain(fit.log_photo.size(), 1.0);
  for (std::size_t v = 0; v < gain.size(); ++v)
    if (!(fit.weight_sum[v] < kEnough)) gain[v] = std::exp(fit.log_photo[v]);
  return gain;
}

Exposures Estimate(const Scene& scene, const PhotoReader& photo_of) {
  Exposures out;
  const std::size_t n = scene.views.size(), points = scene.points.size();
  const std::vector<ColorSample> samples = SampleTrackColors(scene, photo_of);
  out.white_balances = EstimateWhiteBalances(samples, points, n);
  out.vignetting = EstimateVignetting(samples, LensesOfViews(scene));
  out.gain.assign(n, 1.0);
  out.gain_corrected.fill(out.gain);
  if (samples.empty()) return out;

  const PointPhotoFit fit = FitGains(samples, points, n, {});
  out.gain = GainsOf(fit);
  double low = 0, high = 0, error = 0;
  for (std::size_t v = 0; v < n; ++v) {
    if (fit.weight_sum[v] < kEnough) continue;
    low = std::min(low, fit.log_photo[v]);
    high = std::max(high, fit.log_photo[v]);
    error = std::max(error, std::sqrt(fit.square_sum[v] / fit.weight_sum[v] / fit.weight_sum[v]));
  }
  out.spread = std::exp(high - low);
  out.noise = std::exp(2 * 2.6 * error);  // 99 % of a normal error, at both ends

  const auto* white = &out.white_balances.of_view;
  const auto* lens = &out.vignetting.of_view;
  out.gain_corrected = {GainsOf(FitGains(samples, points, n, {white, nullptr})),
                        GainsOf(FitGains(samples, points, n, {nullptr, lens})),
                        GainsOf(FitGains(samples, points, n, {white, lens}))};
  return out;
}

}  // namespace

Exposures EstimateExposures(const Scene& scene, const std::vector<Photo>& photos) {
  return Estimate(scene, [&](std::size_t v, auto&& sample) { sample(photos[v]); });
}

Exposures EstimateExposures(const Scene& scene, ProgressSink& sink) {
  Progress progress(sink, "reading exposures", static_cast<long>(scene.views.size()));
  return Estimate(scene, [&](std::size_t v, auto&& sample) {
    sample(LoadPhoto(scene, {static_cast<std::int32_t>(v)}, {}));
    progress.Step();
  });
}

void Apply(const Exposures& exposures, const Corrections& corrections, Scene& scene) {
  const std::vector<double>& gain = exposures.Gain(corrections);
  std::vector<PhotoCorrection> of_view(scene.views.size());
  double scale = 1;  // the darkest value at which any photo shows white
  for (std::size_t v = 0; v < of_view.size() && corrections.Any(); ++v) {
    PhotoCorrection& c = of_view[v];
    if (corrections.white_balance) c.channel = exposures.white_balances.of_view[v];
    if (corrections.vignetting) c.falloff = exposures.vignetting.of_view[v];
    scale = std::min(scale, *std::min_element(c.channel.begin(), c.channel.end()) * c.falloff.Corner());
  }
  for (std::size_t v = 0; v < of_view.size(); ++v) {
    View& view = scene.views[v];
    view.gain = gain[v] * scale;
    view.correction.reset();
    if (!corrections.Any()) continue;
    for (double& c : of_view[v].channel) c = scale / c;
    of_view[v].scale = scale;
    view.correction = std::make_shared<const PhotoCorrection>(of_view[v]);
  }
}

}  // namespace lumi
