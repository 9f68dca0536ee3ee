#include "reconstruct/held_cameras.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include "reconstruct/colmap_database.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/triangulation/triangulate.h"

namespace lumi {
namespace {

// One view's features with the lens taken away: pixels of the pinhole camera P.
struct HeldFeatures {
  Matrix34d P = Matrix34d::Zero();
  Eigen::Matrix3d K_inverse = Eigen::Matrix3d::Identity();
  std::vector<Eigen::Vector2d> photo_px;  // as COLMAP found them
  std::vector<Eigen::Vector2d> pinhole_px;
  std::vector<bool> valid;  // the lens has an inverse there
  std::size_t first = 0;    // number of this view's first feature among all
};

HeldFeatures Load(const HeldView& view, const ColmapDatabase& database, std::int64_t image_id) {
  HeldFeatures f;
  const Eigen::Matrix3d K = view.camera.K();
  f.K_inverse = K.inverse();
  f.P = ProjectionMatrix(K, view.cam_from_world);
  f.photo_px = database.Keypoints(image_id);
  for (const Eigen::Vector2d& x : f.photo_px) {
    const auto n = view.camera.Normalized(x);
    f.valid.push_back(n.has_value());
    f.pinhole_px.push_back(n ? Eigen::Vector2d((K * n->homogeneous()).head<2>()) : x);
  }
  return f;
}

// F with x_b^T F x_a = 0 (Hartley & Zisserman, eq. 9.12).
Eigen::Matrix3d FundamentalMatrix(const HeldView& a, const HeldFeatures& fa, const HeldView& b,
                                  const HeldFeatures& fb) {
  const Rigid3 b_from_a = b.cam_from_world * a.cam_from_world.Inverse();
  const Eigen::Vector3d t = b_from_a.translation;
  Eigen::Matrix3d cross;
  cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
  return fb.K_inverse.transpose() * cross * b_from_a.R() * fa.K_inverse;
}

// The larger of the two distances from a point to the other's epipolar line.
double EpipolarDistance(const Eigen::Matrix3d& F, const Eigen::Vector2d& x_a, const Eigen::Vector2d& x_b) {
  const Eigen::Vector3d line_b = F * x_a.homogeneous(), line_a = F.transpose() * x_b.homogeneous();
  const double product = std::abs(x_b.homogeneous().dot(line_b));
  const double shorter = std::min(line_b.head<2>().norm(), line_a.head<2>().norm());
  return shorter > 0 ? product / shorter : std::numeric_limits<double>::infinity();
}

class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), std::size_t{0}); }
  std::size_t Find(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void Join(std::size_t a, std::size_t b) {
    a = Find(a);
    b = Find(b);
    if (a != b) parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> parent_;
};

struct Feature {
  std::size_t view;
  std::size_t index;
};

// The largest set of features, at most one a view, that one point explains; found from pairs of features (at most
// kMaxPairs of them, spread over the track), then triangulated from all its members.
std::optional<Point> BestPoint(const std::vector<Feature>& track, const std::vector<HeldFeatures>& views,
                               const HeldTriangulationOptions& options, std::vector<bool>* used) {
  constexpr std::size_t kMaxPairs = 40;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < track.size(); ++i)
    for (std::size_t j = i + 1; j < track.size(); ++j)
      if (!(*used)[i] && !(*used)[j] && track[i].view != track[j].view) pairs.emplace_back(i, j);
  const std::size_t stride = std::max<std::size_t>(1, pairs.size() / kMaxPairs);

  std::vector<std::size_t> best;
  double best_error = 0;
  for (std::size_t k = 0; k < pairs.size(); k += stride) {
    const Feature& a = track[pairs[k].first];
    const Feature& b = track[pairs[k].second];
    const auto seed = Triangulate({views[a.view].P, views[b.view].P},
                                  {views[a.view].pinhole_px[a.index], views[b.view].pinhole_px[b.index]});
    if (!seed || seed->rms_px > options.max_error_px) continue;
    std::map<std::size_t, std::pair<double, std::size_t>> of_view;  // best feature of each view
    for (std::size_t i = 0; i < track.size(); ++i) {
      if ((*used)[i]) continue;
      const HeldFeatures& view = views[track[i].view];
      const auto x = Project(view.P, seed->x_in_world);
      if (!x) continue;
      const double error = (*x - view.pinhole_px[track[i].index]).norm();
      if (error > options.max_error_px) continue;
      const auto [it, fresh] = of_view.emplace(track[i].view, std::pair(error, i));
      if (!fresh && error < it->second.first) it->second = {error, i};
    }
    double error = 0;
    for (const auto& [view, member] : of_view) error += member.first;
    if (of_view.size() < 2 || of_view.size() < best.size() || (of_view.size() == best.size() && error >= best_error))
      continue;
    best.clear();
    for (const auto& [view, member] : of_view) best.push_back(member.second);
    best_error = error;
  }
  while (best.size() >= 2) {
    std::vector<Matrix34d> P;
    std::vector<Eigen::Vector2d> x;
    for (const std::size_t i : best) {
      P.push_back(views[track[i].view].P);
      x.push_back(views[track[i].view].pinhole_px[track[i].index]);
    }
    const auto solved = Triangulate(P, x);
    if (!solved) return std::nullopt;
    std::size_t worst = 0;
    double worst_error = 0;
    for (std::size_t i = 0; i < best.size(); ++i) {
      const auto y = Project(P[i], solved->x_in_world);
      const double error = y ? (*y - x[i]).norm() : std::numeric_limits<double>::infinity();
      if (error > worst_error) worst_error = error, worst = i;
    }
    if (worst_error > options.max_error_px) {
      best.erase(best.begin() + static_cast<std::ptrdiff_t>(worst));
      continue;
    }
    if (solved->max_angle_rad < options.min_angle_deg * kRadPerDeg) return std::nullopt;
    Point point;
    point.x_in_world = solved->x_in_world;
    point.error_px = solved->rms_px;
    for (const std::size_t i : best) {
      (*used)[i] = true;
      point.track.push_back(
          {ViewId{static_cast<std::int32_t>(track[i].view)}, views[track[i].view].photo_px[track[i].index]});
    }
    return point;
  }
  return std::nullopt;
}

}  // namespace

Scene TriangulateHeld(const std::vector<HeldView>& views_any_order, const std::filesystem::path& database_path,
                      const HeldTriangulationOptions& options, ProgressSink& sink) {
  std::vector<HeldView> views = views_any_order;
  std::ranges::sort(views, [](const HeldView& a, const HeldView& b) { return a.name < b.name; });

  const ColmapDatabase database(database_path);
  std::map<std::string, std::int64_t> id_of;
  for (const auto& image : database.Images()) id_of[image.name] = image.id;
  std::map<std::int64_t, std::size_t> view_of;
  std::vector<HeldFeatures> features(views.size());
  std::size_t total = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (const auto it = id_of.find(views[v].name); it != id_of.end()) {
      features[v] = Load(views[v], database, it->second);
      view_of[it->second] = v;
    }
    features[v].first = total;
    total += features[v].photo_px.size();
  }

  // Matches that the cameras allow, joined to tracks.
  UnionFind tracks(total);
  {
    const auto pairs = database.MatchedPairs();
    Progress progress(sink, "checking matches", static_cast<long>(pairs.size()));
    for (const auto& pair : pairs) {
      progress.Step();
      const auto a = view_of.find(pair.image1), b = view_of.find(pair.image2);
      if (a == view_of.end() || b == view_of.end() || pair.matches == 0) continue;
      const HeldFeatures &fa = features[a->second], &fb = features[b->second];
      const Eigen::Matrix3d F = FundamentalMatrix(views[a->second], fa, views[b->second], fb);
      for (const auto& [i, j] : database.Matches(pair.image1, pair.image2)) {
        const auto ia = static_cast<std::size_t>(i), jb = static_cast<std::size_t>(j);
        if (ia >= fa.photo_px.size() || jb >= fb.photo_px.size())
          throw InputError(database_path, "a match names a feature that is not there");
        if (!fa.valid[ia] || !fb.valid[jb]) continue;
        if (EpipolarDistance(F, fa.pinhole_px[ia], fb.pinhole_px[jb]) <= options.max_error_px)
          tracks.Join(fa.first + ia, fb.first + jb);
      }
    }
  }
  std::map<std::size_t, std::vector<Feature>> members;
  for (std::size_t v = 0; v < views.size(); ++v)
    for (std::size_t i = 0; i < features[v].photo_px.size(); ++i)
      members[tracks.Find(features[v].first + i)].push_back({v, i});
  std::vector<std::vector<Feature>> list;
  for (auto& [root, track] : members)
    if (track.size() >= 2) list.push_back(std::move(track));
  members.clear();

  // A track that joined two things by a wrong match gives two points.
  constexpr int kMaxPointsOfTrack = 3;
  std::vector<std::vector<Point>> found(list.size());
  Progress progress(sink, "triangulating", static_cast<long>(list.size()));
  ParallelFor(list.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      std::vector<bool> used(list[k].size(), false);
      for (int n = 0; n < kMaxPointsOfTrack; ++n) {
        auto point = BestPoint(list[k], features, options, &used);
        if (!point) break;
        found[k].push_back(std::move(*point));
      }
    }
    progress.Step(static_cast<long>(end - begin));
  });

  Scene scene;
  std::map<std::pair<int, std::vector<double>>, std::int32_t> camera_ids;  // equal cameras are one
  for (const HeldView& held : views) {
    std::vector<double> key = held.camera.params;
    key.push_back(held.camera.width_px);
    key.push_back(held.camera.height_px);
    const auto [it, fresh] = camera_ids.emplace(std::pair(static_cast<int>(held.camera.model), key),
                                                static_cast<std::int32_t>(scene.cameras.size()));
    if (fresh) scene.cameras.push_back(held.camera);
    View view;
    view.name = held.name;
    view.camera = CameraId{it->second};
    view.cam_from_world = held.cam_from_world;
    scene.views.push_back(std::move(view));
  }
  for (auto& points : found)
    for (Point& point : points) scene.points.push_back(std::move(point));
  return scene;
}

}  // namespace lumi
