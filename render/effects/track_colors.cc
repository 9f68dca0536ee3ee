#include "render/effects/track_colors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/cpu/blend.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr float kDarkest = 16, kBrightest = 240;  // code values: noise below, clipping above
constexpr int kPointsAView = 400;

// The colour of each sight of each point, [0, 255]; NaN if its photo is not loaded.
using TrackColors = std::vector<std::vector<Eigen::Vector3f>>;

// The sights of each view: point, and place in its track.
std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> SightsOfViews(const Scene& scene) {
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> sights(scene.views.size());
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (std::size_t k = 0; k < scene.points[p].track.size(); ++k)
      sights[static_cast<std::size_t>(scene.points[p].track[k].view.value)].emplace_back(p, k);
  return sights;
}

TrackColors SampleTracks(const Scene& scene, const PhotoReader& photo_of) {
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
          // Sampled between levels 1 and 2 of the pyramid, so that single pixels' noise and blur at corners count less.
          colors[p][k] =
              SamplePhoto(photo, static_cast<float>(x.x() / size.x()), static_cast<float>(x.y() / size.y()), 1.5F);
        }
      });
    }
  });
  return colors;
}

double RadiusSquared(const Scene& scene, const Observation& o) {
  const Eigen::Vector2d middle =
      0.5 * SizePx(scene, scene.views[static_cast<std::size_t>(o.view.value)]).cast<double>();
  return (o.x_px - middle).squaredNorm() / middle.squaredNorm();
}

}  // namespace

std::vector<ColorSample> SampleTrackColors(const Scene& scene, const PhotoReader& photo_of) {
  const TrackColors colors = SampleTracks(scene, photo_of);
  // Long tracks first: they tie most photos together.
  std::vector<std::size_t> order(scene.points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return scene.points[a].track.size() > scene.points[b].track.size();
  });
  std::vector<int> taken(scene.views.size(), 0);
  std::vector<ColorSample> samples;
  for (const std::size_t p : order) {
    const auto& track = scene.points[p].track;
    if (track.size() < 2) break;
    if (std::none_of(track.begin(), track.end(), [&](const Observation& o) {
          return taken[static_cast<std::size_t>(o.view.value)] < kPointsAView;
        }))
      continue;
    const std::size_t first = samples.size();
    for (std::size_t k = 0; k < track.size(); ++k) {
      const Eigen::Vector3f& c = colors[p][k];
      if (!c.allFinite() || c.minCoeff() < kDarkest || c.maxCoeff() > kBrightest) continue;
      samples.push_back(
          {p, static_cast<std::size_t>(track[k].view.value), {c[0], c[1], c[2]}, RadiusSquared(scene, track[k])});
    }
    if (samples.size() - first < 2)
      samples.resize(first);
    else
      for (std::size_t i = first; i < samples.size(); ++i) ++taken[samples[i].photo];
  }
  return samples;
}

}  // namespace lumi
