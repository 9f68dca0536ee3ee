#include "render/effects/sharpness.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include "render/effects/fine_detail.h"
#include "render/effects/point_photo_fit.h"
#include "render/radiance/measures/sharpness.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kGridColumns = 6, kGridRows = 4;
constexpr int kSightsAView = 400;
constexpr std::ptrdiff_t kCompared = 4;  // of each group measured at least, even if its photos have enough sights
// Photos are not compared at a point if their pixel sizes there differ by more than this factor, or their directions by
// more than this angle (foreshortening, gloss).
constexpr double kSameScale = 2.2, kSameSideRad = 0.35;
constexpr double kFineToNoise = 4;    // fine detail over noise, of the photo that shows most of it
constexpr double kDetailHuber = 1;    // log units: occlusions and highlights lie beyond
constexpr double kCellPrior = 8;      // sights: with this many, a cell's own value counts half
constexpr double kEnoughSights = 20;  // sights: fewer say nothing of a photo
// Log units: differences between equally sharp photos, and a difference that is clearly larger (a third of the energy).
constexpr double kAlike = 0.12, kClearly = 0.4;
// Log units: contrast (exposure, haze, gloss) may reduce fine detail by this much; a larger deficit is blur.
constexpr double kContrast = 1.5;

// A point seen by a photo, among photos from about the same side whose pixels are of about the same size there.
struct Sight {
  std::uint32_t group = 0, view = 0;
  float u = 0, v = 0;  // in the photo, fractions of its width and height
  double step_px = 1;  // pixel size of the group's coarsest photo, in pixels of this photo's level 0
  bool wanted = true;  // to be measured; the group's other sights are not
  std::optional<FineDetail> detail;

  std::size_t Cell() const {
    const auto index = [](float share, int count) {
      return std::clamp(static_cast<int>(share * static_cast<float>(count)), 0, count - 1);
    };
    return static_cast<std::size_t>(index(v, kGridRows) * kGridColumns + index(u, kGridColumns));
  }
};
constexpr std::size_t kGridCells = static_cast<std::size_t>(kGridColumns) * kGridRows;

// A photo's view of a point: how large its pixels are there, and from where it looks.
struct Viewing {
  Sight sight;
  double pixel_size = 1;                                // world units; without a metric all count as equal
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  // unit
};

Viewing ViewPoint(const Scene& scene, const Point& point, const Observation& o, const std::vector<double>& shrunk) {
  const auto v = static_cast<std::size_t>(o.view.value);
  const View& view = scene.views[v];
  const Eigen::Vector2d x = o.x_px.cwiseQuotient(SizePx(scene, view).cast<double>());
  Viewing viewing;
  viewing.sight.view = static_cast<std::uint32_t>(v);
  viewing.sight.u = static_cast<float>(x.x());
  viewing.sight.v = static_cast<float>(x.y());
  viewing.pixel_size = shrunk[v];
  if (scene.frame == Frame::kMetric) {
    viewing.pixel_size *= (view.cam_from_world * point.x_in_world).z() / scene.CameraOf(view).FocalPx().mean();
    viewing.direction = (point.x_in_world - view.CentreInWorld()).normalized();
  }
  return viewing;
}

// Splits a track into groups that can be compared, beginning with the coarsest photo that is left.
void AppendGroups(std::vector<Viewing>& track, std::size_t& groups, std::vector<Sight>& sights,
                  std::vector<int>& taken) {
  std::sort(track.begin(), track.end(), [](const Viewing& a, const Viewing& b) { return a.pixel_size > b.pixel_size; });
  while (track.size() >= 2) {
    const Viewing first = track[0];
    const auto comparable = [&](const Viewing& viewing) {
      return viewing.pixel_size * kSameScale >= first.pixel_size &&
             (viewing.direction - first.direction).norm() <= kSameSideRad;
    };
    if (std::count_if(track.begin(), track.end(), comparable) >= 2) {
      const auto begin = static_cast<std::ptrdiff_t>(sights.size());
      for (const Viewing& viewing : track)
        if (comparable(viewing)) {
          sights.push_back(viewing.sight);
          sights.back().group = static_cast<std::uint32_t>(groups);
          sights.back().step_px = first.pixel_size / viewing.pixel_size;
        }
      ++groups;
      // The photos with the fewest sights so far are measured.
      std::stable_sort(sights.begin() + begin, sights.end(),
                       [&](const Sight& x, const Sight& y) { return taken[x.view] < taken[y.view]; });
      for (auto s = sights.begin() + begin; s != sights.end(); ++s) {
        s->wanted = s - sights.begin() - begin < kCompared || taken[s->view] < kSightsAView;
        if (s->wanted) ++taken[s->view];
      }
    }
    std::erase_if(track, comparable);
  }
}

// Long tracks first: they tie most photos together. `shrunk`: how many pixels of each view's camera a pixel of its
// photo has.
std::vector<Sight> ChooseSights(const Scene& scene, const std::vector<double>& shrunk, std::size_t& groups) {
  std::vector<std::size_t> order(scene.points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return scene.points[a].track.size() > scene.points[b].track.size();
  });
  std::vector<int> taken(scene.views.size(), 0);
  std::vector<Sight> sights;
  std::vector<Viewing> track;
  groups = 0;
  for (const std::size_t p : order) {
    const Point& point = scene.points[p];
    const auto wanted = [&](const Observation& o) {
      return taken[static_cast<std::size_t>(o.view.value)] < kSightsAView;
    };
    if (std::none_of(point.track.begin(), point.track.end(), wanted)) continue;
    track.clear();
    for (const Observation& o : point.track) {
      const Viewing viewing = ViewPoint(scene, point, o, shrunk);
      if (viewing.pixel_size > 0) track.push_back(viewing);
    }
    AppendGroups(track, groups, sights, taken);
  }
  return sights;
}

template <typename PhotoOf>
void MeasureSights(std::size_t views, const PhotoOf& photo_of, std::vector<Sight>& sights) {
  std::vector<std::vector<std::size_t>> of_view(views);
  for (std::size_t i = 0; i < sights.size(); ++i)
    if (sights[i].wanted) of_view[sights[i].view].push_back(i);
  ParallelFor(views, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v)
      photo_of(v, [&](const Photo& photo) {
        if (photo.levels.empty() || of_view[v].empty()) return;
        const Image8& image = photo.levels[0];
        const double noise = NoiseSigma(image);
        for (const std::size_t i : of_view[v]) {
          Sight& s = sights[i];
          s.detail = MeasureFineDetail(image, static_cast<double>(s.u) * image.width,
                                       static_cast<double>(s.v) * image.height, s.step_px, noise);
        }
      });
  });
}

// Keeps only useful groups: at least two measured sights, of which at least one shows texture.
void DropPlainGroups(std::size_t groups, std::vector<Sight>& sights) {
  std::vector<int> count(groups, 0);
  std::vector<double> texture(groups, 0.0);
  for (const Sight& s : sights) {
    if (!s.detail) continue;
    ++count[s.group];
    texture[s.group] = std::max(texture[s.group], s.detail->fine_to_noise);
  }
  std::erase_if(sights, [&](const Sight& s) { return count[s.group] < 2 || texture[s.group] < kFineToNoise; });
}

// A measure of the sights = a_point + b_photo + c_cell, and how well the sum of the last two is known (one standard
// deviation).
struct CellFit {
  std::vector<double> photo_weight;  // sights
  double spread = 0;                 // of one sight, one standard deviation
  std::vector<double> b, error;      // one a cell of each photo
};

using DetailMeasure = double FineDetail::*;

CellFit FitCells(const std::vector<Sight>& sights, DetailMeasure measure, std::size_t groups, std::size_t views) {
  std::vector<PhotoSample> samples;
  std::vector<std::size_t> cell_of;
  for (const Sight& s : sights) {
    if (!s.detail) continue;
    samples.push_back({s.group, s.view, *s.detail.*measure});
    cell_of.push_back(s.view * kGridCells + s.Cell());
  }
  const PointPhotoFit photos = FitPointsAndPhotos(samples, groups, views, {kDetailHuber});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    samples[i].log_value -= photos.log_photo[samples[i].photo];
    samples[i].photo = cell_of[i];
  }
  const PointPhotoFit cells = FitPointsAndPhotos(samples, groups, views * kGridCells, {kDetailHuber, kCellPrior});
  const double weight = std::accumulate(photos.weight_sum.begin(), photos.weight_sum.end(), 0.0);
  const double variance =
      std::accumulate(photos.square_sum.begin(), photos.square_sum.end(), 0.0) / std::max(1.0, weight);
  CellFit fit{photos.weight_sum, std::sqrt(variance), {}, {}};
  for (std::size_t v = 0; v < views; ++v)
    for (std::size_t c = v * kGridCells; c < (v + 1) * kGridCells; ++c) {
      fit.b.push_back(photos.log_photo[v] + cells.log_photo[c]);
      fit.error.push_back(std::sqrt(variance / (cells.weight_sum[c] + kCellPrior)));
    }
  return fit;
}

// How much less fine detail photos have than the sharpest ones at the same points, log units; 0 where unknown.
struct Deficit {
  std::vector<double> photo, photo_error;
  std::vector<double> cell;
  std::vector<bool> known;
};

Deficit FindDeficit(const std::vector<Sight>& sights, DetailMeasure measure, std::size_t groups, std::size_t views) {
  const CellFit fit = FitCells(sights, measure, groups, views);
  // The sharpest of each group, less its error: the maximum of many uncertain values would be too large.
  std::vector<double> sharpest(groups, -INFINITY), sum(views * kGridCells, 0.0), count(views * kGridCells, 0.0);
  for (const Sight& s : sights) {
    const std::size_t c = s.view * kGridCells + s.Cell();
    if (fit.photo_weight[s.view] >= kEnoughSights)
      sharpest[s.group] = std::max(sharpest[s.group], fit.b[c] - fit.error[c]);
  }
  for (const Sight& s : sights) {
    const std::size_t c = s.view * kGridCells + s.Cell();
    if (!(fit.photo_weight[s.view] >= kEnoughSights)) continue;
    sum[c] += sharpest[s.group] - fit.b[c];
    ++count[c];
  }
  Deficit out{std::vector<double>(views, 0.0), std::vector<double>(views, 0.0),
              std::vector<double>(views * kGridCells, 0.0), std::vector<bool>(views, false)};
  for (std::size_t v = 0; v < views; ++v) {
    const auto first = static_cast<std::ptrdiff_t>(v * kGridCells),
               last = first + static_cast<std::ptrdiff_t>(kGridCells);
    const double n = std::accumulate(count.begin() + first, count.begin() + last, 0.0);
    if (n == 0) continue;
    out.known[v] = true;
    out.photo[v] = std::accumulate(sum.begin() + first, sum.begin() + last, 0.0) / n;
    out.photo_error[v] = fit.spread / std::sqrt(fit.photo_weight[v]);
    for (std::size_t c = v * kGridCells; c < (v + 1) * kGridCells; ++c)
      out.cell[c] = (sum[c] + kCellPrior * out.photo[v]) / (count[c] + kCellPrior);
  }
  return out;
}

Sharpness CompareSights(std::size_t views, std::size_t groups, std::vector<Sight> sights) {
  Sharpness out;
  out.grid.assign(views, {kGridColumns, kGridRows, std::vector<float>(kGridCells, 1.0F)});
  out.of_photo.assign(views, 1.0);
  DropPlainGroups(groups, sights);
  if (sights.empty()) return out;
  const Deficit ratio = FindDeficit(sights, &FineDetail::log_ratio, groups, views),
                fine = FindDeficit(sights, &FineDetail::log_fine, groups, views);
  // Strong blur removes coarse detail, too, which the ratio does not show: the deficit of fine detail then decides.
  const auto worse = [](double by_ratio, double by_fine) { return std::max(by_ratio, by_fine - kContrast); };
  const auto value = [](double deficit) { return std::exp(-std::max(0.0, deficit - kAlike)); };
  std::vector<double> unsharp;
  for (std::size_t v = 0; v < views; ++v) {
    const double deficit = worse(ratio.photo[v], fine.photo[v]);
    out.of_photo[v] = value(deficit);
    if (deficit - 2 * ratio.photo_error[v] > kClearly) unsharp.push_back(out.of_photo[v]);
    for (std::size_t c = 0; c < kGridCells; ++c)
      out.grid[v].value[c] =
          static_cast<float>(value(worse(ratio.cell[v * kGridCells + c], fine.cell[v * kGridCells + c])));
  }
  if (unsharp.empty()) return out;
  out.share = static_cast<double>(unsharp.size()) /
              static_cast<double>(std::count(ratio.known.begin(), ratio.known.end(), true));
  const auto middle = unsharp.begin() + static_cast<std::ptrdiff_t>(unsharp.size() / 2);
  std::nth_element(unsharp.begin(), middle, unsharp.end());
  out.typical = *middle;
  return out;
}

template <typename PhotoOf>
Sharpness MeasureAndCompare(const Scene& scene, const std::vector<double>& shrunk, const PhotoOf& photo_of) {
  std::size_t groups = 0;
  std::vector<Sight> sights = ChooseSights(scene, shrunk, groups);
  MeasureSights(scene.views.size(), photo_of, sights);
  return CompareSights(scene.views.size(), groups, std::move(sights));
}

}  // namespace

Sharpness EstimateSharpness(const Scene& scene, const std::vector<Photo>& photos) {
  std::vector<double> shrunk(scene.views.size(), 1.0);
  for (std::size_t v = 0; v < shrunk.size(); ++v)
    if (!photos[v].levels.empty())
      shrunk[v] = static_cast<double>(SizePx(scene, scene.views[v]).x()) / photos[v].levels[0].width;
  return MeasureAndCompare(scene, shrunk, [&](std::size_t v, auto&& measure) { measure(photos[v]); });
}

Sharpness EstimateSharpness(const Scene& scene, ProgressSink& sink) {
  Progress progress(sink, "reading sharpness", static_cast<long>(scene.views.size()));
  PhotoOptions options;
  options.pyramids = false;
  return MeasureAndCompare(scene, std::vector<double>(scene.views.size(), 1.0), [&](std::size_t v, auto&& measure) {
    measure(LoadPhoto(scene, {static_cast<std::int32_t>(v)}, options));
    progress.Step();
  });
}

std::vector<PhotoGrid> measure::Sharpness::Estimate(const Scene& scene, const std::vector<Photo>* photos,
                                                    ProgressSink& sink) {
  lumi::Sharpness found = photos ? EstimateSharpness(scene, *photos) : EstimateSharpness(scene, sink);
  return found.Differ() ? std::move(found.grid) : std::vector<PhotoGrid>();
}

}  // namespace lumi
