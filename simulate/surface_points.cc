#include "simulate/surface_points.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>

#include "scene/program/parallel.h"
#include "simulate/noise.h"
#include "simulate/photo_response.h"

namespace lumi {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A point seen at a flatter angle than this is no feature for anybody.
constexpr double kMinFacing = 0.15;

struct Eye {
  TrueCamera truth;
  Vector3d centre;
  PartPoses parts;
};

// Where the eye sees a point of a surface, if it does.
std::optional<Vector2d> Seen(const Eye& eye, const Tracer& tracer, const Hit& hit, long& rays) {
  const Vector3d x_in_cam = eye.truth.cam_from_world * hit.x_in_world;
  auto x_px = eye.truth.camera.Project(x_in_cam);
  if (!x_px || x_in_cam.z() <= 0) return std::nullopt;
  if (eye.truth.skew_px != 0)
    x_px->x() +=
        eye.truth.skew_px * (x_px->y() - eye.truth.camera.PrincipalPointPx().y()) / eye.truth.camera.FocalPx().y();
  if (!(x_px->x() > 0 && x_px->y() > 0 && x_px->x() < eye.truth.camera.width_px &&
        x_px->y() < eye.truth.camera.height_px))
    return std::nullopt;
  if (!eye.truth.camera.IsPinhole()) {
    // A lens polynomial folds back beyond its field of view: what lands there is not seen.
    const auto back = NormalizedWithSkew(eye.truth.camera, eye.truth.skew_px, *x_px);
    if (!back || (*back - x_in_cam.hnormalized()).norm() > 1e-6 * (1 + back->norm())) return std::nullopt;
  }
  const Vector3d to_eye = eye.centre - hit.x_in_world;
  const double distance = to_eye.norm();
  const Vector3d direction = to_eye / distance;
  if (hit.normal.dot(direction) < kMinFacing) return std::nullopt;
  const Vector3d start = hit.x_in_world + SurfaceOffset(hit.x_in_world, tracer.Extent()) * hit.normal;
  ++rays;
  if (tracer.IsBlocked({start, direction}, distance, eye.parts)) return std::nullopt;
  return x_px;
}

}  // namespace

std::vector<Point> SampleSurfacePoints(const TracedScene& traced_scene, const std::vector<PlannedView>& views,
                                       int count, std::uint64_t seed, ProgressSink& sink, long& rays) {
  const auto& [scene, tracer, shader, renderer] = traced_scene;
  std::vector<Point> points;
  const std::size_t n = views.size();
  if (n < 2) return points;
  std::vector<Eye> eyes;
  for (const PlannedView& view : views) {
    Eye eye{renderer.CameraOf(view), {}, {}};
    eye.centre = eye.truth.cam_from_world.OriginInSource();
    if (tracer.HasMovingParts()) eye.parts = tracer.PartsAt(view.time_s);
    eyes.push_back(std::move(eye));
  }
  // Views are tried from a random one on, in steps that reach all of them and land far apart.
  std::size_t step = std::max<std::size_t>(1, static_cast<std::size_t>(0.618 * static_cast<double>(n)));
  while (std::gcd(step, n) != 1) ++step;

  const auto draw = [&](std::size_t index, long& traced) -> std::optional<Point> {
    HashStream random(seed, static_cast<std::uint32_t>(index), 0x706f696eU);
    const std::size_t first = random.Bits() % n;
    const Eye& eye = eyes[first];
    const Vector2d x_px(random.Uniform(0, eye.truth.camera.width_px), random.Uniform(0, eye.truth.camera.height_px));
    const auto x = NormalizedWithSkew(eye.truth.camera, eye.truth.skew_px, x_px);
    if (!x) return std::nullopt;
    const Ray ray{eye.centre, (eye.truth.cam_from_world.rotation.conjugate() * x->homogeneous()).normalized()};
    ++traced;
    const auto hit = tracer.Trace(ray, eye.parts);
    if (!hit || scene.objects[static_cast<std::size_t>(hit->object)].spin) return std::nullopt;
    Point point;
    point.x_in_world = hit->x_in_world;
    for (std::size_t k = 0; k < n && point.track.size() < static_cast<std::size_t>(kMaxTrackLength); ++k) {
      const std::size_t view = (first + k * step) % n;
      if (const auto at = Seen(eyes[view], tracer, *hit, traced))
        point.track.push_back({ViewId{static_cast<std::int32_t>(view)}, *at});
    }
    if (point.track.size() < 2) return std::nullopt;
    std::ranges::sort(point.track, [](const Observation& a, const Observation& b) { return a.view < b.view; });
    const Rgb light = shader.DiffuseColor(*hit, eye.parts, traced);
    for (std::size_t c = 0; c < 3; ++c)
      point.color[c] = static_cast<std::uint8_t>(
          std::lround(255 * std::min(1.0, CodeFromLight(static_cast<double>(light[static_cast<Eigen::Index>(c)])))));
    return point;
  };

  Progress progress(sink, "Surface points", count);
  const auto batch = static_cast<std::size_t>(std::max(256, count / 4));
  constexpr std::size_t kMaxBatches = 16;  // four draws a point; a scene that is mostly background gets fewer points
  for (std::size_t round = 0; round < kMaxBatches && points.size() < static_cast<std::size_t>(count); ++round) {
    std::vector<std::optional<Point>> drawn(batch);
    std::mutex mutex;
    ParallelFor(batch, 16, [&](std::size_t begin, std::size_t end) {
      long traced = 0;
      for (std::size_t i = begin; i < end; ++i) drawn[i] = draw(round * batch + i, traced);
      const std::lock_guard lock(mutex);
      rays += traced;
    });
    for (auto& point : drawn)
      if (point && points.size() < static_cast<std::size_t>(count)) points.push_back(std::move(*point));
    progress.Set(static_cast<long>(points.size()));
  }
  return points;
}

}  // namespace lumi
