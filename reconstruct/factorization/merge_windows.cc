#include "reconstruct/factorization/merge_windows.h"

#include <algorithm>

#include "reconstruct/factorization/merge.h"
#include "reconstruct/factorization/steering.h"

namespace lumi {

MergedWindows MergeWindows(const ImagePoints& points, std::vector<SolvedWindow> solved,
                           const FactorizationOptions& options, ProgressSink& sink) {
  MergedWindows result;
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
        if (std::ranges::binary_search(w.window.frames, points.tracks[t][k].frame))
          whole.inlier[t][k] = w.seed.model.inlier[i][in_window++];
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

}  // namespace lumi
