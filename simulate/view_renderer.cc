#include "simulate/view_renderer.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>

#include "scene/model/orientation.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "simulate/noise.h"
#include "simulate/photo_response.h"

namespace lumi {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr int kBlurSamples = 16;  // at least, under motion blur: steps of a sixteenth of its length

// One over the side of a square of samples, each at the middle of its cell: a box filter without grain.
Vector2d SampleOffset(int sample, int side) { return {(sample % side + 0.5) / side, (sample / side + 0.5) / side}; }

// An order of sample times that has nothing to do with the samples' places in the pixel.
double TimeShare(int sample, int samples) {
  return (static_cast<double>((sample * 7 + 3) % samples) + 0.5) / samples - 0.5;
}

std::uint8_t CodeFromValue(double value) {
  return static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
}

}  // namespace

std::optional<Vector2d> NormalizedWithSkew(const Camera& camera, double skew_px, const Vector2d& x_px) {
  if (skew_px == 0) return camera.Normalized(x_px);
  // x = fx xd + s yd + cx, y = fy yd + cy: skew acts after the lens.
  const double yd = (x_px.y() - camera.PrincipalPointPx().y()) / camera.FocalPx().y();
  return camera.Normalized({x_px.x() - skew_px * yd, x_px.y()});
}

struct ViewRenderer::Moment {
  Eigen::Matrix3d world_from_cam;
  Vector3d centre;
  PartPoses parts;
};

ViewRenderer::ViewRenderer(const SceneDescription& scene, const Tracer& tracer, const Shader& shader, int width_px,
                           std::uint64_t seed, int sweep)
    : scene_(scene), tracer_(tracer), shader_(shader), seed_(seed) {
  if (width_px < 0 || width_px > 20000) throw UsageError("--width must be 1 to 20000 pixels");
  for (const CameraDescription& description : scene.cameras) {
    const Camera& camera = description.camera;
    const double scale = width_px == 0 ? 1.0 : static_cast<double>(width_px) / camera.width_px;
    const int height = std::max(1, static_cast<int>(std::lround(scale * camera.height_px)));
    cameras_.push_back(width_px == 0 ? camera : camera.Scaled(width_px, height));
    skews_px_.push_back(scene.effects.skew_px ? *scene.effects.skew_px * scale : 0.0);
  }
  if (tracer.HasMovingParts() && scene.period_s)
    for (int i = 0; i < sweep; ++i) sweep_.push_back(tracer.PartsAt(*scene.period_s * i / sweep));
}

TrueCamera ViewRenderer::CameraOf(const PlannedView& view) const {
  TrueCamera camera;
  camera.camera = cameras_[static_cast<std::size_t>(view.camera)];
  const double zoom = ZoomAt(scene_.paths[static_cast<std::size_t>(view.path)], view.frame);
  if (zoom != 1)
    camera.camera = camera.camera.WithPinhole(zoom * camera.camera.FocalPx(), camera.camera.PrincipalPointPx());
  camera.skew_px = skews_px_[static_cast<std::size_t>(view.camera)];
  camera.cam_from_world =
      StoredPose(PoseAt(scene_.paths[static_cast<std::size_t>(view.path)], view.frame), view.orientation);
  if (scene_.effects.exposure_stops)
    camera.gain = CodeGainFromStops(*scene_.effects.exposure_stops *
                                    std::sin(2 * std::numbers::pi * view.time_s / scene_.effects.exposure_period_s));
  if (scene_.effects.white_balance_stops) {
    const double red =
        CodeGainFromStops(*scene_.effects.white_balance_stops *
                          std::sin(2 * std::numbers::pi * view.time_s / scene_.effects.white_balance_period_s));
    camera.white_balance = {red, 1, 1 / red};
  }
  return camera;
}

ViewRenderer::Moment ViewRenderer::MomentAt(const PlannedView& view, double offset_s, TraceCounters& counters) const {
  ++counters.poses;
  const PathDescription& path = scene_.paths[static_cast<std::size_t>(view.path)];
  // Nobody films beyond the ends of the path.
  const double frame = offset_s == 0 ? view.frame : std::clamp(view.frame + offset_s * path.fps, 0.0, path.views - 1.0);
  const Rigid3 world_from_cam = StoredPose(PoseAt(path, frame), view.orientation).Inverse();
  Moment moment{world_from_cam.R(), world_from_cam.translation, {}};
  if (tracer_.HasMovingParts()) moment.parts = tracer_.PartsAt(view.time_s + offset_s);
  return moment;
}

std::uint8_t ViewRenderer::MovingAt(const Vector2d& x_px, const std::vector<Moment>& moments,
                                    const RayThrough& ray_through, long& rays) const {
  const auto shows_part = [&](const Moment& moment, const PartPoses& parts) {
    const auto ray = ray_through(moment, x_px);
    if (!ray) return false;
    ++rays;
    return tracer_.ShowsMovingPart(*ray, parts);
  };
  for (const Moment& moment : moments)
    if (shows_part(moment, moment.parts)) return 255;
  for (const PartPoses& parts : sweep_)
    if (shows_part(moments.back(), parts)) return 128;
  return 0;
}

double ViewRenderer::BlurSeconds(const PlannedView& view) const {
  return view.blurred ? scene_.effects.motion_blur_s.value_or(0) : 0;
}

std::array<double, 3> ViewRenderer::BlurPx(const PlannedView& view, const ImageF& depth) const {
  const double blur_s = BlurSeconds(view);
  if (blur_s == 0) return {};
  constexpr int kStep = 4;  // every fourth pixel of every fourth row
  const TrueCamera truth = CameraOf(view);
  TraceCounters unused;
  const Moment first = MomentAt(view, -0.5 * blur_s, unused), last = MomentAt(view, 0.5 * blur_s, unused);
  std::vector<double> px;
  for (int y = kStep / 2; y < depth.height; y += kStep)
    for (int x = kStep / 2; x < depth.width; x += kStep) {
      const auto direction = NormalizedWithSkew(truth.camera, truth.skew_px, Vector2d(x + 0.5, y + 0.5));
      const double z = static_cast<double>(depth.At(x, y, 0));
      if (!direction || !(z > 0)) continue;
      const Vector3d x_in_world = truth.cam_from_world.Inverse() * (z * direction->homogeneous());
      const auto at = [&](const Moment& m) {
        return truth.camera.Project(m.world_from_cam.transpose() * (x_in_world - m.centre));
      };
      const auto from = at(first), to = at(last);
      if (from && to) px.push_back((*to - *from).norm());
    }
  if (px.empty()) return {};
  std::ranges::sort(px);
  return {px[px.size() / 10], px[px.size() / 2], px[px.size() * 9 / 10]};
}

RenderedView ViewRenderer::Render(const PlannedView& view, TraceCounters& counters) const {
  const TrueCamera truth = CameraOf(view);
  const Camera& camera = truth.camera;
  const int width = camera.width_px, height = camera.height_px;
  const EffectsDescription& effects = scene_.effects;
  const double blur_s = BlurSeconds(view);
  const int samples = blur_s > 0 ? std::max(scene_.samples_per_pixel, kBlurSamples) : scene_.samples_per_pixel;
  const int side = static_cast<int>(std::lround(std::sqrt(samples)));
  // One sample stands for 1 / side of a pixel.
  const double sample_angle = 1 / (camera.FocalPx().maxCoeff() * side);

  RenderedView result;
  result.photo = Image8(width, height, 3);
  result.depth = ImageF(width, height, 1);
  result.silhouette = Image8(width, height, 1);
  if (tracer_.HasMovingParts()) result.moving = Image8(width, height, 1);

  // Moments of the samples of one row; last in line, the middle of the exposure.
  const auto moments_of_row = [&](double row_s, TraceCounters& count) {
    std::vector<Moment> moments;
    if (blur_s > 0)
      for (int s = 0; s < samples; ++s)
        moments.push_back(MomentAt(view, row_s + blur_s * TimeShare(s, samples), count));
    moments.push_back(MomentAt(view, row_s, count));
    return moments;
  };
  std::vector<Moment> of_view;
  if (!effects.rolling_shutter_s) of_view = moments_of_row(0, counters);

  const RayThrough ray_through = [&](const Moment& moment, const Vector2d& x_px) -> std::optional<Ray> {
    const auto x = NormalizedWithSkew(camera, truth.skew_px, x_px);
    if (!x) return std::nullopt;
    return Ray{moment.centre, (moment.world_from_cam * x->homogeneous()).normalized()};
  };

  const double corner2 = 0.25 * (static_cast<double>(width) * width + static_cast<double>(height) * height);
  const auto expose = [&](int x, int y, const Rgb& light, TraceCounters& count) {
    double lens = 1;
    if (effects.vignetting) {
      const double r2 = (Vector2d(x + 0.5, y + 0.5) - 0.5 * Vector2d(width, height)).squaredNorm() / corner2;
      lens = 1 - *effects.vignetting * r2;
    }
    for (int c = 0; c < 3; ++c) {
      double value = 255 * truth.gain * truth.white_balance[static_cast<std::size_t>(c)] *
                     static_cast<double>(CodeFromLight(static_cast<float>(lens) * light[c]));
      if (effects.noise_sigma) {
        ++count.noise_draws;
        HashStream random(seed_, static_cast<std::uint32_t>(view.frame_index),
                          static_cast<std::uint32_t>((y * width + x) * 3 + c));
        value += *effects.noise_sigma * random.Gaussian();
      }
      result.photo.At(x, y, c) = CodeFromValue(value);
    }
  };

  std::mutex mutex;
  ParallelFor(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
    CheckInterrupted();
    TraceCounters count;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      std::vector<Moment> of_row;
      if (effects.rolling_shutter_s)
        of_row = moments_of_row(*effects.rolling_shutter_s * ((y + 0.5) / height - 0.5), count);
      const std::vector<Moment>& moments = effects.rolling_shutter_s ? of_row : of_view;
      for (int x = 0; x < width; ++x) {
        Rgb sum = Rgb::Zero();
        for (int s = 0; s < samples; ++s) {
          const Moment& moment = moments.size() > 1 ? moments[static_cast<std::size_t>(s)] : moments.back();
          const auto ray = ray_through(moment, Vector2d(x, y) + SampleOffset(s, side));
          if (!ray) continue;
          Shader::Query query{*ray, sample_angle, s, samples, 0, &moment.parts};
          query.random = HashBits(static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(view.frame_index),
                                  static_cast<std::uint32_t>(y * width + x), static_cast<std::uint32_t>(s));
          sum += shader_.Radiance(query, count.rays);
        }
        expose(x, y, sum / static_cast<float>(samples), count);

        const Moment& middle = moments.back();
        const auto ray = ray_through(middle, Vector2d(x + 0.5, y + 0.5));
        if (!ray) continue;
        ++count.rays;
        const auto hit = tracer_.Trace(*ray, middle.parts);
        if (!result.moving.empty())
          result.moving.At(x, y, 0) = MovingAt(Vector2d(x + 0.5, y + 0.5), moments, ray_through, count.rays);
        if (!hit) continue;
        result.depth.At(x, y, 0) = static_cast<float>(hit->t * middle.world_from_cam.col(2).dot(ray->direction));
        if (scene_.objects[static_cast<std::size_t>(hit->object)].foreground) result.silhouette.At(x, y, 0) = 255;
      }
    }
    const std::lock_guard lock(mutex);
    counters.rays += count.rays;
    counters.poses += count.poses;
    counters.noise_draws += count.noise_draws;
  });
  return result;
}

}  // namespace lumi
