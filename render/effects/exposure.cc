#include "render/effects/exposure.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "render/cpu/blend.h"
#include "render/effects/point_photo_fit.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr float kDarkest = 16, kBrightest = 240;  // code values: noise below, clipping above
constexpr int kPointsAView = 400;
constexpr double kHuber = 0.1;  // log units: highlights and occlusions lie beyond

// Of each sight of each point, [0, 255]; not a number where its photo is not there.
using TrackColors = std::vector<std::vector<Eigen::Vector3f>>;

// The sights of each view: point, and place in its track.
std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> SightsOfViews(const Scene& scene) {
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> sights(scene.views.size());
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (std::size_t k = 0; k < scene.points[p].track.size(); ++k)
      sights[static_cast<std::size_t>(scene.points[p].track[k].view.value)].emplace_back(p, k);
  return sights;
}

template <typename PhotoOf>
TrackColors SampleTracks(const Scene& scene, const PhotoOf& photo_of) {
  TrackColors colors(scene.points.size());
  for (std::size_t p = 0; p < colors.size(); ++p)
    colors[p].assign(scene.points[p].track.size(), Eigen::Vector3f::Constant(NAN));
  const auto sights = SightsOfViews(scene);
  ParallelFor(sights.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Eigen::Vector2i size = SizePx(scene, scene.views[v]);
      photo_of(v, [&](const Photo& photo) {
        if (photo.levels.empty()) return;
        for (const auto& [p, k] : sights[v]) {
          const Eigen::Vector2d& x = scene.points[p].track[k].x_px;
          // A level up: one pixel's noise and a corner's own blur count less.
          colors[p][k] =
              SamplePhoto(photo, static_cast<float>(x.x() / size.x()), static_cast<float>(x.y() / size.y()), 1.5F);
        }
      });
    }
  });
  return colors;
}

Exposures Estimate(const Scene& scene, const TrackColors& colors) {
  Exposures out;
  const std::size_t n = scene.views.size();
  out.gain.assign(n, 1.0);
  // Long tracks first: they tie most photos together.
  std::vector<std::size_t> order(scene.points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return scene.points[a].track.size() > scene.points[b].track.size();
  });
  std::vector<int> taken(n, 0);
  std::vector<PhotoSample> samples;
  for (const std::size_t p : order) {
    const auto& track = scene.points[p].track;
    if (track.size() < 2) break;
    if (std::none_of(track.begin(), track.end(), [&](const Observation& o) {
          return taken[static_cast<std::size_t>(o.view.value)] < kPointsAView;
        }))
      continue;
    const std::size_t first = samples.size();
    for (std::size_t k = 0; k < track.size(); ++k) {
      const auto v = static_cast<std::size_t>(track[k].view.value);
      const Eigen::Vector3f& c = colors[p][k];
      if (!c.allFinite()) continue;
      const float value = c.mean();
      if (c.minCoeff() < kDarkest || c.maxCoeff() > kBrightest) continue;
      samples.push_back({p, v, std::log(static_cast<double>(value))});
    }
    if (samples.size() - first < 2)
      samples.resize(first);
    else
      for (std::size_t i = first; i < samples.size(); ++i) ++taken[samples[i].photo];
  }
  if (samples.empty()) return out;

  const PointPhotoFit fit = FitPointsAndPhotos(samples, scene.points.size(), n, {kHuber});
  constexpr double kEnough = 20;  // samples: fewer say nothing of a photo
  double low = 0, high = 0, error = 0;
  for (std::size_t v = 0; v < n; ++v) {
    if (fit.weight_sum[v] < kEnough) continue;
    out.gain[v] = std::exp(fit.log_photo[v]);
    low = std::min(low, fit.log_photo[v]);
    high = std::max(high, fit.log_photo[v]);
    error = std::max(error, std::sqrt(fit.square_sum[v] / fit.weight_sum[v] / fit.weight_sum[v]));
  }
  out.spread = std::exp(high - low);
  out.noise = std::exp(2 * 2.6 * error);  // 99 % of a normal error, at both ends
  return out;
}

}  // namespace

Exposures EstimateExposures(const Scene& scene, const std::vector<Photo>& photos) {
  return Estimate(scene, SampleTracks(scene, [&](std::size_t v, auto&& sample) { sample(photos[v]); }));
}

Exposures EstimateExposures(const Scene& scene, ProgressSink& sink) {
  Progress progress(sink, "reading exposures", static_cast<long>(scene.views.size()));
  return Estimate(scene, SampleTracks(scene, [&](std::size_t v, auto&& sample) {
                    sample(LoadPhoto(scene, {static_cast<std::int32_t>(v)}, {}));
                    progress.Step();
                  }));
}

}  // namespace lumi
