#include "simulate/camera_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene/program/error.h"
#include "simulate/noise.h"

namespace lumi {
namespace {

using Eigen::Vector3d;
constexpr double kTwoPi = 6.283185307179586;
constexpr double kGoldenAngle = 2.399963229728653;

Rigid3 Look(const PathDescription& path, const Vector3d& eye, const Vector3d& direction) {
  return LookAt(eye, path.look_at ? *path.look_at : Vector3d(eye + direction), Vector3d::UnitZ());
}

Vector3d RightOf(const Vector3d& direction) {
  const Vector3d right = direction.cross(Vector3d::UnitZ());
  return right.norm() > 1e-9 * direction.norm() ? Vector3d(right.normalized()) : Vector3d::UnitX();
}

double Share(const PathDescription& path, double frame) { return path.views > 1 ? frame / (path.views - 1) : 0.0; }

Rigid3 OnRing(const PathDescription& path, double frame) {
  // A full circle does not end where it began; an arc has a view at both ends.
  const bool closed = path.arc_rad > kTwoPi - 1e-9;
  const double share = closed ? frame / path.views : Share(path, frame);
  const double angle = path.start_rad + path.arc_rad * share;
  const Vector3d eye =
      path.centre + Vector3d(path.radius * std::cos(angle), path.radius * std::sin(angle), path.height);
  return LookAt(eye, *path.look_at, Vector3d::UnitZ());
}

Rigid3 OnGrid(const PathDescription& path, double frame) {
  const int i = static_cast<int>(std::lround(frame));
  const double column = i % path.columns - 0.5 * (path.columns - 1);
  const double row = 0.5 * (path.rows - 1) - i / path.columns;
  const Vector3d forward = path.look_at ? Vector3d(*path.look_at - path.centre) : path.direction;
  const Vector3d right = RightOf(forward);
  const Vector3d up = right.cross(forward).normalized();
  const Vector3d eye = path.centre + right * (column * path.spacing.x()) + up * (row * path.spacing.y());
  return Look(path, eye, path.direction);
}

double SlowNoise(double time_s, double hz, float channel) {
  const Eigen::Vector3f at(static_cast<float>(hz * time_s) + 0.31f, channel + 0.5f, 0.77f);
  return static_cast<double>(FractalNoise(at, 3, 0.5f, 0.0f, 402));
}

// An uneven pace: the walker is ahead of an even walk at some times and behind it at others.
double Paced(const PathDescription& path, double frame) {
  if (path.pace_s == 0) return frame;
  const double ahead_s = path.pace_s * SlowNoise(frame / path.fps, 0.9, 41);
  return std::clamp(frame + path.fps * ahead_s, 0.0, path.views - 1.0);
}

// Steps lift the head at step_hz and sway it at half of that; the hand adds slow tremor in all three angles.
Rigid3 WithGait(const PathDescription& path, double frame, const Vector3d& steady_eye, const Vector3d& right) {
  const double time_s = frame / path.fps;
  const double step = kTwoPi * path.step_hz * time_s;
  const Vector3d eye =
      steady_eye + right * (path.sway * std::sin(0.5 * step)) + Vector3d::UnitZ() * (path.bob * std::sin(step));
  const auto tremor = [&](float channel) {
    const Eigen::Vector3f at(static_cast<float>(1.3 * time_s) + 0.31f, channel + 0.5f, 0.77f);
    return path.shake_rad * static_cast<double>(FractalNoise(at, 3, 0.6f, 0.0f, 401));
  };
  const Rigid3 steady = Look(path, eye, path.direction);
  const Eigen::Quaterniond shake =
      Eigen::AngleAxisd(tremor(0), Vector3d::UnitX()) * Eigen::AngleAxisd(tremor(7), Vector3d::UnitY()) *
      Eigen::AngleAxisd(tremor(19) + 0.35 * path.shake_rad * std::sin(0.5 * step), Vector3d::UnitZ());
  return Rigid3{shake, Vector3d::Zero()} * steady;
}

Rigid3 OnWalk(const PathDescription& path, double frame) {
  const Vector3d along = path.to - path.from;
  return WithGait(path, frame, path.from + along * Share(path, Paced(path, frame)), RightOf(along));
}

Rigid3 OnDrive(const PathDescription& path, double frame) {
  const double share = Share(path, Paced(path, frame));
  const Vector3d along = path.to - path.from;
  const Vector3d eye = path.from + along * share + RightOf(along) * (path.weave * std::sin(2 * kTwoPi * share));
  return path.gait ? WithGait(path, frame, eye, RightOf(along)) : Look(path, eye, path.direction);
}

Rigid3 OnWave(const PathDescription& path, double frame) {
  // A lying eight: sideways once a period, the others twice.
  const double phase = kTwoPi * frame / (path.fps * path.period_s);
  const Vector3d forward = path.look_at ? Vector3d(*path.look_at - path.centre) : path.direction;
  const Vector3d right = RightOf(forward);
  const Vector3d eye = path.centre + right * (path.amplitude.x() * std::sin(phase)) +
                       forward.normalized() * (path.amplitude.y() * std::sin(2 * phase + 1.0)) +
                       Vector3d::UnitZ() * (path.amplitude.z() * std::sin(2 * phase));
  if (path.hand_drift == 0 && path.hand_rad == 0) return Look(path, eye, path.direction);
  // A hand holds neither place nor direction exactly: slow noise in both.
  const double time_s = frame / path.fps;
  const auto noise = [&](float channel, double hz) { return SlowNoise(time_s, hz, channel); };
  const Vector3d drift(noise(0, 0.45), noise(5, 0.45), noise(11, 0.45));
  const Rigid3 steady = Look(path, eye + path.hand_drift * drift, path.direction);
  const Eigen::Quaterniond shake = Eigen::AngleAxisd(path.hand_rad * noise(17, 1.1), Vector3d::UnitX()) *
                                   Eigen::AngleAxisd(path.hand_rad * noise(23, 1.1), Vector3d::UnitY()) *
                                   Eigen::AngleAxisd(path.hand_rad * noise(31, 1.1), Vector3d::UnitZ());
  return Rigid3{shake, Vector3d::Zero()} * steady;
}

// Sunflower discs about each centre, across the line of sight, a little deep too.
Rigid3 InCluster(const PathDescription& path, double frame) {
  const int i = static_cast<int>(std::lround(frame));
  const int clusters = static_cast<int>(path.centres.size());
  const int cluster = static_cast<int>(static_cast<long>(i) * clusters / path.views);
  const int first = static_cast<int>((static_cast<long>(cluster) * path.views + clusters - 1) / clusters);
  const int next = static_cast<int>((static_cast<long>(cluster + 1) * path.views + clusters - 1) / clusters);
  const Vector3d centre = path.centres[static_cast<std::size_t>(cluster)];
  const Vector3d forward = path.look_at ? Vector3d(*path.look_at - centre) : path.direction;
  const Vector3d right = RightOf(forward);
  const Vector3d up = right.cross(forward).normalized();
  const int k = i - first;
  const double r = path.spread * std::sqrt((k + 0.5) / (next - first));
  const double angle = kGoldenAngle * k + cluster;
  const double depth = 0.5 * path.spread * (2 * UnitFromBits(HashBits(static_cast<std::uint32_t>(i), 11U)) - 1);
  const Vector3d eye =
      centre + right * (r * std::cos(angle)) + up * (r * std::sin(angle)) + forward.normalized() * depth;
  return Look(path, eye, path.direction);
}

}  // namespace

Rigid3 PoseAt(const PathDescription& path, double frame) {
  switch (path.kind) {
    case PathKind::kRing: return OnRing(path, frame);
    case PathKind::kGrid: return OnGrid(path, frame);
    case PathKind::kWalk: return OnWalk(path, frame);
    case PathKind::kDrive: return OnDrive(path, frame);
    case PathKind::kWave: return OnWave(path, frame);
    case PathKind::kClusters: return InCluster(path, frame);
    case PathKind::kGiven: return path.cam_from_world[static_cast<std::size_t>(std::lround(frame))];
    case PathKind::kPoses: {
      const auto& [eye, target] = path.poses[static_cast<std::size_t>(std::lround(frame))];
      return LookAt(eye, target, Vector3d::UnitZ());
    }
  }
  throw std::logic_error("path kind");
}

bool IsShaken(const PathDescription& path) {
  if (path.gait)
    return path.bob != 0 || path.sway != 0 || path.shake_rad != 0 || path.pace_s != 0 || path.zoom_error != 0;
  return path.kind == PathKind::kWave && (path.hand_drift != 0 || path.hand_rad != 0);
}

PathDescription WithShake(PathDescription path, double scale) {
  path.gait = path.gait || ((path.kind == PathKind::kWalk || path.kind == PathKind::kDrive) && scale != 0);
  for (double* amount :
       {&path.bob, &path.sway, &path.shake_rad, &path.pace_s, &path.zoom_error, &path.hand_drift, &path.hand_rad})
    *amount *= scale;
  return path;
}

double ZoomAt(const PathDescription& path, double frame) {
  double zoom = path.zoom[0];
  if (path.zoom[1] != path.zoom[0]) zoom *= std::pow(path.zoom[1] / path.zoom[0], Share(path, frame));
  if (path.hold) {
    // The person zooms as the ideal path would need it; the shake of the hand does not change the zoom.
    const PathDescription ideal = WithShake(path, 0);
    zoom *= (PoseAt(ideal, frame) * *path.hold).z() / (PoseAt(ideal, 0) * *path.hold).z();
  }
  if (path.gait && path.zoom_error != 0) zoom *= 1 + path.zoom_error * SlowNoise(frame / path.fps, 1.2, 53);
  return zoom;
}

namespace {

std::vector<PlannedView> ViewsTaken(const SceneDescription& scene, int views, bool first) {
  std::vector<PlannedView> all;
  double start_s = 0;
  for (std::size_t p = 0; p < scene.paths.size(); ++p) {
    const PathDescription& path = scene.paths[p];
    for (int i = 0; i < path.views; ++i) {
      PlannedView view;
      view.frame_index = static_cast<int>(all.size());
      view.path = static_cast<int>(p);
      view.frame = i;
      view.camera = path.cameras[static_cast<std::size_t>(i) % path.cameras.size()];
      view.time_s = path.times_s.empty() ? start_s + i / path.fps : path.times_s[static_cast<std::size_t>(i)];
      view.name = fmt::format("{}_{:04d}.{}", scene.name, view.frame_index, scene.jpeg ? "jpg" : "png");
      all.push_back(view);
    }
    start_s += path.views / path.fps;
  }
  const auto total = static_cast<int>(all.size());
  if (views == 0 || views == total) return all;
  if (views > total)
    throw UsageError(fmt::format("--views {}: the scene's path has only {} views", views, total),
                     "ask for fewer, or raise \"views\" in the scene's path");
  if (scene.period_s || first) {  // a video: its beginning
    all.resize(static_cast<std::size_t>(views));
    return all;
  }
  const bool closed =
      scene.paths.size() == 1 && scene.paths[0].kind == PathKind::kRing && scene.paths[0].arc_rad > kTwoPi - 1e-9;
  std::vector<PlannedView> chosen;
  for (int i = 0; i < views; ++i) {
    const double at = closed ? static_cast<double>(i) * total / views
                             : (views == 1 ? 0.5 * (total - 1) : static_cast<double>(i) * (total - 1) / (views - 1));
    chosen.push_back(all[static_cast<std::size_t>(std::floor(at + 0.5))]);
  }
  return chosen;
}

}  // namespace

std::vector<PlannedView> PlanViews(const SceneDescription& scene, int views, bool first) {
  std::vector<PlannedView> taken = ViewsTaken(scene, views, first);
  // Of every `every` photos the second is blurred: photos 0, N, 2N ..., which a hold-out takes, stay sharp where N is a
  // multiple of `every`.
  const auto every = static_cast<std::size_t>(scene.effects.motion_blur_every);
  for (std::size_t i = 0; i < taken.size(); ++i) taken[i].blurred = i % every == 1 % every;
  return taken;
}

}  // namespace lumi
