#include "reconstruct/factorization/reconstruct_from_tracks.h"

#include <algorithm>

#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/merge_windows.h"
#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/quasi_affine.h"
#include "reconstruct/factorization/refusal.h"
#include "reconstruct/factorization/steering.h"
#include "reconstruct/factorization/take_result.h"
#include "reconstruct/factorization/try_metric.h"
#include "reconstruct/factorization/upgrade.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Of the cameras' left blocks, in one frame's normalised units: about a degree over the photo's half diagonal.
constexpr double kConstantOrientation = 0.02;

constexpr double kLeastSigmaPx = 0.25;  // the first adjustment's: the noise is not known yet
constexpr int kFewestSights = 8;        // of a frame that counts as placed
constexpr int kFewTracks = 12;          // of a frame: the reason why it is not

// Adjusts all frames at once, twice; in between, frames and tracks that no window could place or solve are tried
// against the whole model.
void AdjustWhole(const ImagePoints& points, ProjectiveModel& model, const std::vector<char>& keys,
                 const FactorizationOptions& options, FactorizationResult& result, ProgressSink& sink) {
  Progress progress(sink, "projective adjustment", options.adjust ? 3 : 1);
  CullResult culled = Cull(points, model, options.cull);
  BundleOptions bundle = Adjustment(options, std::max(culled.sigma_px, kLeastSigmaPx), 10);
  bundle.max_span = MaxSpan(model, options);
  if (options.adjust) AdjustAll(points, model, bundle, options.adjust_sights, options.cull);
  progress.Step();
  CullOptions cull = options.cull;
  cull.min_sights = std::min(cull.min_sights, std::max(2, model.PlacedCount()));
  culled = Cull(points, model, cull);
  SeedOptions grow;
  grow.inlier_px = options.inlier_px;
  grow.seed = options.seed;
  if (model.PlacedCount() < static_cast<int>(points.FrameCount())) Grow(points, model, grow);
  ParallelEach(points.tracks.size(), 32, [&](std::size_t t) {
    if (!model.solved[t])
      IntersectTrack(points, model, t, {std::max(culled.limit_px, 1.0), cull.min_sights, options.seed});
  });
  culled = Cull(points, model, cull);
  if (options.adjust) {
    progress.Step();
    bundle = Adjustment(options, culled.sigma_px, 20);
    bundle.max_span = MaxSpan(model, options);
    AdjustAll(points, model, bundle, options.adjust_sights, cull, keys);
    culled = Cull(points, model, cull);
    progress.Step();
  }
  result.sigma_px = culled.sigma_px;
  result.culled = culled.culled;
}

// No further adjustment follows: this one takes every track.
void AdjustLast(const ImagePoints& points, ProjectiveModel& model, const std::vector<char>& keys,
                const FactorizationOptions& options, FactorizationResult& result) {
  CullOptions cull = options.cull;
  cull.min_sights = std::min(cull.min_sights, model.PlacedCount());
  BundleOptions bundle = Adjustment(options, result.sigma_px, 10);
  bundle.tolerance = 1e-4;
  if (keys.empty())
    AdjustProjective(points, model, bundle);
  else
    AdjustByKeys(points, model, keys, bundle, cull);
  const CullResult culled = Cull(points, model, cull);
  result.sigma_px = culled.sigma_px;
  result.culled = culled.culled;
  result.projective_rms_px = RmsPx(points, model);
}

// A frame with next to nothing left is not placed.
void NameMissing(const ImagePoints& points, ProjectiveModel& model, FactorizationResult& result) {
  std::vector<int> sights(points.FrameCount(), 0), seen(points.FrameCount(), 0);
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const auto f = static_cast<std::size_t>(points.tracks[t][k].frame);
      ++seen[f];
      if (model.solved[t] && model.inlier[t][k]) ++sights[f];
    }
  for (std::size_t f = 0; f < points.FrameCount(); ++f) {
    if (model.placed[f] && sights[f] < kFewestSights) model.placed[f] = 0;
    if (model.placed[f]) continue;
    const std::string reason = seen[f] == 0           ? "no tracks"
                               : seen[f] < kFewTracks ? "too few tracks (" + std::to_string(seen[f]) + ")"
                                                      : "too few of its tracks agree with the other frames";
    result.missing.push_back({static_cast<int>(f), reason});
  }
}

}  // namespace

std::string Validate(const FactorizationOptions& options) {
  if (std::string wrong = Validate(options.windows); !wrong.empty()) return wrong;
  if (!(options.inlier_px > 0) || !(options.epipolar_px > 0)) return "inlier limits must be above 0 pixels";
  if (!(options.cull.sigmas > 0) || !(options.cull.least_px > 0) || !(options.cull.most_px >= options.cull.least_px))
    return "cull limits must be above 0 and in order";
  if (options.cull.min_sights < 2) return "a track needs at least 2 sights";
  if (options.factorise_iterations < 0 || options.adjust_sights < 0)
    return "iterations and sights must not be negative";
  if (!(options.max_plane_sigma > 0)) return "the plane's uncertainty limit must be above 0";
  return {};
}

std::string_view Name(UpgradeKind kind) {
  switch (kind) {
    case UpgradeKind::kNone: return "none";
    case UpgradeKind::kQuasiAffine: return "quasi-affine";
    case UpgradeKind::kMetric: return "metric";
  }
  return "";
}

FactorizationResult ReconstructFromTracks(const Tracks& tracks, const std::optional<Camera>& camera,
                                          const FactorizationOptions& options, ProgressSink& sink) {
  const Stopwatch watch;
  Stopwatch stage;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  if (camera)
    if (const auto wrong = Validate(*camera)) throw UsageError("camera: " + *wrong);
  const ImagePoints points = Normalise(tracks, camera);
  FactorizationResult result;
  if (points.FrameCount() < 2) Refuse(points, {}, camera);

  SolvedWindows solved = SolveWindows(points, camera, options, sink);
  std::vector<FrameWindow> windows;
  for (const SolvedWindow& w : solved.solved) windows.push_back(w.window);
  result.seconds.windows = stage.Lap();

  MergedWindows merged = MergeWindows(points, std::move(solved.solved), options, sink);
  ProjectiveModel& model = merged.model;
  result.windows = std::move(merged.windows);
  result.seconds.merging = stage.Lap();

  AdjustWhole(points, model, solved.keys, options, result, sink);
  NameMissing(points, model, result);
  if (model.PlacedCount() < 2) Refuse(points, solved.homographies, camera);
  result.projective_rms_px = RmsPx(points, model);
  result.seconds.projective = stage.Lap();

  if (camera && !options.projective_only) {
    Progress progress(sink, "upgrade to a metric frame", 1);
    TryMetric({points, tracks, options}, model, windows, *camera, result);
    progress.Step();
  } else {
    result.upgrade_reason = camera ? "a projective scene was asked for" : "the intrinsics are not known";
  }
  if (result.upgrade != UpgradeKind::kMetric) {
    stage.Lap();
    if (options.adjust) AdjustLast(points, model, solved.keys, options, result);
    result.seconds.projective += stage.Lap();
    if (!camera && DeviationFromConstantOrientation(points, model) < kConstantOrientation)
      result.upgrade_reason =
          "constant orientation: the camera never turns, which leaves unknown intrinsics undetermined";
    const QuasiAffine quasi = SolveQuasiAffine(points, model);
    result.quasi_affine_margin = quasi.margin;
    if (quasi.solved) {
      result.upgrade = UpgradeKind::kQuasiAffine;
    } else {
      result.upgrade_reason += "; and no plane has all points and cameras on one side (" +
                               std::to_string(quasi.sign_conflicts) + " of " + std::to_string(quasi.sights) +
                               " sights behind their camera)";
    }
    // Who asked for no more is told only where there is less.
    if (!options.projective_only || result.upgrade != UpgradeKind::kQuasiAffine)
      result.warnings.push_back(std::string(Name(result.upgrade)) + " instead of metric: " + result.upgrade_reason);
    TakeCameras(points, model, result);
    TakePoints(points, model, tracks, result);
    result.rms_px = RmsPx(points, model);
    result.seconds.upgrade += stage.Seconds();
  }
  if (!result.missing.empty())
    result.warnings.push_back(std::to_string(result.missing.size()) + " of " + std::to_string(points.FrameCount()) +
                              " frames have no camera");
  for (const WindowDiagnostics& w : result.windows)
    if (w.outcome == "not connected")
      result.warnings.push_back("frames " + std::to_string(w.first_frame) + " to " + std::to_string(w.last_frame) +
                                " share too little with the rest");
  result.seconds.total = watch.Seconds();
  return result;
}

}  // namespace lumi
