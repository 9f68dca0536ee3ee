#include "reconstruct/factorization/try_metric.h"

#include <fmt/format.h>

#include <Eigen/LU>

#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/steering.h"
#include "reconstruct/factorization/take_result.h"
#include "reconstruct/factorization/upgrade.h"
#include "reconstruct/factorization/window_upgrade.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// The metric model may fit worse than the projective one by this: it has fewer numbers.
constexpr double kMetricRmsFactor = 1.2;
constexpr double kMetricRmsFloorPx = 0.2;
// Beyond this it is worth a warning: the projective model's further numbers explain a percent or two.
constexpr double kSuspectRmsFactor = 1.03;
constexpr double kSuspectRmsFloorPx = 0.01;
constexpr double kLeastFrontShare = 0.98;
const WindowOptions kShortWindows{.length = 6, .overlap = 4, .min_shared = 0};

// A metric start, and what adjusting its steering tracks makes of it.
struct MetricAttempt {
  ProjectiveModel model;  // every track, as the start has it
  ProjectiveModel steering;
  MetricModel metric;
  double plane_sigma = 0;
  double projective_rms = 0, rms = 0;  // of the same sights

  double Limit() const { return kMetricRmsFactor * projective_rms + kMetricRmsFloorPx; }
};

// None where a point of the start is no number.
std::optional<MetricAttempt> Attempt(const ImagePoints& points, const ProjectiveModel& projective, MetricModel start,
                                     double plane_sigma, double sigma_px, const FactorizationOptions& options) {
  MetricAttempt a;
  a.model = projective;
  a.metric = std::move(start);
  a.plane_sigma = plane_sigma;
  for (std::size_t t = 0; t < a.metric.X.size(); ++t)
    if (!a.metric.X[t].allFinite()) return std::nullopt;
  // Points are placed anew under the Euclidean cameras, which are near but not equal to the projective ones.
  ToProjective(points, a.metric, a.model);
  // The same sights judge both models.
  a.steering = Steering(points, a.model, options.adjust_sights);
  ProjectiveModel judged = projective;
  judged.solved = a.steering.solved;
  a.projective_rms = RmsPx(points, judged);
  a.rms = RmsPx(points, a.steering);
  if (!options.adjust) return a;
  // First with a wide loss, so that a model that is still off is pulled as a whole.
  BundleOptions bundle = Adjustment(options, std::max(4 * sigma_px, 1.0), 20);
  bundle.max_span = MaxSpan(a.model, options);
  AdjustMetric(points, a.steering, a.metric, options.intrinsics, bundle);
  bundle = Adjustment(options, sigma_px, 30);
  bundle.tolerance = kFineTolerance;
  a.rms = AdjustMetric(points, a.steering, a.metric, options.intrinsics, bundle).rms_px;
  ToProjective(points, a.metric, a.steering);
  a.model.P = a.steering.P;
  for (std::size_t t = 0; t < a.model.X.size(); ++t)
    if (a.steering.solved[t]) a.model.X[t] = a.steering.X[t];
  return a;
}

// From the plane at infinity of all frames, or else from the windows' own.
std::optional<MetricAttempt> FindAttempt(const FactorizationTask& task, const ProjectiveModel& projective,
                                         const std::vector<FrameWindow>& windows, const Camera& camera,
                                         const Upgrade& upgrade, FactorizationResult& result) {
  const auto& [points, tracks, options] = task;
  MetricModel start;
  start.intrinsics_px << camera.FocalPx(), camera.PrincipalPointPx();
  std::optional<MetricAttempt> attempt;
  if (const auto inverse = InverseOf(upgrade.H); upgrade.found && inverse) {
    start.cam_from_world = upgrade.cam_from_world;
    start.X.assign(projective.X.size(), Eigen::Vector4d::Zero());
    for (std::size_t t = 0; t < start.X.size(); ++t)
      if (projective.solved[t]) start.X[t] = (*inverse * projective.X[t]).normalized();
    attempt = Attempt(points, projective, start, upgrade.plane_sigma, result.sigma_px, options);
  }
  const auto explained = [&] { return attempt && attempt->rms <= attempt->Limit(); };
  if (!options.adjust || windows.size() <= 1 || explained()) return attempt;
  // No one plane at infinity does for all frames; each window may have its own. Where tracks are short, only short ones
  // have.
  WindowUpgradeOptions by_windows;
  by_windows.loss = options.loss;
  by_windows.sigma_px = result.sigma_px;
  by_windows.max_rms_factor = kMetricRmsFactor;
  by_windows.max_rms_more_px = kMetricRmsFloorPx;
  std::vector<std::vector<FrameWindow>> splits{windows};
  if (options.windows.ordered) splits.push_back(SplitIntoWindows(points, kShortWindows));
  for (const std::vector<FrameWindow>& split : splits) {
    const WindowUpgrade joined = UpgradeByWindows(points, projective, split, start.intrinsics_px, by_windows);
    if (!joined.found) continue;
    ProjectiveModel part = projective;
    for (std::size_t t = 0; t < part.solved.size(); ++t) part.solved[t] = part.solved[t] && joined.solved[t];
    start.cam_from_world = joined.cam_from_world;
    start.X = joined.X;
    auto other = Attempt(points, part, start, joined.plane_sigma, result.sigma_px, options);
    if (other && (!attempt || other->rms < attempt->rms)) {
      attempt = std::move(other);
      result.upgrade_plane_sigma = attempt->plane_sigma;
    }
    if (explained()) break;
  }
  return attempt;
}

// Warns of intrinsics that the images contradict, with the focal length that the images suggest.
void WarnOfSuspectIntrinsics(const FactorizationTask& task, const MetricAttempt& attempt, const Camera& camera,
                             FactorizationResult& result) {
  const FactorizationOptions& options = task.options;
  const double rms = attempt.rms, projective_rms = attempt.projective_rms;
  if (!options.adjust || options.intrinsics != FreeIntrinsics::kNone ||
      !(rms > kSuspectRmsFactor * projective_rms + kSuspectRmsFloorPx))
    return;
  MetricModel other = attempt.metric;
  BundleOptions bundle = Adjustment(options, result.sigma_px, 30);
  bundle.tolerance = kFineTolerance;
  const double free_rms = AdjustMetric(task.points, attempt.steering, other, FreeIntrinsics::kFocal, bundle).rms_px;
  result.warnings.push_back(
      fmt::format("the intrinsics fit the images worse than they should ({:.3f} px with them, {:.3f} px without): "
                  "a focal length of {:.1f} px instead of {:.1f} px gives {:.3f} px",
                  rms, projective_rms, other.intrinsics_px[0], camera.FocalPx()[0], free_rms));
}

// All tracks, where so far only those that steer were adjusted.
CullResult AdjustEverything(const FactorizationTask& task, MetricAttempt& attempt) {
  const auto& [points, tracks, options] = task;
  ProjectiveModel& model = attempt.model;
  CullOptions cull = options.cull;
  cull.min_sights = std::min(cull.min_sights, model.PlacedCount());
  if (options.adjust) Follow(points, attempt.steering, model, cull);
  const CullResult culled = Cull(points, model, cull);
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) attempt.metric.X[t] = model.X[t];
  if (!options.adjust) return culled;
  BundleOptions bundle = Adjustment(options, culled.sigma_px, 10);
  bundle.tolerance = 1e-5;
  // The tracks that steer hold a long video's ends together; the others add to what neighbours know of each other.
  bundle.max_span = MaxSpan(model, options);
  bundle.whole = attempt.steering.solved;
  AdjustMetric(points, model, attempt.metric, options.intrinsics, bundle);
  ToProjective(points, attempt.metric, model);
  FollowWhereCut(points, model, bundle, cull);
  return Cull(points, model, cull);
}

// Of the sights that agree: in front of their camera; 0 for none. Far points lie on either side of infinity by their
// noise; only those that are surely near can be behind.
double FrontShare(const ImagePoints& points, const ProjectiveModel& model) {
  long front = 0, sights = 0;
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    if (!model.solved[t]) continue;
    const bool surely_behind_infinity = !(model.X[t].w() > -1e-3);
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const auto f = static_cast<std::size_t>(points.tracks[t][k].frame);
      if (!model.placed[f] || !model.inlier[t][k]) continue;
      ++sights;
      front += !surely_behind_infinity && model.P[f].row(2).dot(model.X[t]) > 0;
    }
  }
  return sights == 0 ? 0 : static_cast<double>(front) / static_cast<double>(sights);
}

}  // namespace

bool TryMetric(const FactorizationTask& task, const ProjectiveModel& projective,
               const std::vector<FrameWindow>& windows, const Camera& camera, FactorizationResult& result) {
  const auto& [points, tracks, options] = task;
  Stopwatch stage;
  std::vector<Eigen::Matrix3d> K_normalised;
  for (std::size_t f = 0; f < points.FrameCount(); ++f)
    K_normalised.push_back(NormalisedFromPixels(points, f) * camera.K());
  const Upgrade upgrade = UpgradeToEuclidean(points, projective, K_normalised);
  result.seconds.upgrade += stage.Lap();
  result.upgrade_condition = upgrade.condition;
  result.upgrade_plane_sigma = upgrade.plane_sigma;
  result.upgrade_residual = upgrade.residual;
  std::optional<MetricAttempt> attempt = FindAttempt(task, projective, windows, camera, upgrade, result);
  result.seconds.metric += stage.Lap();
  if (!attempt) {
    result.upgrade_reason = "no plane at infinity could be computed";
    return false;
  }
  if (options.adjust ? !(attempt->rms <= attempt->Limit()) : !(upgrade.residual < 0.1)) {
    result.upgrade_reason = fmt::format(
        "the intrinsics do not explain the images: reprojection error {:.2f} px with them, "
        "{:.2f} px without",
        attempt->rms, attempt->projective_rms);
    return false;
  }
  if (!(attempt->plane_sigma <= options.max_plane_sigma)) {
    result.upgrade_reason = fmt::format(
        "the plane at infinity is ill-conditioned (baseline too short for the noise): relative uncertainty of depths "
        "{:.2f}",
        attempt->plane_sigma);
    return false;
  }
  WarnOfSuspectIntrinsics(task, *attempt, camera, result);
  const CullResult culled = AdjustEverything(task, *attempt);
  ProjectiveModel& model = attempt->model;
  const double front = FrontShare(points, model);
  result.seconds.metric += stage.Seconds();
  if (!(front >= kLeastFrontShare)) {
    result.upgrade_reason = "points behind their cameras after the upgrade";
    return false;
  }
  result.upgrade = UpgradeKind::kMetric;
  result.upgrade_reason.clear();
  const MetricModel& metric = attempt->metric;
  const Eigen::Vector4d& k = metric.intrinsics_px;
  result.camera = Camera::Pinhole(camera.width_px, camera.height_px, k[0], k[1], k[2], k[3]);
  // Cameras with their own depth: w is along the camera's z axis.
  TakeCameras(points, model, result);
  result.cam_from_world = metric.cam_from_world;
  for (std::size_t f = 0; f < result.P.size(); ++f)
    if (model.placed[f]) result.P[f] = ProjectionMatrix(result.camera->K(), metric.cam_from_world[f]);
  TakePoints(points, model, tracks, result);
  result.rms_px = RmsPx(points, model);
  result.sigma_px = culled.sigma_px;
  result.culled = culled.culled;
  return true;
}

}  // namespace lumi
