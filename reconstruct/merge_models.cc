#include "reconstruct/merge_models.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "reconstruct/factorization/ransac.h"
#include "reconstruct/place_camera.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

// A point of the other model counts as the same one where its photos show it within this; the two models' own errors
// add up, so more than a pose is given.
constexpr double kMaxMergeErrorPx = 2 * kMaxPoseErrorPx;
// Photos of a track that are asked: more say the same.
constexpr std::size_t kPhotosAsked = 3;
// Points on a line leave the turn about it open: their second extent over the first must be larger.
constexpr double kMinFlatness = 0.02;
constexpr int kMergeRefinements = 3;

using PixelOfView = std::pair<std::int32_t, std::pair<double, double>>;

PixelOfView At(ViewId view, const Eigen::Vector2d& x_px) { return {view.value, {x_px.x(), x_px.y()}}; }

// Both models' photos, each once: a's views, then those of b that a lacks.
struct BInA {
  std::vector<std::int32_t> view;  // of b -> its number among both
  int common = 0;
};

BInA PlaceOf(const Scene& a, const Scene& b) {
  std::map<std::string, std::int32_t> of_a;
  for (std::size_t v = 0; v < a.views.size(); ++v) of_a[a.views[v].name] = static_cast<std::int32_t>(v);
  BInA place;
  auto next = static_cast<std::int32_t>(a.views.size());
  for (const View& view : b.views) {
    const auto it = of_a.find(view.name);
    place.view.push_back(it != of_a.end() ? it->second : next++);
    place.common += it != of_a.end();
  }
  return place;
}

// Views only, and cameras.
Scene JoinedViews(const Scene& a, const Scene& b, const BInA& place, const SameCamera& same_camera) {
  Scene joint;
  joint.cameras = a.cameras;
  joint.views = a.views;
  joint.image_folder = a.image_folder;
  std::map<std::int32_t, CameraId> camera_of_b;
  for (std::size_t v = 0; v < b.views.size(); ++v) {
    const View& view = b.views[v];
    if (static_cast<std::size_t>(place.view[v]) < a.views.size()) continue;
    auto [camera, is_new] = camera_of_b.try_emplace(view.camera.value);
    if (is_new) {
      const auto shared =
          std::ranges::find_if(a.views, [&](const View& other) { return same_camera(other.name, view.name); });
      if (shared != a.views.end()) {
        camera->second = shared->camera;
      } else {
        camera->second = CameraId{static_cast<std::int32_t>(joint.cameras.size())};
        joint.cameras.push_back(b.CameraOf(view));
      }
    }
    joint.views.push_back(view);
    joint.views.back().camera = camera->second;
  }
  return joint;
}

// Points of a and b that a pixel or a match ties together: each once, with the partner that most tie it to.
std::vector<std::pair<std::int32_t, std::int32_t>> CommonPoints(const Scene& a, const Scene& b, const BInA& place,
                                                                const std::vector<ViewMatches>& matches) {
  // Only photos that both have, or that a match names, can tie anything.
  std::vector<char> asked(a.views.size() + b.views.size(), 0);
  for (const std::int32_t v : place.view)
    if (static_cast<std::size_t>(v) < a.views.size()) asked[static_cast<std::size_t>(v)] = 1;
  for (const ViewMatches& m : matches)
    for (const ViewId view : {m.a, m.b}) asked[static_cast<std::size_t>(view.value)] = 1;
  std::map<PixelOfView, std::int32_t> in_a, in_b;
  const auto note = [&](auto& in, ViewId view, const Observation& o, std::size_t point) {
    if (asked[static_cast<std::size_t>(view.value)]) in[At(view, o.x_px)] = static_cast<std::int32_t>(point);
  };
  for (std::size_t p = 0; p < a.points.size(); ++p)
    for (const Observation& o : a.points[p].track) note(in_a, o.view, o, p);
  for (std::size_t p = 0; p < b.points.size(); ++p)
    for (const Observation& o : b.points[p].track)
      note(in_b, ViewId{place.view[static_cast<std::size_t>(o.view.value)]}, o, p);
  std::map<std::pair<std::int32_t, std::int32_t>, int> votes;
  const auto vote = [&](const PixelOfView& of_a, const PixelOfView& of_b) {
    const auto p = in_a.find(of_a), q = in_b.find(of_b);
    if (p != in_a.end() && q != in_b.end()) ++votes[{p->second, q->second}];
  };
  for (const auto& [pixel, point] : in_b) vote(pixel, pixel);
  for (const ViewMatches& m : matches)
    for (const auto& [x_a, x_b] : m.px) {
      vote(At(m.a, x_a), At(m.b, x_b));
      vote(At(m.b, x_b), At(m.a, x_a));
    }
  std::vector<std::pair<int, std::pair<std::int32_t, std::int32_t>>> order;
  for (const auto& [pair, count] : votes) order.emplace_back(-count, pair);
  std::ranges::sort(order);
  std::set<std::int32_t> used_a, used_b;
  std::vector<std::pair<std::int32_t, std::int32_t>> common;
  for (const auto& [count, pair] : order)
    if (!used_a.contains(pair.first) && !used_b.contains(pair.second)) {
      used_a.insert(pair.first), used_b.insert(pair.second);
      common.push_back(pair);
    }
  return common;
}

// The squared error, at worst, of a place in the photos that see `point`; infinity behind one of them.
double SquaredErrorIn(const Scene& scene, const Point& point, const Eigen::Vector3d& x_in_world) {
  double worst = 0;
  const std::size_t count = std::min(point.track.size(), kPhotosAsked);
  for (std::size_t k = 0; k < count; ++k) {
    const Observation& o = point.track[count < 2 ? 0 : k * (point.track.size() - 1) / (count - 1)];
    const View& view = scene.views[static_cast<std::size_t>(o.view.value)];
    const Eigen::Vector3d x_in_cam = view.cam_from_world * x_in_world;
    const auto x = x_in_cam.z() > 0 ? scene.CameraOf(view).Project(x_in_cam) : std::nullopt;
    if (!x) return std::numeric_limits<double>::infinity();
    worst = std::max(worst, (*x - o.x_px).squaredNorm());
  }
  return worst;
}

bool LieOnALine(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : points) middle += x / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : points) spread += (x - middle) * (x - middle).transpose();
  const Eigen::Vector3d extent2 = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues();
  return !(extent2[1] > kMinFlatness * kMinFlatness * extent2[2]);
}

}  // namespace

Scene JoinModels(const Scene& a, const Scene& b, const ModelTie& tie, const SameCamera& same_camera) {
  const auto& [a_from_b, common_photos, common_points, agree_unmoved, same_of_b] = tie;
  const BInA of_b = PlaceOf(a, b);
  Scene merged = JoinedViews(a, b, of_b, same_camera);
  for (std::size_t v = a.views.size(); v < merged.views.size(); ++v)
    merged.views[v].cam_from_world = TransformPose(merged.views[v].cam_from_world, a_from_b);
  merged.points = a.points;
  std::set<PixelOfView> taken;
  for (const Point& point : a.points)
    for (const Observation& o : point.track) taken.insert(At(o.view, o.x_px));
  for (std::size_t q = 0; q < b.points.size(); ++q) {
    Point moved = b.points[q];
    moved.x_in_world = a_from_b * moved.x_in_world;
    moved.track.clear();
    const auto same = same_of_b.find(static_cast<std::int32_t>(q));
    Point& target = same == same_of_b.end() ? moved : merged.points[static_cast<std::size_t>(same->second)];
    for (Observation o : b.points[q].track) {
      o.view.value = of_b.view[static_cast<std::size_t>(o.view.value)];
      const bool seen = std::ranges::any_of(target.track, [&](const Observation& t) { return t.view == o.view; });
      if (!seen && taken.insert(At(o.view, o.x_px)).second) target.track.push_back(o);
    }
    if (same == same_of_b.end() && moved.track.size() >= 2) merged.points.push_back(std::move(moved));
  }
  // Views are sorted by name everywhere.
  std::vector<std::int32_t> order(merged.views.size()), place(merged.views.size());
  for (std::size_t v = 0; v < order.size(); ++v) order[v] = static_cast<std::int32_t>(v);
  std::ranges::sort(order, {}, [&](std::int32_t v) { return merged.views[static_cast<std::size_t>(v)].name; });
  std::vector<View> sorted;
  for (std::size_t v = 0; v < order.size(); ++v) {
    place[static_cast<std::size_t>(order[v])] = static_cast<std::int32_t>(v);
    sorted.push_back(std::move(merged.views[static_cast<std::size_t>(order[v])]));
  }
  merged.views = std::move(sorted);
  for (Point& point : merged.points)
    for (Observation& o : point.track) o.view.value = place[static_cast<std::size_t>(o.view.value)];
  return merged;
}

std::optional<ModelTie> TieModels(const Scene& a, const Scene& b, const std::vector<ViewMatches>& matches) {
  const BInA of_b = PlaceOf(a, b);
  const auto common = CommonPoints(a, b, of_b, matches);
  if (common.size() < kMinCommonPoints) return std::nullopt;
  // Similarities and their inverses: a place must be right in both models' photos.
  const auto error = [&](const Similarity3& a_from_b, std::size_t i) {
    const Point& p = a.points[static_cast<std::size_t>(common[i].first)];
    const Point& q = b.points[static_cast<std::size_t>(common[i].second)];
    return std::max(SquaredErrorIn(a, p, a_from_b * q.x_in_world),
                    SquaredErrorIn(b, q, a_from_b.Inverse() * p.x_in_world));
  };
  const auto fit = [&](const auto& which) {
    std::vector<Eigen::Vector3d> from, to;
    for (const std::size_t i : which) {
      from.push_back(b.points[static_cast<std::size_t>(common[i].second)].x_in_world);
      to.push_back(a.points[static_cast<std::size_t>(common[i].first)].x_in_world);
    }
    return LieOnALine(to) || LieOnALine(from) ? Similarity3{.scale = 0} : AlignPoints(from, to);
  };
  constexpr double kMaxError2 = kMaxMergeErrorPx * kMaxMergeErrorPx;
  Consensus<Similarity3, decltype(error)> best(common.size(), kMaxError2, error);
  std::mt19937_64 random(1);
  const auto offer = [&](const auto& which) {
    const Similarity3 similarity = fit(which);
    return similarity.scale > 0 && best.Offer(similarity);
  };
  DrawModels<3>({.max_trials = 2000}, common.size(), random, best, offer);
  const auto agreeing = [&] {
    std::vector<std::size_t> which;
    const std::vector<char> inlier = best.Inliers();
    for (std::size_t i = 0; i < inlier.size(); ++i)
      if (inlier[i]) which.push_back(i);
    return which;
  };
  for (int round = 0; round < kMergeRefinements && best.InlierCount() >= 3; ++round)
    if (!offer(agreeing())) break;
  const std::vector<std::size_t> same = agreeing();
  if (same.size() < kMinCommonPoints ||
      static_cast<double>(same.size()) < kMinCommonShare * static_cast<double>(common.size()) || fit(same).scale <= 0)
    return std::nullopt;
  ModelTie tie{best.best(), of_b.common, static_cast<int>(same.size()), 0, {}};
  for (std::size_t i = 0; i < common.size(); ++i) tie.agree_unmoved += error(Similarity3(), i) < kMaxError2;
  for (const std::size_t i : same) tie.same_of_b[common[i].second] = common[i].first;
  return tie;
}

std::optional<MergedModel> MergeModels(const Scene& a, const Scene& b, const MatchesOf& matches_of,
                                       const SameCamera& same_camera) {
  auto tie = TieModels(a, b, matches_of(JoinedViews(a, b, PlaceOf(a, b), same_camera)));
  if (!tie) return std::nullopt;
  Scene joined = JoinModels(a, b, *tie, same_camera);
  return MergedModel{std::move(joined), std::move(*tie)};
}

}  // namespace lumi
