#include "render/effects/sharpness.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include "render/effects/fine_detail.h"
#include "render/effects/point_photo_fit.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kColumns = 6, kRows = 4;
constexpr int kSightsAView = 600;
constexpr double kSameScale = 2.2;   // photos whose pixels at a point differ by more are not compared there
constexpr double kSameSideRad = 0.35;  // nor are those that look at it from directions farther apart: foreshortening, gloss
constexpr double kTexture = 4;       // fine detail over noise, of the photo that shows most of it
constexpr double kHuber = 1;         // log units: occlusions and highlights lie beyond
constexpr double kCellPrior = 8;     // sights: a cell with as many counts half
constexpr double kEnough = 20;       // sights: fewer say nothing of a photo
// Log units: what photos taken alike differ by through view-dependence, and what is clearly more.
constexpr double kAlike = 0.12, kClearly = 0.3;

// A point seen by a photo, among photos from about the same side whose pixels are of about the same size there.
struct Sight {
  std::uint32_t group = 0, view = 0;
  float u = 0, v = 0;  // in the photo, fractions of its width and height
  double step_px = 1;   // a pixel of the coarsest of the group, in pixels of the photo's level 0
  double log_ratio = NAN;
  double fine_to_noise = 0;

  std::size_t Cell() const {
    const auto index = [](float share, int count) { return std::clamp(static_cast<int>(share * static_cast<float>(count)), 0, count - 1); };
    return static_cast<std::size_t>(index(v, kRows) * kColumns + index(u, kColumns));
  }
};
constexpr std::size_t kCells = static_cast<std::size_t>(kColumns) * kRows;

// A photo's view of a point: how large its pixels are there, and from where it looks.
struct Look {
  Sight sight;
  double pixel_size = 1;                               // world units; without a metric all count as equal
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // unit
};

Look LookAtPoint(const Scene& scene, const Point& point, const Observation& o, const std::vector<double>& shrunk) {
  const auto v = static_cast<std::size_t>(o.view.value);
  const View& view = scene.views[v];
  const Eigen::Vector2d x = o.x_px.cwiseQuotient(SizePx(scene, view).cast<double>());
  Look look;
  look.sight.view = static_cast<std::uint32_t>(v);
  look.sight.u = static_cast<float>(x.x());
  look.sight.v = static_cast<float>(x.y());
  look.pixel_size = shrunk[v];
  if (scene.frame == Frame::kMetric) {
    look.pixel_size *= (view.cam_from_world * point.x_in_world).z() / scene.CameraOf(view).FocalPx().mean();
    look.direction = (point.x_in_world - view.CentreInWorld()).normalized();
  }
  return look;
}

// Splits a track into groups that can be compared, beginning with the coarsest photo that is left.
void AppendGroups(std::vector<Look>& track, std::size_t& groups, std::vector<Sight>& sights, std::vector<int>& taken) {
  std::sort(track.begin(), track.end(), [](const Look& a, const Look& b) { return a.pixel_size > b.pixel_size; });
  while (track.size() >= 2) {
    const Look first = track[0];
    const auto comparable = [&](const Look& look) {
      return look.pixel_size * kSameScale >= first.pixel_size && (look.direction - first.direction).norm() <= kSameSideRad;
    };
    if (std::count_if(track.begin(), track.end(), comparable) >= 2) {
      for (const Look& look : track)
        if (comparable(look)) {
          sights.push_back(look.sight);
          sights.back().group = static_cast<std::uint32_t>(groups);
          sights.back().step_px = first.pixel_size / look.pixel_size;
          ++taken[look.sight.view];
        }
      ++groups;
    }
    std::erase_if(track, comparable);
  }
}

// Long tracks first: they tie most photos together. `shrunk`: how many pixels of each view's camera a pixel of its photo has.
std::vector<Sight> ChooseSights(const Scene& scene, const std::vector<double>& shrunk, std::size_t& groups) {
  std::vector<std::size_t> order(scene.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return scene.points[a].track.size() > scene.points[b].track.size(); });
  std::vector<int> taken(scene.views.size(), 0);
  std::vector<Sight> sights;
  std::vector<Look> track;
  groups = 0;
  for (const std::size_t p : order) {
    const Point& point = scene.points[p];
    const auto wanted = [&](const Observation& o) { return taken[static_cast<std::size_t>(o.view.value)] < kSightsAView; };
    if (std::none_of(point.track.begin(), point.track.end(), wanted)) continue;
    track.clear();
    for (const Observation& o : point.track) {
      const Look look = LookAtPoint(scene, point, o, shrunk);
      if (look.pixel_size > 0) track.push_back(look);
    }
    AppendGroups(track, groups, sights, taken);
  }
  return sights;
}

template <typename PhotoOf>
void MeasureSights(std::size_t views, const PhotoOf& photo_of, std::vector<Sight>& sights) {
  std::vector<std::vector<std::size_t>> of_view(views);
  for (std::size_t i = 0; i < sights.size(); ++i) of_view[sights[i].view].push_back(i);
  ParallelFor(views, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      photo_of(v, [&](const Photo& photo) {
        if (photo.levels.empty() || of_view[v].empty()) return;
        const Image8& image = photo.levels[0];
        const double noise = NoiseSigma(image);
        for (const std::size_t i : of_view[v]) {
          Sight& s = sights[i];
          const auto detail = MeasureFineDetail(image, static_cast<double>(s.u) * image.width, static_cast<double>(s.v) * image.height, s.step_px, noise);
          if (!detail) continue;
          s.log_ratio = detail->log_ratio;
          s.fine_to_noise = detail->fine_to_noise;
        }
      });
  });
}

// Leaves the sights that say something: measured, in groups of two and more of which one at least shows texture.
void DropPlainGroups(std::size_t groups, std::vector<Sight>& sights) {
  std::vector<int> count(groups, 0);
  std::vector<double> texture(groups, 0.0);
  for (const Sight& s : sights) {
    if (std::isnan(s.log_ratio)) continue;
    ++count[s.group];
    texture[s.group] = std::max(texture[s.group], s.fine_to_noise);
  }
  std::erase_if(sights, [&](const Sight& s) { return std::isnan(s.log_ratio) || count[s.group] < 2 || texture[s.group] < kTexture; });
}

// log_ratio = a_point + b_photo + c_cell, and how well the sum of the last two is known (one standard deviation).
struct CellFit {
  std::vector<double> photo_weight;  // sights
  std::vector<double> b, error;      // one a cell of each photo
};

CellFit FitCells(const std::vector<Sight>& sights, std::size_t groups, std::size_t views) {
  std::vector<PhotoSample> samples;
  for (const Sight& s : sights) samples.push_back({s.group, s.view, s.log_ratio});
  const PointPhotoFit photos = FitPointsAndPhotos(samples, groups, views, {kHuber});
  for (std::size_t i = 0; i < sights.size(); ++i) {
    samples[i].log_value -= photos.log_photo[sights[i].view];
    samples[i].photo = sights[i].view * kCells + sights[i].Cell();
  }
  const PointPhotoFit cells = FitPointsAndPhotos(samples, groups, views * kCells, {kHuber, kCellPrior});
  const double weight = std::accumulate(photos.weight_sum.begin(), photos.weight_sum.end(), 0.0);
  const double variance = std::accumulate(photos.square_sum.begin(), photos.square_sum.end(), 0.0) / std::max(1.0, weight);
  CellFit fit{photos.weight_sum, {}, {}};
  for (std::size_t v = 0; v < views; ++v)
    for (std::size_t c = v * kCells; c < (v + 1) * kCells; ++c) {
      fit.b.push_back(photos.log_photo[v] + cells.log_photo[c]);
      fit.error.push_back(std::sqrt(variance / (cells.weight_sum[c] + kCellPrior)));
    }
  return fit;
}

Sharpness Estimate(std::size_t views, std::size_t groups, std::vector<Sight> sights) {
  Sharpness out;
  out.grid.assign(views, {kColumns, kRows, std::vector<float>(kCells, 1.0F)});
  out.of_photo.assign(views, 1.0);
  DropPlainGroups(groups, sights);
  if (sights.empty()) return out;
  const CellFit fit = FitCells(sights, groups, views);

  // The sharpest of each group, as far as that is sure: the largest of many that are known badly would be too large.
  std::vector<double> sharpest(groups, -INFINITY);
  for (const Sight& s : sights) {
    const std::size_t c = s.view * kCells + s.Cell();
    if (fit.photo_weight[s.view] >= kEnough) sharpest[s.group] = std::max(sharpest[s.group], fit.b[c] - fit.error[c]);
  }
  std::vector<double> sum(views * kCells, 0.0), count(views * kCells, 0.0);
  for (const Sight& s : sights) {
    const std::size_t c = s.view * kCells + s.Cell();
    if (!(fit.photo_weight[s.view] >= kEnough)) continue;
    sum[c] += fit.b[c] - sharpest[s.group];
    ++count[c];
  }
  std::vector<double> unsharp;
  double known = 0;
  for (std::size_t v = 0; v < views; ++v) {
    const auto first = static_cast<std::ptrdiff_t>(v * kCells);
    const double n = std::accumulate(count.begin() + first, count.begin() + first + kCells, 0.0);
    if (n == 0) continue;
    ++known;
    const double mean = std::accumulate(sum.begin() + first, sum.begin() + first + kCells, 0.0) / n;
    const auto value = [](double log_share) { return std::exp(std::min(0.0, log_share + kAlike)); };
    out.of_photo[v] = value(mean);
    if (mean < -kClearly) unsharp.push_back(out.of_photo[v]);
    for (std::size_t c = 0; c < kCells; ++c) {
      const std::size_t i = v * kCells + c;
      out.grid[v].value[c] = static_cast<float>(value((sum[i] + kCellPrior * mean) / (count[i] + kCellPrior)));
    }
  }
  if (unsharp.empty()) return out;
  out.share = static_cast<double>(unsharp.size()) / known;
  std::nth_element(unsharp.begin(), unsharp.begin() + static_cast<std::ptrdiff_t>(unsharp.size() / 2), unsharp.end());
  out.typical = unsharp[unsharp.size() / 2];
  return out;
}

template <typename PhotoOf>
Sharpness Estimate(const Scene& scene, const std::vector<double>& shrunk, const PhotoOf& photo_of) {
  std::size_t groups = 0;
  std::vector<Sight> sights = ChooseSights(scene, shrunk, groups);
  MeasureSights(scene.views.size(), photo_of, sights);
  return Estimate(scene.views.size(), groups, std::move(sights));
}

}  // namespace

float PhotoGrid::At(float u, float v) const {
  const auto place = [](float share, int count) { return std::clamp(share * static_cast<float>(count) - 0.5F, 0.0F, static_cast<float>(count - 1)); };
  const float x = place(u, columns), y = place(v, rows);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y), x1 = std::min(x0 + 1, columns - 1), y1 = std::min(y0 + 1, rows - 1);
  const float a = x - static_cast<float>(x0), b = y - static_cast<float>(y0);
  const auto at = [&](int column, int row) { return value[static_cast<std::size_t>(row * columns + column)]; };
  return (1 - b) * ((1 - a) * at(x0, y0) + a * at(x1, y0)) + b * ((1 - a) * at(x0, y1) + a * at(x1, y1));
}

Sharpness EstimateSharpness(const Scene& scene, const std::vector<Photo>& photos) {
  std::vector<double> shrunk(scene.views.size(), 1.0);
  for (std::size_t v = 0; v < shrunk.size(); ++v)
    if (!photos[v].levels.empty()) shrunk[v] = static_cast<double>(SizePx(scene, scene.views[v]).x()) / photos[v].levels[0].width;
  return Estimate(scene, shrunk, [&](std::size_t v, auto&& measure) { measure(photos[v]); });
}

Sharpness EstimateSharpness(const Scene& scene, ProgressSink& sink) {
  Progress progress(sink, "reading sharpness", static_cast<long>(scene.views.size()));
  PhotoOptions options;
  options.pyramids = false;
  return Estimate(scene, std::vector<double>(scene.views.size(), 1.0), [&](std::size_t v, auto&& measure) {
    measure(LoadPhoto(scene, {static_cast<std::int32_t>(v)}, options));
    progress.Step();
  });
}

}  // namespace lumi
