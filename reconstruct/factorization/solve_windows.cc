#include "reconstruct/factorization/solve_windows.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/rank4_factorization.h"
#include "reconstruct/factorization/refusal.h"
#include "reconstruct/factorization/steering.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// Windows in which things move apart by less than this are made longer; beyond so many frames by leaving frames out,
// which the others' points place later: a window's cost grows with the square of its frames, and neighbours say the
// same.
constexpr double kLeastParallaxPx = 6.0;
constexpr int kMostInWindow = 60;

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
  for (Eigen::Index i = 0; i < rows; ++i)
    next.P[frames[static_cast<std::size_t>(i)]] = result.P.middleRows<3>(3 * i).normalized();
  for (Eigen::Index j = 0; j < columns; ++j) next.X[tracks[static_cast<std::size_t>(j)]] = result.X.col(j).normalized();
  const double before = RmsPx(points, model), after = RmsPx(points, next);
  if (std::isfinite(after) && !(after > before)) model = std::move(next);
}

SolvedWindow SolveWindow(const ImagePoints& all, FrameWindow window, const FactorizationOptions& options) {
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
      if (!model.solved[t])
        IntersectTrack(points, model, t, {std::max(culled.limit_px, 1.0), cull.min_sights, options.seed});
    culled = Cull(points, model, cull);
  }
  BalanceFrame(model);
  d.sigma_px = culled.sigma_px;
  d.rms_px = RmsPx(points, model);
  d.placed = model.PlacedCount();
  d.solved = model.SolvedCount();
  return result;
}

}  // namespace

SolvedWindows SolveWindows(const ImagePoints& points, const std::optional<Camera>& camera,
                           const FactorizationOptions& options, ProgressSink& sink) {
  SolvedWindows result;
  std::vector<SolvedWindow>& solved = result.solved;
  std::vector<PairHomography>& homographies = result.homographies;
  WindowOptions window_options = options.windows;
  const auto frame_count = static_cast<int>(points.FrameCount());
  int lasting = window_options.length;  // frames from a window's first to its last
  while (true) {
    std::vector<FrameWindow> windows = SplitIntoWindows(points, window_options);
    solved.assign(windows.size(), {});
    Progress progress(sink, "factorising windows", static_cast<long>(windows.size()));
    ParallelEach(windows.size(), 1, [&](std::size_t i) {
      solved[i] = SolveWindow(points, std::move(windows[i]), options);
      progress.Step();
    });
    bool any = false;
    for (const SolvedWindow& w : solved) {
      any = any || w.seed.outcome == SeedOutcome::kPlaced;
      homographies.insert(homographies.end(), w.seed.homographies.begin(), w.seed.homographies.end());
    }
    std::vector<double> parallax;
    for (const SolvedWindow& w : solved) parallax.push_back(w.diagnostics.parallax_px);
    // Frames that nothing links stay apart however long the windows are.
    const bool all_frames = windows.size() < 2 || lasting >= frame_count;
    if (any && (all_frames || Median(parallax) >= kLeastParallaxPx)) break;
    if (!any && all_frames) Refuse(points, homographies, camera);
    if (any && !options.windows.ordered) break;
    lasting = std::min(3 * lasting, frame_count);
    if (options.windows.ordered) window_options.stride = (lasting + kMostInWindow - 1) / kMostInWindow;
    window_options.length = (lasting + window_options.stride - 1) / window_options.stride;
    window_options.overlap = std::min(2 * window_options.overlap, window_options.length - 1);
    window_options.min_shared = std::min(window_options.min_shared, 16);
    homographies.clear();
  }
  if (window_options.stride > 1) {
    result.keys.assign(points.FrameCount(), 0);
    for (const SolvedWindow& w : solved)
      for (const int f : w.window.frames) result.keys[static_cast<std::size_t>(f)] = 1;
  }
  return result;
}

}  // namespace lumi
