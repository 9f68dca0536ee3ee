#include "reconstruct/standing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "reconstruct/place_camera.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"
#include "scene/triangulation/triangulate.h"

namespace lumi {
namespace {

// Others must see a point under so large an angle that its depth says something (COLMAP's bound on a point).
constexpr double kMinAngleDeg = 1.5;
// A right pose agrees with most of what verified matches offer it; below this share it is tried anew.
constexpr double kRightShare = 0.5;
// A pose found anew must explain so many times more.
constexpr double kClearlyMore = 1.3;
// Held by so many times fewer points than the median camera (and by fewer than a pose needs): nothing to stand on.
constexpr double kFewOfMany = 10;
// Named where its place is so many times less certain than the median camera's.
constexpr double kUncertain = 10;
// Two cameras with swapped poses are both found in the first round; points that they had bent, in later ones.
constexpr int kStandingRounds = 4;
constexpr int kSpreadCells = 8;

using PointAt = std::map<std::pair<double, double>, std::int32_t>;  // pixel of a photo -> point

// The pixels that the lens would show without its distortion, of all observations; as the points' tracks stand.
struct StraightTracks {
  std::vector<Matrix34d> P;
  std::vector<std::vector<std::optional<Eigen::Vector2d>>> x_px;
};

std::optional<Eigen::Vector2d> StraightPx(const Camera& camera, const Eigen::Vector2d& x_px) {
  const auto n = camera.Normalized(x_px);
  if (!n) return std::nullopt;
  return Eigen::Vector2d((camera.K() * n->homogeneous()).head<2>());
}

StraightTracks Straighten(const Scene& scene) {
  StraightTracks straight;
  for (const View& view : scene.views)
    straight.P.push_back(ProjectionMatrix(scene.CameraOf(view).K(), view.cam_from_world));
  straight.x_px.resize(scene.points.size());
  ParallelEach(scene.points.size(), 256, [&](std::size_t p) {
    for (const Observation& o : scene.points[p].track)
      straight.x_px[p].push_back(
          StraightPx(scene.CameraOf(scene.views[static_cast<std::size_t>(o.view.value)]), o.x_px));
  });
  return straight;
}

// More rays than these add little to a point's place.
constexpr std::size_t kMostRays = 6;

struct Rays {
  std::vector<Matrix34d> P;
  std::vector<Eigen::Vector2d> x_px;
};

// The point on which most rays agree, where that is half of them or more: photos that hold a point may stand wrong
// themselves. nullopt: none.
std::optional<TriangulatedPoint> AgreedPoint(const Rays& rays) {
  std::vector<std::size_t> most;
  for (std::size_t i = 0; i < rays.P.size(); ++i)
    for (std::size_t j = i + 1; j < rays.P.size(); ++j) {
      const auto pair = Triangulate({rays.P[i], rays.P[j]}, {rays.x_px[i], rays.x_px[j]});
      if (!pair || pair->rms_px > kMaxPoseErrorPx) continue;
      std::vector<std::size_t> agreeing;
      for (std::size_t k = 0; k < rays.P.size(); ++k)
        if (const auto x = Project(rays.P[k], pair->x_in_world); x && (*x - rays.x_px[k]).norm() <= kMaxPoseErrorPx)
          agreeing.push_back(k);
      if (agreeing.size() > most.size()) most = std::move(agreeing);
    }
  if (most.size() < 2 || 2 * most.size() < rays.P.size()) return std::nullopt;
  Rays some;
  for (const std::size_t k : most) some.P.push_back(rays.P[k]), some.x_px.push_back(rays.x_px[k]);
  auto point = Triangulate(some.P, some.x_px);
  return point && point->rms_px <= kMaxPoseErrorPx ? point : std::nullopt;
}

// A point from the photos that hold it but one (-1: from all), where they agree on it.
std::optional<TriangulatedPoint> PointWithout(const Scene& scene, const StraightTracks& straight, std::size_t point,
                                              int without) {
  const auto& track = scene.points[point].track;
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < track.size(); ++i)
    if (track[i].view.value != without && straight.x_px[point][i]) usable.push_back(i);
  if (usable.size() < 2) return std::nullopt;
  Rays rays;
  const std::size_t count = std::min(usable.size(), kMostRays);
  for (std::size_t k = 0; k < count; ++k) {  // the first and the last among them: they are far apart in most captures
    const std::size_t i = usable[k * (usable.size() - 1) / (count - 1)];
    rays.P.push_back(straight.P[static_cast<std::size_t>(track[i].view.value)]);
    rays.x_px.push_back(*straight.x_px[point][i]);
  }
  auto all = Triangulate(rays.P, rays.x_px);
  if (all && all->rms_px <= kMaxPoseErrorPx) return all;
  return rays.P.size() > 2 ? AgreedPoint(rays) : std::nullopt;
}

bool PoseAgrees(const Camera& camera, const Rigid3& pose, const Eigen::Vector3d& x_in_world,
                const Eigen::Vector2d& x_px) {
  const Eigen::Vector3d x_in_cam = pose * x_in_world;
  const auto x = camera.Project(x_in_cam);
  return x && x_in_cam.z() > 0 && (*x - x_px).norm() <= kMaxPoseErrorPx;
}

class Witness {
 public:
  Witness(const Scene& scene, const std::vector<ViewMatches>& matches)
      : scene_(scene), straight_(Straighten(scene)), point_at_(scene.views.size()), matches_of_(scene.views.size()) {
    for (std::size_t p = 0; p < scene.points.size(); ++p)
      for (const Observation& o : scene.points[p].track)
        point_at_[static_cast<std::size_t>(o.view.value)][{o.x_px.x(), o.x_px.y()}] = static_cast<std::int32_t>(p);
    for (const ViewMatches& m : matches) {
      matches_of_[static_cast<std::size_t>(m.a.value)].push_back(&m);
      matches_of_[static_cast<std::size_t>(m.b.value)].push_back(&m);
    }
  }

  CameraEvidence Of(std::size_t view) const {
    const View& v = scene_.views[view];
    const Camera& camera = scene_.CameraOf(v);
    CameraEvidence evidence;
    for (const auto& [point, x] : Votes(view)) {
      const auto held = PointWithout(scene_, straight_, static_cast<std::size_t>(point), static_cast<int>(view));
      if (!held || held->max_angle_rad < kMinAngleDeg * kRadPerDeg) continue;
      evidence.seen.emplace_back(static_cast<std::int32_t>(evidence.points.size()), x);
      evidence.points.emplace_back().x_in_world = held->x_in_world;
      evidence.index.push_back(point);
      evidence.angle_rad.push_back(held->max_angle_rad);
      evidence.agrees.push_back(PoseAgrees(camera, v.cam_from_world, held->x_in_world, x));
      evidence.agreeing += evidence.agrees.back();
    }
    return evidence;
  }

 private:
  // The pairs of a pixel of the photo and a point that its matches suggest: those that most photos suggest first, each
  // pixel and each point once. A wrong match is seldom confirmed by a second photo.
  std::vector<Sighting> Votes(std::size_t view) const {
    using Vote = std::tuple<std::int32_t, double, double>;  // point, pixel
    std::map<Vote, int> votes;
    const auto vote = [&](const Eigen::Vector2d& x, ViewId other, const Eigen::Vector2d& x_other) {
      const PointAt& points = point_at_[static_cast<std::size_t>(other.value)];
      if (const auto at = points.find({x_other.x(), x_other.y()}); at != points.end())
        ++votes[{at->second, x.x(), x.y()}];
    };
    for (const ViewMatches* m : matches_of_[view])
      for (const auto& [x_a, x_b] : m->px) {
        if (static_cast<std::size_t>(m->a.value) == view)
          vote(x_a, m->b, x_b);
        else
          vote(x_b, m->a, x_a);
      }
    std::vector<std::pair<int, Vote>> order;
    for (const auto& [what, count] : votes) order.emplace_back(-count, what);
    std::ranges::sort(order);
    std::set<std::int32_t> points;
    std::set<std::pair<double, double>> pixels;
    std::vector<Sighting> chosen;
    for (const auto& [count, what] : order) {
      const auto& [point, x, y] = what;
      if (points.contains(point) || pixels.contains({x, y})) continue;
      points.insert(point);
      pixels.emplace(x, y);
      chosen.emplace_back(point, Eigen::Vector2d(x, y));
    }
    return chosen;
  }

  const Scene& scene_;
  const StraightTracks straight_;
  std::vector<PointAt> point_at_;
  std::vector<std::vector<const ViewMatches*>> matches_of_;
};

// The size of the space that the cameras stand in; robust against one that stands far off.
double Extent(const Scene& scene) {
  Eigen::Vector3d middle;
  for (int c = 0; c < 3; ++c) {
    std::vector<double> values;
    for (const View& view : scene.views) values.push_back(view.CentreInWorld()[c]);
    middle[c] = Median(std::move(values));
  }
  std::vector<double> distances;
  for (const View& view : scene.views) distances.push_back((view.CentreInWorld() - middle).norm());
  return 2 * Quantile(std::move(distances), 0.9);
}

// Standard deviation of the camera's centre (root of the covariance's trace, in world units), the points held: from the
// normal equations of a turn about the centre and a shift of it.
double CentreSigma(const Camera& camera, const Rigid3& pose, const CameraEvidence& evidence) {
  constexpr int kUnknowns = 6;
  Eigen::Matrix<double, kUnknowns, kUnknowns> A = Eigen::Matrix<double, kUnknowns, kUnknowns>::Zero();
  double squares = 0;
  int n = 0;
  const Eigen::Matrix3d K = camera.K();
  for (std::size_t i = 0; i < evidence.seen.size(); ++i) {
    if (!evidence.agrees[i]) continue;
    const Eigen::Vector3d X = pose * evidence.points[static_cast<std::size_t>(evidence.seen[i].first)].x_in_world;
    const auto x = camera.Project(X);
    if (!x) continue;
    Eigen::Matrix<double, 2, 3> by_point;
    by_point << K(0, 0) / X.z(), 0, -K(0, 0) * X.x() / (X.z() * X.z()), 0, K(1, 1) / X.z(),
        -K(1, 1) * X.y() / (X.z() * X.z());
    Eigen::Matrix3d cross;
    cross << 0, -X.z(), X.y(), X.z(), 0, -X.x(), -X.y(), X.x(), 0;
    Eigen::Matrix<double, 2, kUnknowns> J;
    J << by_point * -cross, -by_point;
    A.noalias() += J.transpose() * J;
    squares += (*x - evidence.seen[i].second).squaredNorm();
    ++n;
  }
  if (2 * n <= kUnknowns) return std::numeric_limits<double>::infinity();
  const auto inverse = InverseOf(A);
  if (!inverse) return std::numeric_limits<double>::infinity();
  return std::sqrt(inverse->bottomRightCorner<3, 3>().trace() * squares / (2 * n - kUnknowns));
}

CameraStanding StandingOf(const Scene& scene, const View& view, const CameraEvidence& evidence, double extent) {
  CameraStanding standing;
  standing.name = view.name;
  standing.offered = static_cast<int>(evidence.seen.size());
  standing.points = evidence.agreeing;
  const Camera& camera = scene.CameraOf(view);
  std::set<std::pair<int, int>> cells;
  std::vector<double> angles;
  for (std::size_t i = 0; i < evidence.seen.size(); ++i) {
    if (!evidence.agrees[i]) continue;
    const auto& [point, x] = evidence.seen[i];
    cells.emplace(static_cast<int>(x.x() * kSpreadCells / camera.width_px),
                  static_cast<int>(x.y() * kSpreadCells / camera.height_px));
    angles.push_back(evidence.angle_rad[static_cast<std::size_t>(point)]);
  }
  standing.spread = static_cast<double>(cells.size()) / (kSpreadCells * kSpreadCells);
  standing.angle_deg = Median(std::move(angles)) * kDegPerRad;
  const double sigma = CentreSigma(camera, view.cam_from_world, evidence);
  if (std::isfinite(sigma) && extent > 0) standing.sigma_percent = 100 * sigma / extent;
  return standing;
}

double TypicalAgreeing(const std::vector<CameraEvidence>& evidence) {
  std::vector<int> agreeing;
  for (const CameraEvidence& e : evidence) agreeing.push_back(e.agreeing);
  return Median(std::move(agreeing));
}

// Worst first.
std::vector<CameraStanding> StandingsOf(const Scene& scene, const std::vector<CameraEvidence>& evidence) {
  const double extent = Extent(scene), typical = TypicalAgreeing(evidence);
  std::vector<CameraStanding> standings(scene.views.size());
  ParallelEach(scene.views.size(), 1,
               [&](std::size_t v) { standings[v] = StandingOf(scene, scene.views[v], evidence[v], extent); });
  std::vector<double> sigmas;
  for (const CameraStanding& s : standings)
    if (s.sigma_percent) sigmas.push_back(*s.sigma_percent);
  const double usual = Median(std::move(sigmas));
  for (CameraStanding& s : standings) {
    if (s.offered >= kMinPointsOfPose && s.points < kRightShare * s.offered)
      s.remark =
          fmt::format("{} of the {} points that others hold are elsewhere in it", s.offered - s.points, s.offered);
    else if (s.points < kMinPointsOfPose && typical >= kFewOfMany * std::max(1, s.points))
      s.remark = fmt::format("only {} points that others hold agree with it", s.points);
    else if (s.sigma_percent && usual > 0 && *s.sigma_percent > kUncertain * usual)
      s.remark =
          fmt::format("its place is known to {:.2g} % only, the median camera's to {:.2g} %", *s.sigma_percent, usual);
  }
  const auto worth = [](const CameraStanding& s) {
    return std::tuple(s.remark.empty(), -s.sigma_percent.value_or(std::numeric_limits<double>::max()));
  };
  std::ranges::stable_sort(standings, {}, worth);
  return standings;
}

void ForgetObservations(Scene& scene, const std::set<std::int32_t>& views) {
  for (Point& point : scene.points)
    std::erase_if(point.track, [&](const Observation& o) { return views.contains(o.view.value); });
}

// Returns each view's number from now on, -1 for those that are gone.
std::vector<std::int32_t> RemoveViews(Scene& scene, const std::set<std::int32_t>& out) {
  std::vector<std::int32_t> index(scene.views.size(), -1);
  std::vector<View> stay;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (out.contains(static_cast<std::int32_t>(v))) continue;
    index[v] = static_cast<std::int32_t>(stay.size());
    stay.push_back(std::move(scene.views[v]));
  }
  scene.views = std::move(stay);
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.view.value = index[static_cast<std::size_t>(o.view.value)];
  return index;
}

std::vector<ViewMatches> Renumbered(std::vector<ViewMatches> matches, const std::vector<std::int32_t>& number) {
  for (ViewMatches& m : matches)
    for (ViewId* view : {&m.a, &m.b}) view->value = number[static_cast<std::size_t>(view->value)];
  return matches;
}

// What a round finds of one camera.
struct Verdict {
  std::optional<PlacedCamera> anew;
  bool unheld = false;
};

// Which cameras have few observations at all beside the median one, of points held by two photos too: a photo that
// shares many points with each neighbour and few with both of them is held, if less surely than most.
std::vector<char> HaveFewObservations(const Scene& scene) {
  std::vector<int> observations(scene.views.size(), 0);
  for (const Point& point : scene.points)
    for (const Observation& o : point.track) ++observations[static_cast<std::size_t>(o.view.value)];
  const double typical = Median(std::vector<int>(observations));
  std::vector<char> few;
  for (const int n : observations) few.push_back(kFewOfMany * n <= typical);
  return few;
}

Verdict Judge(const Camera& camera, const CameraEvidence& evidence, bool few_observations, double typical) {
  Verdict verdict;
  const auto offered = static_cast<double>(evidence.seen.size());
  if (evidence.agreeing >= kMinPointsOfPose && evidence.agreeing >= kRightShare * offered) return verdict;
  PlacedCamera placed = PlaceCamera(evidence.seen, evidence.points, camera);
  if (placed.ok && placed.inliers > kClearlyMore * evidence.agreeing)
    verdict.anew = std::move(placed);
  else
    verdict.unheld = few_observations && evidence.agreeing < kMinPointsOfPose &&
                     typical >= kFewOfMany * std::max(1, evidence.agreeing);
  return verdict;
}

// Cameras placed anew: their old observations go, those that the new pose agrees with come, points follow.
void Replace(Scene& scene, const std::vector<CameraEvidence>& evidence,
             const std::map<std::size_t, PlacedCamera>& anew) {
  std::set<std::int32_t> views;
  for (const auto& [v, placed] : anew) views.insert(static_cast<std::int32_t>(v));
  ForgetObservations(scene, views);
  for (const auto& [v, placed] : anew) {
    scene.views[v].cam_from_world = placed.cam_from_world;
    std::set<std::int32_t> once;
    for (const auto& [point, x] : placed.observations) {
      const std::int32_t index = evidence[v].index[static_cast<std::size_t>(point)];
      if (once.insert(index).second)
        scene.points[static_cast<std::size_t>(index)].track.push_back({ViewId{static_cast<std::int32_t>(v)}, x});
    }
  }
}

}  // namespace

void TriangulateAnew(Scene& scene) {
  const StraightTracks straight = Straighten(scene);
  std::vector<char> stays(scene.points.size(), 0);
  ParallelEach(scene.points.size(), 64, [&](std::size_t p) {
    const auto held = PointWithout(scene, straight, p, -1);
    if (!held) return;
    scene.points[p].x_in_world = held->x_in_world;
    stays[p] = 1;
  });
  std::size_t p = 0;
  std::erase_if(scene.points, [&](const Point&) { return !stays[p++]; });
}

std::vector<ViewMatches> VerifiedMatchesOf(const Scene& scene, const ColmapDatabase& database) {
  std::map<std::string, std::int32_t> view_named;
  for (std::size_t v = 0; v < scene.views.size(); ++v) view_named[scene.views[v].name] = static_cast<std::int32_t>(v);
  std::map<std::int64_t, std::int32_t> view_of;
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> keypoints;
  for (const DatabaseImage& image : database.Images())
    if (const auto it = view_named.find(image.name); it != view_named.end()) {
      view_of[image.id] = it->second;
      keypoints[image.id] = database.Keypoints(image.id);
    }
  std::vector<ViewMatches> all;
  for (const DatabasePair& pair : database.VerifiedPairs()) {
    const auto a = view_of.find(pair.image1), b = view_of.find(pair.image2);
    if (a == view_of.end() || b == view_of.end()) continue;
    ViewMatches m{ViewId{a->second}, ViewId{b->second}, {}};
    const auto &of_a = keypoints[pair.image1], &of_b = keypoints[pair.image2];
    for (const auto& [i, j] : database.VerifiedMatches(pair.image1, pair.image2))
      if (static_cast<std::size_t>(i) < of_a.size() && static_cast<std::size_t>(j) < of_b.size())
        m.px.emplace_back(of_a[static_cast<std::size_t>(i)], of_b[static_cast<std::size_t>(j)]);
    all.push_back(std::move(m));
  }
  return all;
}

std::vector<CameraEvidence> EvidenceOf(const Scene& scene, const std::vector<ViewMatches>& matches) {
  const Witness witness(scene, matches);
  std::vector<CameraEvidence> evidence(scene.views.size());
  ParallelEach(scene.views.size(), 1, [&](std::size_t v) { evidence[v] = witness.Of(v); });
  return evidence;
}

std::vector<CameraStanding> MeasureStandings(const Scene& scene, const std::vector<ViewMatches>& matches) {
  return StandingsOf(scene, EvidenceOf(scene, matches));
}

VerifiedCameras VerifyCameras(Scene scene, const std::vector<ViewMatches>& given_matches) {
  VerifiedCameras verified;
  std::vector<ViewMatches> matches = given_matches;
  std::set<std::string> anew_named;
  for (int round = 0; round < kStandingRounds; ++round) {
    const std::vector<CameraEvidence> evidence = EvidenceOf(scene, matches);
    const double typical = TypicalAgreeing(evidence);
    const std::vector<char> few = HaveFewObservations(scene);
    std::vector<Verdict> verdicts(scene.views.size());
    ParallelEach(scene.views.size(), 1, [&](std::size_t v) {
      verdicts[v] = Judge(scene.CameraOf(scene.views[v]), evidence[v], few[v], typical);
    });
    std::map<std::size_t, PlacedCamera> anew;
    std::set<std::int32_t> unheld;
    for (std::size_t v = 0; v < verdicts.size(); ++v) {
      if (verdicts[v].anew) anew[v] = *verdicts[v].anew;
      if (verdicts[v].unheld) unheld.insert(static_cast<std::int32_t>(v));
    }
    // A camera that a wrong neighbour kept from being held is judged again once that neighbour has moved.
    if (!anew.empty()) {
      for (const auto& [v, placed] : anew) anew_named.insert(scene.views[v].name);
      Replace(scene, evidence, anew);
    } else if (!unheld.empty() && unheld.size() + 2 <= scene.views.size()) {
      for (const std::int32_t v : unheld)
        verified.left_out.push_back(
            {scene.views[static_cast<std::size_t>(v)].name,
             fmt::format("its place hangs on {} points that other photos hold; the median photo's on {:.0f}",
                         evidence[static_cast<std::size_t>(v)].agreeing, typical),
             "shoot photos between it and its neighbours: each should show two thirds of the last"});
      ForgetObservations(scene, unheld);
      std::erase_if(matches,
                    [&](const ViewMatches& m) { return unheld.contains(m.a.value) || unheld.contains(m.b.value); });
      matches = Renumbered(std::move(matches), RemoveViews(scene, unheld));
    } else {
      break;
    }
    verified.changed = true;
    TriangulateAnew(scene);
  }
  verified.standings = StandingsOf(scene, EvidenceOf(scene, matches));
  for (CameraStanding& s : verified.standings) s.placed_anew = anew_named.contains(s.name);
  verified.scene = std::move(scene);
  return verified;
}

}  // namespace lumi
