#include "render/holdout/holdout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/holdout/seen_pixels.h"
#include "render/picture/convert.h"
#include "render/picture/output_name.h"
#include "render/radiance/measures/time.h"
#include "render/time/clock.h"
#include "render/world/vanishing_point.h"
#include "scene/files/evaluation_proxy.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/median.h"
#include "scene/image_difference/image_difference.h"
#include "scene/model/photo_twins.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {

namespace {

// What a photo's difference in time adds to its distance.
double TimeTerm(const View& wanted, const View& v, const RadianceSettings& settings) {
  if (!settings.time || !v.time_s || !wanted.time_s) return 0;
  double dt = *v.time_s - *wanted.time_s;
  if (settings.period_s > 0) dt = std::remainder(dt, settings.period_s);
  const TimeShape shape = {.inverse_half_window = static_cast<float>(2 / settings.time_window_s),
                           .core = static_cast<float>(settings.time_core),
                           .least = static_cast<float>(settings.time_least)};
  return settings.epsilon * 2 * settings.r_max_rad *
         static_cast<double>(TimeDissimilarity(static_cast<float>(dt), shape));
}

// For scenes without distances: takes them in the world of the view's own vanishing points, in which the points it sees
// have a median depth of 1.
ViewId NearestByVanishingPoints(const Scene& scene, ViewId view, const std::vector<bool>& use,
                                const RadianceSettings& settings) {
  ViewId best;  // the nearest in the order of names, if nothing else is known
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(use.size()); ++i)
    if (use[static_cast<std::size_t>(i)] &&
        (best.value < 0 || std::abs(i - view.value) < std::abs(best.value - view.value)))
      best = {i};
  const auto plane = PlaneAtInfinity(scene);
  if (!plane) return best;
  const View& wanted = scene.views[static_cast<std::size_t>(view.value)];
  std::vector<double> kappas;
  for (const Point& p : scene.points)
    for (const Observation& o : p.track)
      if (o.view == view) kappas.push_back(plane->dot(p.X_in_world) / wanted.P.row(2).dot(p.X_in_world));
  const double kappa = Median(kappas);
  const auto frame =
      VanishingPointFrame::Make(wanted.P, kappa < 0 ? Plane(-*plane) : *plane,
                                NominalCalibration(wanted.size_px, NominalFocalPx(wanted.size_px)), std::abs(kappa));
  if (!frame) return best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (!use[i]) continue;
    const auto moved = frame->MoveCamera(scene.views[i].P);
    if (!moved) continue;
    const double distance = std::atan2(moved->centre.norm(), 1.0) +
                            AngleBetween(Eigen::Vector3d(moved->P.row(2).head<3>()), Eigen::Vector3d(0, 0, 1)) +
                            TimeTerm(wanted, scene.views[i], settings);
    if (distance < least) {
      best = {static_cast<std::int32_t>(i)};
      least = distance;
    }
  }
  return best;
}

}  // namespace

ViewId NearestPhoto(const Scene& scene, ViewId view, const std::vector<bool>& use, const RadianceSettings& settings) {
  if (scene.frame != Frame::kMetric) return NearestByVanishingPoints(scene, view, use, settings);
  const auto& wanted = scene.views[static_cast<std::size_t>(view.value)];
  const std::vector<double> depths = PointDepths(scene, view);
  const double depth = depths.empty() ? 1.0 / scene.normalized_from_world.scale : depths[depths.size() / 2];
  ViewId best;
  double least = 0;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (!use[i]) continue;
    const View& v = scene.views[i];
    const double baseline = (v.CentreInWorld() - wanted.CentreInWorld()).norm();
    const Eigen::Vector3d a = v.cam_from_world.R().row(2), b = wanted.cam_from_world.R().row(2);
    const double distance = std::atan2(baseline, depth) + AngleBetween(a, b) + TimeTerm(wanted, v, settings);
    if (best.value < 0 || distance < least) {
      best = {static_cast<std::int32_t>(i)};
      least = distance;
    }
  }
  return best;
}

RenderView PhotosView(const Scene& scene, const View& view, const Eigen::Vector2i& size_px) {
  RenderView v;
  if (scene.frame == Frame::kMetric) {
    const Camera& camera = scene.CameraOf(view);
    v = MakeRenderView(size_px == SizePx(scene, view) ? camera : camera.Scaled(size_px.x(), size_px.y()),
                       view.cam_from_world);
  } else {
    v.P = view.P;
    v.P.row(0) *= static_cast<double>(size_px.x()) / view.size_px.x();
    v.P.row(1) *= static_cast<double>(size_px.y()) / view.size_px.y();
    v.size_px = size_px;
  }
  v.time_s = view.time_s;
  // A held-out photo's colour correction counts as known, as its pose does.
  v.gain = view.gain;
  v.correction = view.correction;
  return v;
}

RenderView HeldOutView(const Scene& scene, const View& view, int width_px) {
  Eigen::Vector2i size = SizePx(scene, view);
  if (width_px > 0 && width_px < size.x())
    size = {width_px, std::max(1, static_cast<int>(std::lround(static_cast<double>(size.y()) * width_px / size.x())))};
  return PhotosView(scene, view, size);
}

namespace {

// The object's pixels at the size of the render; empty: the scene has no silhouette of this photo.
Image8 ObjectMask(const Scene& scene, const View& view, Eigen::Vector2i size_px) {
  const std::filesystem::path file =
      scene.folder.empty() ? std::filesystem::path() : FindMask(scene.folder / "silhouettes", view.name);
  if (file.empty()) return {};
  const Image8 rgb = Resize(ReadImage8(file, 3), size_px.x(), size_px.y());
  Image8 mask(rgb.width, rgb.height, 1);
  for (std::size_t p = 0; p < mask.data.size(); ++p) mask.data[p] = rgb.data[3 * p];
  return mask;
}

// Masks of the pixels for further figures; empty: no such figures.
struct HoldoutMasks {
  Image8 object, seen;
};

HoldoutScore Score(const ImageF& image, const Image8& rendered, const Image8& photo, const HoldoutMasks& masks) {
  const ImageDifference d = Compare(rendered, photo);
  HoldoutScore score{d.psnr_db, d.ssim, Coverage(image)};
  if (!masks.object.empty()) score.psnr_object_db = PsnrWithin(rendered, photo, masks.object);
  if (!masks.seen.empty()) score.psnr_seen_db = PsnrWithin(rendered, photo, masks.seen);
  return score;
}

// The mean of the values that exist.
class MeanOfSome {
 public:
  void Add(const std::optional<double>& value) {
    if (value) sum_ += *value, ++count_;
  }
  std::optional<double> Value() const { return count_ > 0 ? std::optional(sum_ / count_) : std::nullopt; }

 private:
  double sum_ = 0, count_ = 0;
};

template <typename ScoreOf>
HoldoutScore Mean(const std::vector<HoldoutView>& views, const ScoreOf& score_of) {
  HoldoutScore mean;
  MeanOfSome object, seen;
  for (const HoldoutView& v : views) {
    const HoldoutScore& score = score_of(v);
    const double n = static_cast<double>(views.size());
    mean.psnr_db += score.psnr_db / n;
    mean.ssim += score.ssim / n;
    mean.coverage += score.coverage / n;
    object.Add(score.psnr_object_db);
    seen.Add(score.psnr_seen_db);
  }
  mean.psnr_object_db = object.Value();
  mean.psnr_seen_db = seen.Value();
  return mean;
}

}  // namespace

DesiredViews LeaveOut(const Scene& scene, int n, Fold fold, int width_px) {
  DesiredViews wanted{{}, std::vector<bool>(scene.views.size(), true)};
  if (n == kHoldoutEach) n = kProxiesForEach;
  for (const ViewId id : FoldViews(scene, n, fold)) {
    wanted.use[static_cast<std::size_t>(id.value)] = false;
    wanted.views.push_back(HeldOutView(scene, scene.views[static_cast<std::size_t>(id.value)], width_px));
  }
  PhotoTwins(scene).LeaveOut(wanted.use);
  if (std::count(wanted.use.begin(), wanted.use.end(), true) == 0) wanted.use.clear();
  return wanted;
}

std::vector<bool> PhotosWithout(const Scene& scene, int n, Fold fold) {
  std::vector<bool> use(scene.views.size(), true);
  const PhotoTwins twins(scene);
  const auto exclude = [&](Fold which, std::vector<bool>& from) {
    for (const ViewId id : FoldViews(scene, n, which)) from[static_cast<std::size_t>(id.value)] = false;
    twins.LeaveOut(from);
  };
  exclude(fold, use);
  if (fold == Fold::kChoose) {
    std::vector<bool> strict = use;
    exclude(Fold::kReport, strict);
    if (2 * std::count(strict.begin(), strict.end(), true) >= static_cast<std::ptrdiff_t>(use.size())) use = strict;
  }
  if (std::count(use.begin(), use.end(), true) == 0)
    throw DataError("every photo is held out", "raise --holdout", scene.folder);
  return use;
}

namespace {

// A photo that is held out, and those that it is rendered from.
struct HeldOutPhoto {
  ViewId id;
  std::vector<bool> use;
};

std::vector<HeldOutPhoto> PhotosHeldOut(const Scene& scene, const HoldoutOptions& options) {
  std::vector<HeldOutPhoto> photos;
  const auto count = static_cast<std::int32_t>(scene.views.size());
  if (options.n == kHoldoutEach) {
    const PhotoTwins twins(scene);
    for (std::int32_t k = 0; count > 1 && k < kProxiesForEach; ++k)
      for (std::int32_t i = k; i < count; i += kProxiesForEach) {
        photos.push_back({{i}, std::vector<bool>(scene.views.size(), true)});
        photos.back().use[static_cast<std::size_t>(i)] = false;
        twins.LeaveOut(photos.back().use);
      }
  } else if (count > 1) {
    const std::vector<ViewId> ids = FoldViews(scene, options.n, options.fold);
    if (!ids.empty()) {
      const std::vector<bool> use = PhotosWithout(scene, options.n, options.fold);
      for (const ViewId id : ids) photos.push_back({id, use});
    }
  }
  if (photos.empty())
    throw DataError("too few photos to hold any out: " + std::to_string(scene.views.size()),
                    "lower --holdout, or add photos");
  return photos;
}

// Photos that are held out because they are twins of one that is.
int CountTwins(const Scene& scene, const HoldoutOptions& options) {
  const PhotoTwins twins(scene);
  std::vector<bool> keep(scene.views.size(), true);
  if (options.n != kHoldoutEach) {
    for (const ViewId id : FoldViews(scene, options.n, options.fold)) keep[static_cast<std::size_t>(id.value)] = false;
    return twins.LeaveOut(keep);
  }
  int count = 0;
  for (std::size_t v = 0; v < keep.size(); ++v) {
    keep.assign(keep.size(), true);
    keep[v] = false;
    count += twins.LeaveOut(keep) > 0 ? 1 : 0;
  }
  return count;
}

class HoldoutEvaluation {
 public:
  HoldoutEvaluation(const Scene& scene, const HoldoutOptions& options) : scene_(scene), options_(options) {}

  void Add(const HeldOutPhoto& held_out, const HoldoutRenderer& with) {
    const View& view = scene_.views[static_cast<std::size_t>(held_out.id.value)];
    RenderRequest request;
    request.view = HeldOutView(scene_, view, options_.width_px);
    const Image8 photo =
        Resize(ReadImage8(scene_.ImagePath(view), 3), request.view.size_px.x(), request.view.size_px.y());
    request.settings = options_.own_times ? AtTimeOf(options_.settings, request.view) : options_.settings;
    request.use = held_out.use;
    const Stopwatch watch;
    const ImageF image = with.renderer->Render(request);
    const double ms = 1000 * watch.Seconds();
    const RenderStatistics statistics = with.renderer->Statistics();
    summary_.samples += statistics.samples;
    summary_.optimum += statistics.optimum;
    summary_.halved = std::max(summary_.halved, statistics.halved);
    HoldoutMasks masks{ObjectMask(scene_, view, request.view.size_px), {}};
    if (with.seen) masks.seen = with.seen(request.view, request.use);
    const Image8 rendered = ToRgb8(image);
    const ViewId nearest = NearestPhoto(scene_, held_out.id, held_out.use, request.settings);
    request.use.assign(scene_.views.size(), false);
    request.use[static_cast<std::size_t>(nearest.value)] = true;
    request.settings.method = Algorithm::kUlr;
    request.settings.k = 1;
    const ImageF baseline = with.renderer->Render(request);
    HoldoutView& v = summary_.views.emplace_back(HoldoutView{
        Score(image, rendered, photo, masks), held_out.id, view.name,
        scene_.views[static_cast<std::size_t>(nearest.value)].name, Score(baseline, ToRgb8(baseline), photo, masks),
        std::nullopt, ms, OutputName(scene_.views, view.name)});
    if (!masks.seen.empty()) v.seen = ShareOf(masks.seen);

    if (options_.folder.empty()) return;
    const std::string stem = v.file;
    WriteImage(options_.folder / (stem + kRenderEnding), rendered);
    WriteImage(options_.folder / (stem + kDifferenceEnding), DifferenceImage(rendered, photo));
  }

  HoldoutSummary Summary() {
    std::ranges::stable_sort(summary_.views, {}, &HoldoutView::photo);
    summary_.mean = Mean(summary_.views, [](const HoldoutView& v) -> const HoldoutScore& { return v; });
    summary_.nearest_mean = Mean(summary_.views, [](const HoldoutView& v) -> const HoldoutScore& { return v.nearest; });
    MeanOfSome seen;
    std::vector<double> times;
    for (const HoldoutView& v : summary_.views) {
      seen.Add(v.seen);
      times.push_back(v.ms);
    }
    summary_.seen = seen.Value();
    summary_.ms_per_frame = Median(times);
    return std::move(summary_);
  }

 private:
  const Scene& scene_;
  const HoldoutOptions& options_;
  HoldoutSummary summary_;
};

}  // namespace

HoldoutSummary EvaluateHoldout(const Scene& scene, const HoldoutRendererOf& renderer_of, const HoldoutOptions& options,
                               ProgressSink& sink) {
  const std::vector<HeldOutPhoto> photos = PhotosHeldOut(scene, options);
  HoldoutEvaluation evaluation(scene, options);
  if (const int twins = CountTwins(scene, options); twins > 0)
    sink.Message(
        fmt::format("{} photo{} taken from the place of a held-out one (copies, second shots): held out with it", twins,
                    twins == 1 ? " was" : "s were"));
  Progress progress(sink, "rendering held-out photos", static_cast<long>(photos.size()));
  for (const HeldOutPhoto& photo : photos) {
    evaluation.Add(photo, renderer_of(photo.id));
    progress.Step();
  }
  return evaluation.Summary();
}

HoldoutSummary EvaluateHoldout(const Scene& scene, Renderer& renderer, const HoldoutOptions& options,
                               ProgressSink& sink) {
  return EvaluateHoldout(
      scene, [&](ViewId) { return HoldoutRenderer{&renderer}; }, options, sink);
}

}  // namespace lumi
