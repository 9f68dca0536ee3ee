#include "scene/model/scene.h"
#include "scene/geometry/median.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "scene/model/orientation.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

// The photos' own up (the side of each that its orientation says), robustly: the mean, then the mean of those within 60
// degrees of it, so that a few portrait shots whose files do not say so do not tilt the scene. That mean leans where
// all photos look down from one side, whereas the horizontal axis of a camera held by hand is level. The result is the
// least-squares compromise of both: a Gaussian prior about the mean (kPitchRad), and the cameras' horizontal axes as
// its likelihood (kRollRad).
Eigen::Vector3d EstimateUp(const Scene& scene) {
  constexpr double kCosOutlier = 0.5;
  constexpr double kPitchRad = 0.35, kRollRad = 0.05;  // standard deviations: 20 and 3 degrees
  std::vector<Rigid3> held;
  for (const View& view : scene.views) held.push_back(UprightPose(view.cam_from_world, view.orientation));
  const auto up = [](const Rigid3& pose) { return Eigen::Vector3d(-pose.R().row(1)); };
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Rigid3& pose : held) mean += up(pose);
  if (!(mean.norm() > 1e-9)) return -Eigen::Vector3d::UnitY();
  mean.normalize();
  Eigen::Vector3d robust = Eigen::Vector3d::Zero();
  Eigen::Matrix3d weight = Eigen::Matrix3d::Identity() / (kPitchRad * kPitchRad);
  for (const Rigid3& pose : held) {
    if (!(up(pose).dot(mean) > kCosOutlier)) continue;
    robust += up(pose);
    const Eigen::Vector3d right = pose.R().row(0);
    weight += right * right.transpose() / (kRollRad * kRollRad);
  }
  return (weight.inverse() * (robust.norm() > 1e-9 ? robust : mean)).normalized();
}

// Of a view of a frame that is not metric; nullopt at infinity, where P has no centre too.
std::optional<Eigen::Vector3d> FiniteCentre(const View& view) {
  constexpr double kAtInfinity = 1e-12;  // of a unit vector
  const Eigen::Vector4d c = CentreOfProjection(view.P);
  if (!(c.w() > kAtInfinity)) return std::nullopt;
  return Eigen::Vector3d(c.hnormalized());
}

}  // namespace

std::string_view Name(Frame frame) {
  switch (frame) {
    case Frame::kMetric: return "metric";
    case Frame::kQuasiAffine: return "quasi_affine";
    case Frame::kProjective: return "projective";
  }
  throw std::logic_error("unknown frame");
}

std::optional<Frame> FrameFromName(std::string_view name) {
  for (const Frame f : {Frame::kMetric, Frame::kQuasiAffine, Frame::kProjective})
    if (Name(f) == name) return f;
  return std::nullopt;
}

RenderView MakeRenderView(const Camera& pinhole, const Rigid3& cam_from_world) {
  if (!pinhole.IsPinhole()) throw std::invalid_argument("MakeRenderView: the camera has distortion; undistort first");
  RenderView v;
  v.P = ProjectionMatrix(pinhole.K(), cam_from_world);
  v.centre = cam_from_world.OriginInSource();
  v.size_px = {pinhole.width_px, pinhole.height_px};
  return v;
}

RenderView MakeRenderView(const Scene& scene, const View& view) {
  RenderView v;
  if (scene.frame == Frame::kMetric) {
    v = MakeRenderView(scene.CameraOf(view), view.cam_from_world);
  } else {
    const auto centre = FiniteCentre(view);
    if (!centre)
      throw DataError(
          fmt::format("the centre of projection of {} lies at infinity in this {} frame", view.name, Name(scene.frame)),
          {}, scene.folder);
    v.P = view.P;
    v.centre = *centre;
    v.size_px = view.size_px;
  }
  v.time_s = view.time_s;
  v.gain = view.gain;
  v.grids = view.grids;
  return v;
}

Eigen::Vector2i SizePx(const Scene& scene, const View& view) {
  if (scene.frame != Frame::kMetric) return view.size_px;
  return {scene.CameraOf(view).width_px, scene.CameraOf(view).height_px};
}

void RequireMetric(const Scene& scene, std::string_view what) {
  if (scene.frame == Frame::kMetric) return;
  throw DataError(fmt::format("{} needs cameras and poses, and this is a {} scene", what, Name(scene.frame)),
                  "make it again with known intrinsics: lumi-reconstruct --camera camera.yaml --require metric",
                  scene.folder);
}

void UpdateFrameOfReference(Scene& scene) {
  if (scene.views.empty()) return;
  const bool metric = scene.frame == Frame::kMetric;
  if (metric) scene.up = EstimateUp(scene);
  std::vector<Eigen::Vector3d> centres;
  for (const View& v : scene.views) {
    if (metric)
      centres.push_back(v.CentreInWorld());
    else if (const auto centre = FiniteCentre(v))
      centres.push_back(*centre);
  }
  // Centre and size from what the cameras look at, or the cameras alone where there are no points. Medians: a few
  // points at the horizon must not decide.
  std::vector<Eigen::Vector3d> x;
  for (const Point& p : scene.points) {
    const Eigen::Vector3d finite = metric ? p.x_in_world : Eigen::Vector3d(p.X_in_world.hnormalized());
    if (finite.allFinite()) x.push_back(finite);
  }
  if (x.size() < 8) x.insert(x.end(), centres.begin(), centres.end());
  if (x.empty()) return;
  Eigen::Vector3d centre;
  for (int k = 0; k < 3; ++k) {
    std::vector<double> c;
    c.reserve(x.size());
    for (const auto& p : x) c.push_back(p[k]);
    centre[k] = Median(std::move(c));
  }
  std::vector<double> distance;
  distance.reserve(x.size());
  for (const auto& p : x) distance.push_back((p - centre).norm());
  double size = Median(std::move(distance));
  for (const auto& c : centres) size = std::max(size, 0.5 * (c - centre).norm());
  if (!(size > 0)) size = 1;
  scene.normalized_from_world = {1.0 / size, Eigen::Quaterniond::Identity(), -centre / size};
}

std::vector<double> PointDepths(const Scene& scene, ViewId view) {
  if (scene.frame != Frame::kMetric) throw std::invalid_argument("PointDepths: not a metric scene");
  const Eigen::RowVector4d z = scene.views[static_cast<std::size_t>(view.value)].cam_from_world.Matrix().row(2);
  std::vector<double> depths;
  for (const Point& p : scene.points)
    for (const Observation& o : p.track)
      if (o.view == view) {
        const double d = z * p.x_in_world.homogeneous();
        if (d > 0) depths.push_back(d);
        break;
      }
  std::sort(depths.begin(), depths.end());
  return depths;
}

void Transform(Scene& scene, const Similarity3& target_from_world) {
  if (scene.frame != Frame::kMetric) throw std::invalid_argument("Transform: not a metric scene");
  for (View& v : scene.views) {
    v.cam_from_world = TransformPose(v.cam_from_world, target_from_world);
    // TransformPose keeps the camera frame's unit: only the centre moves, the photo stays.
  }
  for (Point& p : scene.points) p.x_in_world = target_from_world * p.x_in_world;
  if (scene.metres_per_unit) *scene.metres_per_unit /= target_from_world.scale;
  scene.up = target_from_world.rotation * scene.up;
  scene.normalized_from_world = scene.normalized_from_world * target_from_world.Inverse();
}

std::vector<ViewId> FoldViews(const Scene& scene, int n, Fold fold) {
  if (n < 2) throw std::invalid_argument("FoldViews: n must be at least 2");
  std::vector<ViewId> ids;
  for (int i = fold == Fold::kReport ? 0 : n / 2; i < static_cast<int>(scene.views.size()); i += n) ids.push_back({i});
  return ids;
}

}  // namespace lumi
