#include "reconstruct/factorization/steering.h"

#include <algorithm>

#include "reconstruct/factorization/intersection.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// A video of more frames than the first is adjusted with its tracks cut after the second, until the last adjustments.
constexpr int kManyFrames = 100, kMostSpan = 40;
constexpr double kTolerance = 1e-3;

}  // namespace

BundleOptions Adjustment(const FactorizationOptions& options, double sigma_px, int iterations) {
  BundleOptions bundle;
  bundle.loss = options.loss;
  bundle.scale_px = std::max(2 * sigma_px, 0.1);
  bundle.max_iterations = iterations;
  bundle.tolerance = kTolerance;
  return bundle;
}

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
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return length[a] > length[b]; });
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

void Follow(const ImagePoints& points, const ProjectiveModel& steering, ProjectiveModel& model,
            const CullOptions& cull) {
  ParallelEach(points.tracks.size(), 32, [&](std::size_t t) {
    if (model.solved[t] && !steering.solved[t])
      IntersectTrack(points, model, t, {std::max(3.0, cull.least_px), cull.min_sights, 0});
  });
}

void FollowWhereCut(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& bundle,
                    const CullOptions& cull) {
  ProjectiveModel uncut = model;
  for (std::size_t t = 0; t < model.X.size(); ++t)
    uncut.solved[t] = model.solved[t] && CutTrack(points, model, t, bundle).count == 1;
  Follow(points, uncut, model, cull);
}

int MaxSpan(const ProjectiveModel& model, const FactorizationOptions& options) {
  return options.windows.ordered && model.PlacedCount() > kManyFrames ? kMostSpan : 0;
}

void AdjustAll(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& bundle, int sights,
               const CullOptions& cull, const std::vector<char>& held) {
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

void AdjustByKeys(const ImagePoints& points, ProjectiveModel& model, const std::vector<char>& keys,
                  BundleOptions bundle, const CullOptions& cull) {
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
  FollowWhereCut(points, model, bundle, cull);
}

}  // namespace lumi
