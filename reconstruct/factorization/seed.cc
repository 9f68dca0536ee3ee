#include "reconstruct/factorization/seed.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/factorization/intersection.h"
#include "reconstruct/factorization/resection.h"
#include "reconstruct/factorization/two_view.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

constexpr int kMinResectionPoints = 12;
constexpr double kMinResectionShare = 0.3;

struct SharedPoints {
  std::vector<Eigen::Vector2d> a, b;
  std::vector<std::size_t> track;
};

const Sight* SightIn(const std::vector<Sight>& track, int frame) {
  const auto it = std::ranges::lower_bound(track, frame, {}, &Sight::frame);
  return it != track.end() && it->frame == frame ? &*it : nullptr;
}

SharedPoints Shared(const ImagePoints& points, int a, int b) {
  SharedPoints shared;
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    const Sight* sa = SightIn(points.tracks[t], a);
    const Sight* sb = sa ? SightIn(points.tracks[t], b) : nullptr;
    if (!sb) continue;
    shared.a.push_back(sa->x);
    shared.b.push_back(sb->x);
    shared.track.push_back(t);
  }
  return shared;
}

struct PairGuess {
  int a, b;
  double score;
};

// Pairs ordered by what they promise: many shared tracks that move differently.
std::vector<PairGuess> PromisingPairs(const ImagePoints& points, int most) {
  const int n = static_cast<int>(points.FrameCount());
  std::vector<PairGuess> guesses;
  std::vector<double> u, v;
  // The frame-by-frame table of positions makes each pair a single pass.
  const std::size_t tracks = points.tracks.size();
  std::vector<Eigen::Vector2d> at(static_cast<std::size_t>(n) * tracks, Eigen::Vector2d::Constant(NAN));
  for (std::size_t t = 0; t < tracks; ++t)
    for (const Sight& s : points.tracks[t]) at[static_cast<std::size_t>(s.frame) * tracks + t] = s.x;
  // Long windows: every pair of a dozen frames is enough.
  const int step = std::max(1, n / 12);
  std::vector<int> chosen;
  for (int f = 0; f < n; f += step) chosen.push_back(f);
  if (chosen.back() != n - 1) chosen.push_back(n - 1);
  for (std::size_t i = 0; i < chosen.size(); ++i)
    for (std::size_t j = i + 1; j < chosen.size(); ++j) {
      u.clear();
      v.clear();
      const Eigen::Vector2d *a = &at[static_cast<std::size_t>(chosen[i]) * tracks],
                            *b = &at[static_cast<std::size_t>(chosen[j]) * tracks];
      for (std::size_t t = 0; t < tracks; ++t) {
        const Eigen::Vector2d d = b[t] - a[t];
        if (std::isnan(d.x())) continue;
        u.push_back(d.x());
        v.push_back(d.y());
      }
      if (u.size() < 16) continue;
      const double mu = Median(u), mv = Median(v);
      for (double& x : u) x = std::abs(x - mu);
      for (double& x : v) x = std::abs(x - mv);
      const double spread_px = (Median(u) + Median(v)) * points.px_per_unit[static_cast<std::size_t>(chosen[j])];
      guesses.push_back(
          {chosen[i], chosen[j], std::min<double>(static_cast<double>(u.size()), 150) * std::min(spread_px, 60.0)});
    }
  std::ranges::stable_sort(guesses, [](const PairGuess& a, const PairGuess& b) { return a.score > b.score; });
  if (static_cast<int>(guesses.size()) > most) {
    // Half from the top, the rest spread over the list: the best-looking pairs resemble each other.
    std::vector<PairGuess> picked(guesses.begin(), guesses.begin() + most / 2);
    const std::size_t rest = guesses.size() - picked.size();
    for (int k = 0; k < most - most / 2; ++k)
      picked.push_back(guesses[static_cast<std::size_t>(most / 2) +
                               rest * static_cast<std::size_t>(k) / static_cast<std::size_t>(most)]);
    guesses = std::move(picked);
  }
  return guesses;
}

void IntersectAll(const ImagePoints& points, ProjectiveModel& model, const IntersectionOptions& options) {
  for (std::size_t t = 0; t < points.tracks.size(); ++t) IntersectTrack(points, model, t, options);
}

}  // namespace

int Grow(const ImagePoints& points, ProjectiveModel& model, const SeedOptions& options) {
  const std::size_t n = points.FrameCount();
  int placed_now = 0;
  std::vector<int> tried_with(n, 0);
  IntersectionOptions intersection{options.inlier_px, 2, options.seed};
  int next_pass = std::max(4, model.PlacedCount() * 2);
  while (true) {
    std::vector<int> visible(n, 0);
    for (std::size_t t = 0; t < points.tracks.size(); ++t)
      if (model.solved[t])
        for (const Sight& s : points.tracks[t]) ++visible[static_cast<std::size_t>(s.frame)];
    int pick = -1;
    for (std::size_t f = 0; f < n; ++f)
      if (!model.placed[f] && visible[f] >= kMinResectionPoints && visible[f] > tried_with[f] * 1.2 &&
          (pick < 0 || visible[f] > visible[static_cast<std::size_t>(pick)]))
        pick = static_cast<int>(f);
    if (pick < 0) break;
    const auto f = static_cast<std::size_t>(pick);
    tried_with[f] = visible[f];
    std::vector<Eigen::Vector4d> X;
    std::vector<Eigen::Vector2d> x;
    std::vector<std::size_t> track;
    for (std::size_t t = 0; t < points.tracks.size(); ++t)
      if (model.solved[t])
        if (const Sight* s = SightIn(points.tracks[t], pick)) {
          X.push_back(model.X[t]);
          x.push_back(s->x);
          track.push_back(t);
        }
    ResectionOptions resection;
    resection.inlier_px = options.inlier_px;
    resection.seed = options.seed + f;
    resection.min_inliers =
        std::max(kMinResectionPoints, static_cast<int>(kMinResectionShare * static_cast<double>(X.size())));
    const auto camera = Resect(X, x, points.px_per_unit[f], resection);
    if (!camera) continue;
    model.P[f] = camera->P;
    model.placed[f] = 1;
    ++placed_now;
    for (std::size_t i = 0; i < track.size(); ++i) {
      auto& flags = model.inlier[track[i]];
      flags[static_cast<std::size_t>(SightIn(points.tracks[track[i]], pick) - points.tracks[track[i]].data())] =
          camera->inlier[i];
    }
    // Tracks gain from every camera that sees them; the solved ones are asked again each time the cameras' number has
    // doubled.
    if (model.PlacedCount() >= next_pass) {
      next_pass = 2 * model.PlacedCount();
      IntersectAll(points, model, intersection);
    } else {
      for (std::size_t t = 0; t < points.tracks.size(); ++t)
        if (!model.solved[t] && SightIn(points.tracks[t], pick)) IntersectTrack(points, model, t, intersection);
    }
  }
  return placed_now;
}

Seed SeedWindow(const ImagePoints& points, const SeedOptions& options) {
  Seed result;
  result.model = ProjectiveModel(points);
  if (points.FrameCount() < 2) return result;
  TwoView best;
  SharedPoints best_points;
  double best_score = 0;
  for (const PairGuess& guess : PromisingPairs(points, std::max(1, options.pairs))) {
    SharedPoints shared = Shared(points, guess.a, guess.b);
    TwoViewOptions two_view_options;
    two_view_options.inlier_px = options.epipolar_px;
    two_view_options.seed =
        options.seed + static_cast<std::uint64_t>(guess.a) * 1009 + static_cast<std::uint64_t>(guess.b);
    TwoView two = EstimateTwoView(shared.a, shared.b, points.px_per_unit[static_cast<std::size_t>(guess.a)],
                                  points.px_per_unit[static_cast<std::size_t>(guess.b)], two_view_options);
    if (two.kind == TwoViewKind::kHomography) result.homographies.push_back({guess.a, guess.b, two.H});
    if (two.kind != TwoViewKind::kGeneral) continue;
    const double score = two.off_plane_count * std::min(two.parallax_px, 40.0);
    if (!(score > best_score)) continue;
    best_score = score;
    best = std::move(two);
    best_points = std::move(shared);
    result.a = guess.a;
    result.b = guess.b;
    if (best.off_plane_count > 100 && best.parallax_px > 15) break;
  }
  if (!(best_score > 0)) {
    if (!result.homographies.empty()) result.outcome = SeedOutcome::kNoParallax;
    return result;
  }
  result.parallax_px = best.parallax_px;
  ProjectiveModel& model = result.model;
  const auto a = static_cast<std::size_t>(result.a), b = static_cast<std::size_t>(result.b);
  model.P[a] = Matrix34d::Identity().normalized();
  model.P[b] = CanonicalCamera(best.F).normalized();
  model.placed[a] = model.placed[b] = 1;
  const IntersectionOptions intersection{options.inlier_px, 2, options.seed};
  for (std::size_t i = 0; i < best_points.track.size(); ++i)
    if (best.inlier[i]) IntersectTrack(points, model, best_points.track[i], intersection);
  BalanceFrame(model);
  result.outcome = SeedOutcome::kPlaced;
  Grow(points, model, options);
  IntersectAll(points, model, intersection);
  BalanceFrame(model);
  if (model.PlacedCount() < 3) return result;
  // Outliers that happen to lie on epipolar lines look like parallax in two frames; with more frames they are known.
  SharedPoints clean;
  for (std::size_t i = 0; i < best_points.track.size(); ++i) {
    const std::size_t t = best_points.track[i];
    if (!model.solved[t]) continue;
    int inliers = 0;
    bool in_pair = true;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& s = points.tracks[t][k];
      const bool agrees = model.inlier[t][k] != 0;
      inliers += agrees && model.placed[static_cast<std::size_t>(s.frame)];
      in_pair = in_pair && (agrees || (s.frame != result.a && s.frame != result.b));
    }
    if (inliers < 3 || !in_pair) continue;
    clean.a.push_back(best_points.a[i]);
    clean.b.push_back(best_points.b[i]);
  }
  TwoViewOptions again;
  again.inlier_px = options.epipolar_px;
  again.seed = options.seed;
  const TwoView checked = EstimateTwoView(clean.a, clean.b, points.px_per_unit[a], points.px_per_unit[b], again);
  if (checked.kind == TwoViewKind::kHomography) {
    result.outcome = SeedOutcome::kNoParallax;
    result.homographies.push_back({result.a, result.b, checked.H});
  }
  return result;
}

}  // namespace lumi
