#include "reconstruct/factorization/factorization.h"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

#include "reconstruct/factorization/factorise.h"
#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/merge.h"
#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/quasi_affine.h"
#include "reconstruct/factorization/refusal.h"
#include "reconstruct/factorization/seed.h"
#include "reconstruct/factorization/upgrade.h"
#include "reconstruct/factorization/window_upgrade.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

// Windows in which things move apart by less than this are made longer; beyond so many frames by leaving frames out, which the
// others' points place later: a window's cost grows with the square of its frames, and neighbours say the same.
constexpr double kLeastParallaxPx = 6.0;
constexpr int kMostInWindow = 60;
// The metric model may fit worse than the projective one by this: it has fewer numbers.
constexpr double kMetricRmsFactor = 1.2;
constexpr double kMetricRmsFloorPx = 0.2;
// Beyond this it is worth a warning: the projective model's further numbers explain a percent or two.
constexpr double kSuspectRmsFactor = 1.03;
constexpr double kSuspectRmsFloorPx = 0.01;
constexpr double kLeastFrontShare = 0.98;
// Of the cameras' left blocks, in one frame's normalised units: about a degree over the photo's half diagonal.
constexpr double kConstantOrientation = 0.02;

// A video of more frames than the first is adjusted with its tracks cut after the second, until the last adjustments.
constexpr int kManyFrames = 100, kMostSpan = 40;
const WindowOptions kShortWindows{.length = 6, .overlap = 4, .min_shared = 0};
// An adjustment ends where a step gains less than this part of the cost; ends that count ask for more.
constexpr double kTolerance = 1e-3, kFineTolerance = 1e-6;

using Clock = std::chrono::steady_clock;
double Since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

std::string Fixed(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

struct SolvedWindow {
  Window window;
  Seed seed;               // seed.model: the window's, after everything
  WindowDiagnostics diagnostics;
};

BundleOptions Adjustment(const FactorizationOptions& options, double sigma_px, int iterations) {
  BundleOptions bundle;
  bundle.loss = options.loss;
  bundle.scale_px = std::max(2 * sigma_px, 0.1);
  bundle.max_iterations = iterations;
  bundle.tolerance = kTolerance;
  return bundle;
}

// The cameras and points of a window by factorisation, from the seed's.
void FactoriseModel(const ImagePoints& points, ProjectiveModel& model, const FactorizationOptions& options,
    WindowDiagnostics& diagnostics) {
  std::vector<int> local(points.FrameCount(), -1);
  std::vector<std::size_t> frames, tracks;
  for (std::size_t f = 0; f < points.FrameCount(); ++f)
    if (model.placed[f]) {
      local[f] = static_cast<int>(frames.size());
      frames.push_back(f);
    }
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    if (model.solved[t]) tracks.push_back(t);
  const auto rows = static_cast<Eigen::Index>(frames.size()), columns = static_cast<Eigen::Index>(tracks.size());
  MeasurementMatrix m;
  m.x.setZero(2 * rows, columns);
  m.seen.setConstant(rows, columns, false);
  for (Eigen::Index j = 0; j < columns; ++j) {
    const std::size_t t = tracks[static_cast<std::size_t>(j)];
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& s = points.tracks[t][k];
      const int i = local[static_cast<std::size_t>(s.frame)];
      if (i < 0 || !model.inlier[t][k]) continue;
      m.seen(i, j) = true;
      m.x.block<2, 1>(2 * i, j) = s.x;
    }
  }
  Eigen::MatrixXd start(3 * rows, 4);
  for (Eigen::Index i = 0; i < rows; ++i) start.middleRows<3>(3 * i) = model.P[frames[static_cast<std::size_t>(i)]];
  FactoriseOptions factorise;
  factorise.max_iterations = options.factorise_iterations;
  const Factorisation result = Factorise(m, start, factorise);
  diagnostics.gap = result.gap;
  diagnostics.rank3_gap = result.rank3_gap;
  if (!result.usable) return;
  ProjectiveModel next = model;
  for (Eigen::Index i = 0; i < rows; ++i) next.P[frames[static_cast<std::size_t>(i)]] = result.P.middleRows<3>(3 * i).normalized();
  for (Eigen::Index j = 0; j < columns; ++j) next.X[tracks[static_cast<std::size_t>(j)]] = result.X.col(j).normalized();
  const double before = RmsPx(points, model), after = RmsPx(points, next);
  if (std::isfinite(after) && !(after > before)) model = std::move(next);
}

// The model with as many tracks as give every frame about `sights` of its own, the longest first: they steer the cameras.
ProjectiveModel Steering(const ImagePoints& points, const ProjectiveModel& model, int sights) {
  ProjectiveModel steering = model;
  if (sights <= 0) return steering;
  std::vector<std::size_t> order;
  std::vector<int> length(points.tracks.size(), 0);
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    if (!model.solved[t]) continue;
    order.push_back(t);
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k)
      length[t] += model.inlier[t][k] && model.placed[static_cast<std::size_t>(points.tracks[t][k].frame)];
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return length[a] > length[b]; });
  std::vector<int> have(points.FrameCount(), 0);
  for (const std::size_t t : order) {
    bool wanted = false;
    for (const Sight& s : points.tracks[t]) {
      const auto f = static_cast<std::size_t>(s.frame);
      wanted = wanted || (model.placed[f] && have[f] < sights);
    }
    steering.solved[t] = wanted;
    for (std::size_t k = 0; wanted && k < points.tracks[t].size(); ++k)
      if (model.inlier[t][k]) ++have[static_cast<std::size_t>(points.tracks[t][k].frame)];
  }
  return steering;
}

// Points of the tracks that did not steer follow the cameras.
void Follow(const ImagePoints& points, const ProjectiveModel& steering, ProjectiveModel& model, const CullOptions& cull) {
  ParallelFor(points.tracks.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t)
      if (model.solved[t] && !steering.solved[t]) IntersectTrack(points, model, t, {std::max(3.0, cull.least_px), cull.min_sights, 0});
  });
}

int MaxSpan(const ProjectiveModel& model, const FactorizationOptions& options) {
  return options.windows.ordered && model.PlacedCount() > kManyFrames ? kMostSpan : 0;
}

// held: frames that do not move; empty: none.
void AdjustAll(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& bundle, int sights, const CullOptions& cull,
               const std::vector<char>& held = {}) {
  ProjectiveModel steering = Steering(points, model, sights);
  if (!AdjustProjective(points, steering, bundle, held).usable) return;
  model.P = steering.P;
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    if (!steering.solved[t]) continue;
    model.X[t] = steering.X[t];
    // A cut track's point is that of its middle.
    if (CutTrack(points, steering, t, bundle).count > 1) steering.solved[t] = 0;
  }
  Follow(points, steering, model, cull);
}

// All tracks of a video whose windows left frames out: the frames `keys` with whole tracks, then the others between them, by tracks
// that are cut: a camera then has to do with its neighbours and with the keys, which hold a long video together.
void AdjustByKeys(const ImagePoints& points, ProjectiveModel& model, const std::vector<char>& keys, BundleOptions bundle, const CullOptions& cull) {
  ProjectiveModel alone = model;
  for (std::size_t f = 0; f < keys.size(); ++f) alone.placed[f] = alone.placed[f] && keys[f];
  Cull(points, alone, cull);
  bundle.max_span = 0;
  AdjustProjective(points, alone, bundle);
  for (std::size_t f = 0; f < keys.size(); ++f)
    if (alone.placed[f]) model.P[f] = alone.P[f];
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (alone.solved[t]) {
      model.X[t] = alone.X[t];
      model.solved[t] = 1;
    }
  bundle.max_span = kMostSpan;
  AdjustProjective(points, model, bundle, keys);
  ProjectiveModel uncut = model;
  for (std::size_t t = 0; t < model.X.size(); ++t) uncut.solved[t] = model.solved[t] && CutTrack(points, model, t, bundle).count == 1;
  Follow(points, uncut, model, cull);
}

SolvedWindow SolveWindow(const ImagePoints& all, Window window, const FactorizationOptions& options) {
  SolvedWindow result;
  WindowDiagnostics& d = result.diagnostics;
  d.first_frame = window.frames.front();
  d.last_frame = window.frames.back();
  d.frames = static_cast<int>(window.frames.size());
  d.tracks = static_cast<int>(window.tracks.size());
  const ImagePoints points = Extract(all, window);
  result.window = std::move(window);
  SeedOptions seed;
  seed.inlier_px = options.inlier_px;
  seed.epipolar_px = options.epipolar_px;
  seed.seed = options.seed;
  result.seed = SeedWindow(points, seed);
  d.parallax_px = result.seed.parallax_px;
  for (PairHomography& pair : result.seed.homographies) {
    pair.a = result.window.frames[static_cast<std::size_t>(pair.a)];
    pair.b = result.window.frames[static_cast<std::size_t>(pair.b)];
  }
  if (result.seed.outcome != SeedOutcome::kPlaced) {
    d.outcome = result.seed.outcome == SeedOutcome::kNoParallax ? "no parallax" : "too few tracks";
    return result;
  }
  ProjectiveModel& model = result.seed.model;
  CullOptions cull = options.cull;
  cull.min_sights = std::min(cull.min_sights, model.PlacedCount());
  Cull(points, model, cull);
  FactoriseModel(points, model, options, d);
  CullResult culled = Cull(points, model, cull);
  if (options.adjust) {
    AdjustAll(points, model, Adjustment(options, culled.sigma_px, 8), options.adjust_sights, cull);
    // Tracks given up at first are asked once more by better cameras.
    for (std::size_t t = 0; t < points.tracks.size(); ++t)
      if (!model.solved[t]) IntersectTrack(points, model, t, {std::max(culled.limit_px, 1.0), cull.min_sights, options.seed});
    culled = Cull(points, model, cull);
  }
  BalanceFrame(model);
  d.sigma_px = culled.sigma_px;
  d.rms_px = RmsPx(points, model);
  d.placed = model.PlacedCount();
  d.solved = model.SolvedCount();
  return result;
}

struct Merged {
  ProjectiveModel model;
  std::vector<WindowDiagnostics> windows;
};

Merged MergeWindows(const ImagePoints& points, std::vector<SolvedWindow>& solved, const FactorizationOptions& options, ProgressSink& sink) {
  Merged result;
  result.model = ProjectiveModel(points);
  ProjectiveModel& whole = result.model;
  std::vector<char> done(solved.size(), 0);
  std::size_t first = 0;
  long most = -1;
  for (std::size_t i = 0; i < solved.size(); ++i) {
    if (solved[i].seed.outcome != SeedOutcome::kPlaced) {
      done[i] = 1;
      continue;
    }
    const long size = static_cast<long>(solved[i].diagnostics.placed) * solved[i].diagnostics.solved;
    if (size > most) most = size, first = i;
  }
  {
    const SolvedWindow& w = solved[first];
    for (std::size_t i = 0; i < w.window.frames.size(); ++i)
      if (w.seed.model.placed[i]) {
        whole.P[static_cast<std::size_t>(w.window.frames[i])] = w.seed.model.P[i];
        whole.placed[static_cast<std::size_t>(w.window.frames[i])] = 1;
      }
    for (std::size_t i = 0; i < w.window.tracks.size(); ++i) {
      if (!w.seed.model.solved[i]) continue;
      const auto t = static_cast<std::size_t>(w.window.tracks[i]);
      whole.X[t] = w.seed.model.X[i];
      whole.solved[t] = 1;
      std::size_t in_window = 0;
      for (std::size_t k = 0; k < points.tracks[t].size(); ++k)
        if (std::binary_search(w.window.frames.begin(), w.window.frames.end(),
            points.tracks[t][k].frame)) whole.inlier[t][k] = w.seed.model.inlier[i][in_window++];
    }
    done[first] = 1;
    solved[first].diagnostics.outcome = "merged";
  }
  Progress progress(sink, "merging windows", static_cast<long>(solved.size()));
  int adjusted_at = whole.PlacedCount();
  std::vector<char> failed(solved.size(), 0);
  while (true) {
    // The window that shares most with what there is.
    std::size_t next = solved.size();
    int best = 0;
    for (std::size_t i = 0; i < solved.size(); ++i) {
      if (done[i] || failed[i]) continue;
      int shared = 0;
      for (std::size_t k = 0; k < solved[i].window.tracks.size(); ++k)
        shared += solved[i].seed.model.solved[k] && whole.solved[static_cast<std::size_t>(solved[i].window.tracks[k])];
      if (shared > best) best = shared, next = i;
    }
    if (next == solved.size()) break;
    MergeOptions merge;
    merge.inlier_px = options.inlier_px;
    merge.seed = options.seed;
    const MergeSummary summary = Merge(points, whole, solved[next].window, solved[next].seed.model, merge);
    solved[next].diagnostics.merge_rms_px = summary.rms_px;
    if (!summary.merged) {
      failed[next] = 1;
      solved[next].diagnostics.outcome = "not connected";
      continue;
    }
    solved[next].diagnostics.outcome = "merged";
    done[next] = 1;
    failed.assign(solved.size(), 0);
    progress.Step();
    BalanceFrame(whole);
    if (options.adjust && whole.PlacedCount() >= 1.7 * adjusted_at) {
      const CullResult culled = Cull(points, whole, options.cull);
      BundleOptions bundle = Adjustment(options, std::max(culled.sigma_px, 0.25), 5);
      bundle.max_span = MaxSpan(whole, options);
      AdjustAll(points, whole, bundle, options.adjust_sights / 2, options.cull);
      adjusted_at = whole.PlacedCount();
    }
  }
  for (const SolvedWindow& w : solved) result.windows.push_back(w.diagnostics);
  return result;
}

[[noreturn]] void Refuse(const ImagePoints& points, const std::vector<PairHomography>& homographies, const std::optional<Camera>& camera) {
  const FactorizationRefusal why = Classify(points, homographies, camera);
  switch (why) {
    case FactorizationRefusal::kTooFewTracks:
      throw FactorizationRefused(why, "no two frames share 16 tracks that agree on one motion",
          "photos with more texture, or closer together");
    case FactorizationRefusal::kNoMotion:
      throw FactorizationRefused(why, "the camera does not move", "move the camera sideways by some percent of the scene's distance");
    case FactorizationRefusal::kPureRotation:
      throw FactorizationRefused(why, "the camera turns but does not move, so there is no depth", "move the camera, do not only turn it");
    case FactorizationRefusal::kPlanarScene:
      throw FactorizationRefused(why, "everything that is seen lies in one plane, which leaves the cameras undetermined",
          "photos with things at different depths");
  }
  throw FactorizationRefused(why, "", "");
}

void TakePoints(const ImagePoints& points, const ProjectiveModel& model, const Tracks& tracks, FactorizationResult& result) {
  result.points.clear();
  result.sights = 0;
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    if (!model.solved[t]) continue;
    FactorizationPoint point;
    point.track = static_cast<int>(t);
    point.X = model.X[t];
    const auto& observations = tracks.tracks[t].observations;
    std::size_t o = 0;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& s = points.tracks[t][k];
      if (!model.inlier[t][k] || !model.placed[static_cast<std::size_t>(s.frame)]) continue;
      while (o < observations.size() && observations[o].frame != s.frame) ++o;
      point.observations.push_back(static_cast<int>(o));
      point.error_px += ReprojectionErrorPx(points, model, s, t);
    }
    if (point.observations.size() < 2) continue;
    point.error_px /= static_cast<double>(point.observations.size());
    result.sights += static_cast<long>(point.observations.size());
    result.points.push_back(std::move(point));
  }
}

void TakeCameras(const ImagePoints& points, const ProjectiveModel& model, FactorizationResult& result) {
  result.placed = model.placed;
  result.P.assign(model.P.size(), Matrix34d::Zero());
  for (std::size_t f = 0; f < model.P.size(); ++f) {
    if (!model.placed[f]) continue;
    Eigen::Matrix3d pixels_from_normalised = Eigen::Matrix3d::Identity();
    pixels_from_normalised(0, 0) = pixels_from_normalised(1, 1) = points.px_per_unit[f];
    pixels_from_normalised.topRightCorner<2, 1>() = points.centre_px[f];
    result.P[f] = pixels_from_normalised * model.P[f];
  }
}

// A metric start, and what adjusting its steering tracks makes of it.
struct MetricAttempt {
  ProjectiveModel model;       // every track, as the start has it
  ProjectiveModel steering;
  MetricModel metric;
  double plane_sigma = 0;
  double projective_rms = 0, rms = 0;   // of the same sights

  double Limit() const { return kMetricRmsFactor * projective_rms + kMetricRmsFloorPx; }
};

// None where a point of the start is no number.
std::optional<MetricAttempt> Attempt(const ImagePoints& points, const ProjectiveModel& projective, MetricModel start, double plane_sigma,
                                     double sigma_px, const FactorizationOptions& options) {
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

// True: result holds the metric reconstruction. False: result.upgrade_reason says why not.
bool TryMetric(const ImagePoints& points, const ProjectiveModel& projective, const std::vector<Window>& windows, const Tracks& tracks,
               const Camera& camera, const FactorizationOptions& options, FactorizationResult& result) {
  auto begin = Clock::now();
  const Eigen::Matrix3d K = camera.K();
  std::vector<Eigen::Matrix3d> K_normalised;
  for (std::size_t f = 0; f < points.FrameCount(); ++f) K_normalised.push_back(NormalisedFromPixels(points, f) * K);
  const Upgrade upgrade = UpgradeToEuclidean(points, projective, K_normalised);
  result.seconds.upgrade += Since(begin);
  result.upgrade_condition = upgrade.condition;
  result.upgrade_plane_sigma = upgrade.plane_sigma;
  result.upgrade_residual = upgrade.residual;
  begin = Clock::now();
  MetricModel start;
  const Eigen::Vector2d focal = camera.FocalPx(), principal = camera.PrincipalPointPx();
  start.intrinsics_px << focal, principal;
  std::optional<MetricAttempt> attempt;
  if (const auto inverse = InverseOf(upgrade.H); upgrade.found && inverse) {
    start.cam_from_world = upgrade.cam_from_world;
    start.X.assign(projective.X.size(), Eigen::Vector4d::Zero());
    for (std::size_t t = 0; t < start.X.size(); ++t)
      if (projective.solved[t]) start.X[t] = (*inverse * projective.X[t]).normalized();
    attempt = Attempt(points, projective, start, upgrade.plane_sigma, result.sigma_px, options);
  }
  const auto explained = [&] { return attempt && attempt->rms <= attempt->Limit(); };
  if (options.adjust && windows.size() > 1 && !explained()) {
    // No one plane at infinity does for all frames; each window may have its own. Where tracks are short, only short ones have.
    WindowUpgradeOptions by_windows;
    by_windows.loss = options.loss;
    by_windows.sigma_px = result.sigma_px;
    by_windows.max_rms_factor = kMetricRmsFactor;
    by_windows.max_rms_more_px = kMetricRmsFloorPx;
    std::vector<std::vector<Window>> splits{windows};
    if (options.windows.ordered) splits.push_back(SplitIntoWindows(points, kShortWindows));
    for (const std::vector<Window>& split : splits) {
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
  }
  result.seconds.metric += Since(begin);
  if (!attempt) {
    result.upgrade_reason = "no plane at infinity could be computed";
    return false;
  }
  ProjectiveModel &model = attempt->model, &steering = attempt->steering;
  MetricModel& metric = attempt->metric;
  const double projective_rms = attempt->projective_rms, rms = attempt->rms;
  BundleOptions bundle = Adjustment(options, result.sigma_px, 30);
  bundle.tolerance = kFineTolerance;
  CullOptions cull = options.cull;
  cull.min_sights = std::min(cull.min_sights, model.PlacedCount());
  if (options.adjust ? !(rms <= attempt->Limit()) : !(upgrade.residual < 0.1)) {
    result.upgrade_reason = "the intrinsics do not explain the images: reprojection error " + Fixed(rms, 2) + " px with them, " +
                            Fixed(projective_rms, 2) + " px without";
    return false;
  }
  if (!(attempt->plane_sigma <= options.max_plane_sigma)) {
    result.upgrade_reason = "the plane at infinity is ill-conditioned (baseline too short for the noise): relative uncertainty of depths " +
                            Fixed(attempt->plane_sigma, 2);
    return false;
  }
  begin = Clock::now();
  if (options.adjust && options.intrinsics == FreeIntrinsics::kNone && rms > kSuspectRmsFactor * projective_rms + kSuspectRmsFloorPx) {
    // What would the images say?
    MetricModel other = metric;
    const double free_rms = AdjustMetric(points, steering, other, FreeIntrinsics::kFocal, bundle).rms_px;
    result.warnings.push_back("the intrinsics fit the images worse than they should (" + Fixed(rms, 3) + " px with them, " +
        Fixed(projective_rms, 3) +
                              " px without): a focal length of " + Fixed(other.intrinsics_px[0], 1) + " px instead of " + Fixed(focal[0],
                                  1) +
                              " px gives " + Fixed(free_rms, 3) + " px");
  }
  if (options.adjust) Follow(points, steering, model, cull);
  CullResult culled = Cull(points, model, cull);
  for (std::size_t t = 0; t < model.X.size(); ++t)
    if (model.solved[t]) metric.X[t] = model.X[t];
  if (options.adjust) {
    bundle = Adjustment(options, culled.sigma_px, 10);
    bundle.tolerance = 1e-5;
    // The tracks that steer hold a long video's ends together; the others add to what neighbours know of each other.
    bundle.max_span = MaxSpan(model, options);
    bundle.whole = steering.solved;
    AdjustMetric(points, model, metric, options.intrinsics, bundle);
    ToProjective(points, metric, model);
    ProjectiveModel uncut = model;
    for (std::size_t t = 0; t < model.X.size(); ++t) uncut.solved[t] = model.solved[t] && CutTrack(points, model, t, bundle).count == 1;
    Follow(points, uncut, model, cull);
    culled = Cull(points, model, cull);
  }
  long front = 0, sights = 0;
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    if (!model.solved[t]) continue;
    // Far points lie on either side of infinity by their noise; only those that are surely near can be behind.
    const double w = model.X[t].w();
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const auto f = static_cast<std::size_t>(points.tracks[t][k].frame);
      if (!model.placed[f] || !model.inlier[t][k]) continue;
      ++sights;
      front += w > -1e-3 && model.P[f].row(2).dot(model.X[t]) > 0;
    }
  }
  result.seconds.metric += Since(begin);
  if (sights == 0 || static_cast<double>(front) < kLeastFrontShare * static_cast<double>(sights)) {
    result.upgrade_reason = "points behind their cameras after the upgrade";
    return false;
  }
  result.upgrade = UpgradeKind::kMetric;
  result.upgrade_reason.clear();
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

}  // namespace

std::string Validate(const FactorizationOptions& options) {
  if (std::string wrong = Validate(options.windows); !wrong.empty()) return wrong;
  if (!(options.inlier_px > 0) || !(options.epipolar_px > 0)) return "inlier limits must be above 0 pixels";
  if (!(options.cull.sigmas > 0) || !(options.cull.least_px > 0) ||
      !(options.cull.most_px >= options.cull.least_px)) return "cull limits must be above 0 and in order";
  if (options.cull.min_sights < 2) return "a track needs at least 2 sights";
  if (options.factorise_iterations < 0 || options.adjust_sights < 0) return "iterations and sights must not be negative";
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

FactorizationResult ReconstructFromTracks(const Tracks& tracks, const std::optional<Camera>& camera, const FactorizationOptions& options,
                                          ProgressSink& sink) {
  const auto start = Clock::now();
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  if (camera)
    if (const auto wrong = Validate(*camera)) throw UsageError("camera: " + *wrong);
  const ImagePoints points = Normalise(tracks, camera);
  FactorizationResult result;
  if (points.FrameCount() < 2) Refuse(points, {}, camera);

  // Windows side by side; where none has parallax, longer ones.
  std::vector<Window> windows;
  std::vector<SolvedWindow> solved;
  std::vector<PairHomography> homographies;
  WindowOptions window_options = options.windows;
  const auto frame_count = static_cast<int>(points.FrameCount());
  int lasting = window_options.length;   // frames from a window's first to its last
  while (true) {
    windows = SplitIntoWindows(points, window_options);
    solved.assign(windows.size(), {});
    Progress progress(sink, "factorising windows", static_cast<long>(windows.size()));
    ParallelFor(windows.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        solved[i] = SolveWindow(points, windows[i], options);
        progress.Step();
      }
    });
    bool any = false;
    for (const SolvedWindow& w : solved) {
      any = any || w.seed.outcome == SeedOutcome::kPlaced;
      homographies.insert(homographies.end(), w.seed.homographies.begin(), w.seed.homographies.end());
    }
    std::vector<double> parallax;
    for (const SolvedWindow& w : solved) parallax.push_back(w.diagnostics.parallax_px);
    std::nth_element(parallax.begin(), parallax.begin() + static_cast<std::ptrdiff_t>(parallax.size() / 2), parallax.end());
    // Frames that nothing links stay apart however long the windows are.
    const bool all_frames = windows.size() < 2 || lasting >= frame_count;
    if (any && (all_frames || parallax[parallax.size() / 2] >= kLeastParallaxPx)) break;
    if (!any && all_frames) Refuse(points, homographies, camera);
    if (any && !options.windows.ordered) break;
    lasting = std::min(3 * lasting, frame_count);
    if (options.windows.ordered) window_options.stride = (lasting + kMostInWindow - 1) / kMostInWindow;
    window_options.length = (lasting + window_options.stride - 1) / window_options.stride;
    window_options.overlap = std::min(2 * window_options.overlap, window_options.length - 1);
    window_options.min_shared = std::min(window_options.min_shared, 16);
    homographies.clear();
  }
  result.seconds.windows = Since(start);

  auto begin = Clock::now();
  Merged merged = MergeWindows(points, solved, options, sink);
  solved.clear();
  ProjectiveModel& model = merged.model;
  result.windows = std::move(merged.windows);
  result.seconds.merging = Since(begin);

  std::vector<char> keys;   // the frames of windows that left others out
  if (window_options.stride > 1) {
    keys.assign(points.FrameCount(), 0);
    for (const Window& w : windows)
      for (const int f : w.frames) keys[static_cast<std::size_t>(f)] = 1;
  }

  begin = Clock::now();
  {
    Progress progress(sink, "projective adjustment", options.adjust ? 3 : 1);
    CullResult culled = Cull(points, model, options.cull);
    BundleOptions bundle = Adjustment(options, std::max(culled.sigma_px, 0.25), 10);
    bundle.max_span = MaxSpan(model, options);
    if (options.adjust) AdjustAll(points, model, bundle, options.adjust_sights, options.cull);
    progress.Step();
    CullOptions cull = options.cull;
    cull.min_sights = std::min(cull.min_sights, std::max(2, model.PlacedCount()));
    culled = Cull(points, model, cull);
    // Frames that no window could place, and tracks that no window could solve, see the whole now.
    SeedOptions grow;
    grow.inlier_px = options.inlier_px;
    grow.seed = options.seed;
    if (model.PlacedCount() < static_cast<int>(points.FrameCount())) Grow(points, model, grow);
    ParallelFor(points.tracks.size(), 32, [&](std::size_t from, std::size_t to) {
      for (std::size_t t = from; t < to; ++t)
        if (!model.solved[t]) IntersectTrack(points, model, t, {std::max(culled.limit_px, 1.0), cull.min_sights, options.seed});
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
  // A frame with next to nothing left is not placed.
  std::vector<int> sights(points.FrameCount(), 0), seen(points.FrameCount(), 0);
  for (std::size_t t = 0; t < points.tracks.size(); ++t)
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      ++seen[static_cast<std::size_t>(points.tracks[t][k].frame)];
      if (model.solved[t] && model.inlier[t][k]) ++sights[static_cast<std::size_t>(points.tracks[t][k].frame)];
    }
  for (std::size_t f = 0; f < points.FrameCount(); ++f) {
    if (model.placed[f] && sights[f] < 8) model.placed[f] = 0;
    if (model.placed[f]) continue;
    const std::string reason = seen[f] == 0    ? "no tracks"
                               : seen[f] < 12 ? "too few tracks (" + std::to_string(seen[f]) + ")"
                                              : "too few of its tracks agree with the other frames";
    result.missing.push_back({static_cast<int>(f), reason});
  }
  if (model.PlacedCount() < 2) Refuse(points, homographies, camera);
  result.projective_rms_px = RmsPx(points, model);
  result.seconds.projective = Since(begin);

  if (camera && !options.projective_only) {
    Progress progress(sink, "upgrade to a metric frame", 1);
    TryMetric(points, model, windows, tracks, *camera, options, result);
    progress.Step();
  } else {
    result.upgrade_reason = camera ? "a projective scene was asked for" : "the intrinsics are not known";
  }
  if (result.upgrade != UpgradeKind::kMetric) {
    begin = Clock::now();
    if (options.adjust) {
      // No further adjustment follows: this one takes every track.
      CullOptions cull = options.cull;
      cull.min_sights = std::min(cull.min_sights, model.PlacedCount());
      BundleOptions bundle = Adjustment(options, result.sigma_px, 10);
      bundle.tolerance = 1e-4;
      if (keys.empty()) AdjustProjective(points, model, bundle);
      else AdjustByKeys(points, model, keys, bundle, cull);
      const CullResult culled = Cull(points, model, cull);
      result.sigma_px = culled.sigma_px;
      result.culled = culled.culled;
      result.projective_rms_px = RmsPx(points, model);
      result.seconds.projective += Since(begin);
      begin = Clock::now();
    }
    if (!camera && DeviationFromConstantOrientation(points, model) < kConstantOrientation)
      result.upgrade_reason = "constant orientation: the camera never turns, which leaves unknown intrinsics undetermined";
    const QuasiAffine quasi = SolveQuasiAffine(points, model);
    result.quasi_affine_margin = quasi.margin;
    if (quasi.solved) {
      result.upgrade = UpgradeKind::kQuasiAffine;
    } else {
      result.upgrade_reason += "; and no plane has all points and cameras on one side (" + std::to_string(quasi.sign_conflicts) + " of " +
                               std::to_string(quasi.sights) + " sights behind their camera)";
    }
    if (!(camera && options.projective_only)) result.warnings.push_back(std::string(Name(result.upgrade)) + " instead of metric: " +
        result.upgrade_reason);
    TakeCameras(points, model, result);
    TakePoints(points, model, tracks, result);
    result.rms_px = RmsPx(points, model);
    result.seconds.upgrade += Since(begin);
  }
  if (!result.missing.empty())
    result.warnings.push_back(std::to_string(result.missing.size()) + " of " + std::to_string(points.FrameCount()) +
        " frames have no camera");
  for (const WindowDiagnostics& w : result.windows)
    if (w.outcome == "not connected")
      result.warnings.push_back("frames " + std::to_string(w.first_frame) + " to " + std::to_string(w.last_frame) +
          " share too little with the rest");
  result.seconds.total = Since(start);
  return result;
}

}  // namespace lumi
