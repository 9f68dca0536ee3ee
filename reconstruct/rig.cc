#include "reconstruct/rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "reconstruct/colmap_database.h"
#include "reconstruct/nelder_mead.h"
#include "scene/files/atomic_file.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr double kTurnRad = 360 * kRadPerDeg;

// One match between two photos of the rig.
struct Match {
  int a = 0, b = 0;  // photos
  Eigen::Vector2d x_a_px, x_b_px;
};

// Matches between photos that are near in the rig (at most `reach` apart by `distance`), thinned evenly to `per_pair`.
// On a turntable the room stands still: matches that do not move are the room's, not the object's.
template <typename Distance>
std::vector<Match> NearMatches(const Capture& capture, const std::filesystem::path& path, int reach, std::size_t per_pair, double min_motion_px, Distance&& distance) {
  const ColmapDatabase database(path);
  std::map<std::string, int> index_of;
  for (std::size_t i = 0; i < capture.photos.size(); ++i) index_of[capture.photos[i].name] = static_cast<int>(i);
  std::map<std::int64_t, int> photo_of;
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> keypoints;
  for (const auto& image : database.Images()) {
    const auto it = index_of.find(image.name);
    if (it == index_of.end()) continue;
    photo_of[image.id] = it->second;
    keypoints[image.id] = database.Keypoints(image.id);
  }
  std::vector<Match> matches;
  for (const auto& pair : database.MatchedPairs()) {
    const auto a = photo_of.find(pair.image1), b = photo_of.find(pair.image2);
    if (a == photo_of.end() || b == photo_of.end() || pair.matches == 0 || distance(a->second, b->second) > reach) continue;
    std::vector<Match> of_pair;
    for (const auto& [i, j] : database.Matches(pair.image1, pair.image2)) {
      const auto &ka = keypoints[pair.image1], &kb = keypoints[pair.image2];
      if (static_cast<std::size_t>(i) >= ka.size() || static_cast<std::size_t>(j) >= kb.size()) throw InputError(path, "a match names a feature that is not there");
      const Match match{a->second, b->second, ka[static_cast<std::size_t>(i)], kb[static_cast<std::size_t>(j)]};
      if ((match.x_a_px - match.x_b_px).norm() >= min_motion_px) of_pair.push_back(match);
    }
    const std::size_t stride = std::max<std::size_t>(1, of_pair.size() / per_pair);
    for (std::size_t k = 0; k < of_pair.size(); k += stride) matches.push_back(of_pair[k]);
  }
  return matches;
}

// How well a match agrees with two poses: 1 exactly, 1/2 at `scale_px` from the epipolar line, 0 behind a camera.
double Agreement(const Match& match, const Rigid3& b_from_a, const Eigen::Vector2d& middle_px, double focal_px, double scale_px) {
  const Eigen::Vector3d a = ((match.x_a_px - middle_px) / focal_px).homogeneous(), b = ((match.x_b_px - middle_px) / focal_px).homogeneous();
  const Eigen::Vector3d turned = b_from_a.rotation * a, &t = b_from_a.translation;
  const Eigen::Vector3d line_b = t.cross(turned);
  const Eigen::Vector3d line_a = b_from_a.rotation.conjugate() * b.cross(t);
  const double shorter = std::min(line_b.head<2>().norm(), line_a.head<2>().norm());
  if (!(shorter > 0)) return 0;
  const double distance_px = std::abs(b.dot(line_b)) / shorter * focal_px;
  // Depth of the point in both cameras: z_b b = z_a R a + t.
  const Eigen::Vector3d cross = b.cross(turned);
  const double square = cross.squaredNorm();
  if (!(square > 0)) return 0;
  const double z_a = -b.cross(t).dot(cross) / square;
  const double z_b = (z_a * turned + t).z();
  if (!(z_a > 0) || !(z_b > 0)) return 0;
  return 1 / (1 + (distance_px / scale_px) * (distance_px / scale_px));
}

double RingScore(const RingGeometry& ring, const std::vector<Match>& matches, const Eigen::Vector2d& middle_px, double scale_px) {
  double sum = 0;
  std::map<int, Rigid3> b_from_a;  // by the distance in the ring: poses of neighbours differ by that alone
  for (const Match& match : matches) {
    auto it = b_from_a.find(match.b - match.a);
    if (it == b_from_a.end()) it = b_from_a.emplace(match.b - match.a, RingPose(ring, match.b - match.a) * RingPose(ring, 0).Inverse()).first;
    sum += Agreement(match, it->second, middle_px, ring.focal_px, scale_px);
  }
  return sum / static_cast<double>(matches.size());
}

std::vector<HeldView> Ring(const Capture& capture, const ReconstructOptions& options, const std::filesystem::path& database, ProgressSink& sink) {
  const int n = static_cast<int>(capture.photos.size());
  const Photo& first = capture.photos.front();
  for (const Photo& photo : capture.photos)
    if (photo.width_px != first.width_px || photo.height_px != first.height_px)
      throw DataError("the photos of a turntable have one size; these have several", "scale them to one size, or leave out --rig");
  // Neighbours up to three steps away overlap; the room's points move by less than this.
  constexpr int kReach = 3;
  constexpr std::size_t kPerPair = 40, kMinMatches = 100;
  constexpr double kRoomPx = 2;
  const auto matches = NearMatches(capture, database, kReach, kPerPair, kRoomPx, [n](int a, int b) {
    const int d = std::abs(a - b);
    return std::min(d, n - d);
  });
  if (matches.size() < kMinMatches)
    throw DataError(fmt::format("only {} matches between neighbours on the ring", matches.size()), "photos of a ring need texture and steps of 15 degrees or less");

  const std::optional<Camera> given = IntrinsicsFromOptions(options, first.width_px, first.height_px);
  const Eigen::Vector2d middle = given ? given->PrincipalPointPx() : Eigen::Vector2d(first.width_px / 2.0, first.height_px / 2.0);
  // Coarse to fine: a wide tolerance over a grid of focal lengths, elevations and both senses of rotation, then a narrow
  // one from the best of them. Agreement saturates, so wrong matches do not pull.
  constexpr double kWidePx = 10, kNarrowPx = 1.5, kMinAgreement = 0.4;
  constexpr int kStarts = 6;
  std::vector<RingGeometry> grid;
  for (double factor = 0.6; factor < 9; factor *= 1.25) {
    if (given && factor != 0.6) break;
    for (int elevation_deg = -40; elevation_deg <= 80; elevation_deg += 8)
      for (const int sense : {1, -1}) {
        RingGeometry ring;
        ring.focal_px = given ? given->FocalPx().x() : factor * first.width_px;
        ring.elevation_rad = elevation_deg * kRadPerDeg;
        ring.step_rad = sense * kTurnRad / n;
        grid.push_back(ring);
      }
  }
  std::vector<std::pair<double, std::size_t>> scores(grid.size());
  Progress progress(sink, "searching the ring", static_cast<long>(grid.size()) + kStarts);
  ParallelFor(grid.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      scores[i] = {-RingScore(grid[i], matches, middle, kWidePx), i};
      progress.Step();
    }
  });
  std::sort(scores.begin(), scores.end());
  const auto starts = std::min<std::size_t>(kStarts, scores.size());
  std::vector<std::pair<double, RingGeometry>> refined(starts);
  ParallelFor(starts, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      const RingGeometry& from = grid[scores[s].second];
      const auto ring_at = [&](const std::vector<double>& x) {
        RingGeometry ring = from;
        ring.focal_px = std::exp(x[0]);
        ring.elevation_rad = x[1];
        ring.pan_rad = x[2];
        ring.roll_rad = x[3];
        return ring;
      };
      std::vector<double> x{std::log(from.focal_px), from.elevation_rad, 0, 0};
      for (const double scale_px : {kWidePx, 4.0, kNarrowPx}) {
        const double angle = 3 * kRadPerDeg * scale_px / kWidePx;
        x = NelderMead([&](const std::vector<double>& y) { return -RingScore(ring_at(y), matches, middle, scale_px); }, x, {given ? 0.0 : 0.1, 2 * angle, angle, angle}, 300);
      }
      refined[s] = {RingScore(ring_at(x), matches, middle, kNarrowPx), ring_at(x)};
      progress.Step();
    }
  });
  const auto best = *std::max_element(refined.begin(), refined.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  if (best.first < kMinAgreement)
    throw DataError(fmt::format("no ring of {} evenly spaced cameras explains the matches (agreement {:.2f}, {:.2f} is asked for)", n, best.first, kMinAgreement),
                    "the photos must be one full turn in the order of their names; else leave out --rig");
  sink.Message(fmt::format("ring: focal length {:.1f} px, cameras {:.1f} degrees above the object, {}, {:.0f} % agreement", best.second.focal_px,
                           best.second.elevation_rad * kDegPerRad, best.second.step_rad > 0 ? "counter-clockwise" : "clockwise", 100 * best.first));
  std::vector<HeldView> views;
  for (int i = 0; i < n; ++i) {
    HeldView view;
    view.name = capture.photos[static_cast<std::size_t>(i)].name;
    view.camera = given ? *given : Camera::Pinhole(first.width_px, first.height_px, best.second.focal_px, best.second.focal_px, middle.x(), middle.y());
    view.cam_from_world = RingPose(best.second, i);
    views.push_back(std::move(view));
  }
  return views;
}

struct GridPosition {
  double horizontal = 0, vertical = 0;
};

std::map<std::string, GridPosition> ReadPositions(const std::filesystem::path& path) {
  std::istringstream text(ReadText(path));
  std::map<std::string, GridPosition> positions;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    std::vector<std::string> fields;
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) fields.push_back(cell);
    if (fields.size() < 5) throw InputError(path, fmt::format("line {}: five columns are expected (file,row,column,vertical,horizontal)", number));
    try {
      std::size_t used_v = 0, used_h = 0;
      GridPosition p;
      p.vertical = std::stod(fields[3], &used_v);
      p.horizontal = std::stod(fields[4], &used_h);
      if (used_v != fields[3].size() || used_h != fields[4].size() || !std::isfinite(p.vertical) || !std::isfinite(p.horizontal)) throw std::invalid_argument(line);
      positions[fields[0]] = p;
    } catch (const std::logic_error&) {
      if (number > 1) throw InputError(path, fmt::format("line {}: the position is no number", number));  // line 1: the header
    }
  }
  return positions;
}

std::vector<HeldView> Grid(const Capture& capture, const ReconstructOptions& options, const std::filesystem::path& database, ProgressSink& sink) {
  const int n = static_cast<int>(capture.photos.size());
  std::vector<GridPosition> positions(capture.photos.size());
  if (!options.grid_size.empty()) {
    const auto [rows, columns] = ParseGridSize(options.grid_size);
    if (rows * columns != n) throw DataError(fmt::format("--grid-size {} means {} photos, {} are here", options.grid_size, rows * columns, n), "photos are taken row by row in the order of their names");
    for (int i = 0; i < n; ++i) positions[static_cast<std::size_t>(i)] = {static_cast<double>(i % columns), static_cast<double>(i / columns)};
  } else {
    const auto known = ReadPositions(options.grid_positions);
    for (int i = 0; i < n; ++i) {
      const auto it = known.find(capture.photos[static_cast<std::size_t>(i)].name);
      if (it == known.end()) throw DataError(fmt::format("no position for {}", capture.photos[static_cast<std::size_t>(i)].name), "its name must stand in the first column", options.grid_positions);
      positions[static_cast<std::size_t>(i)] = it->second;
    }
  }
  std::vector<HeldView> views(capture.photos.size());
  const auto build = [&](double sign_h, double sign_v) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      const Photo& photo = capture.photos[i];
      views[i].name = photo.name;
      views[i].camera = *IntrinsicsFromOptions(options, photo.width_px, photo.height_px);
      const double h = sign_h * positions[i].horizontal, v = sign_v * positions[i].vertical;
      views[i].cam_from_world = GridPose(h, v);
      if (options.grid_plane > 0) {
        // Rectified photos coincide on a plane: each one's principal point is shifted by the plane's own parallax.
        const Eigen::Vector2d f = views[i].camera.FocalPx();
        Camera& camera = views[i].camera;
        const Eigen::Vector2d c = camera.PrincipalPointPx();
        camera = Camera::Pinhole(camera.width_px, camera.height_px, f.x(), f.y(), c.x() + f.x() * h / options.grid_plane, c.y() + f.y() * v / options.grid_plane);
      }
    }
  };
  // Which way the coordinates run is not told: the way that puts the matched points in front of the cameras.
  constexpr std::size_t kPerPair = 40;
  constexpr int kReach = 2;
  const auto matches = NearMatches(capture, database, kReach, kPerPair, 0.0, [](int a, int b) { return std::abs(a - b); });
  double best = -1;
  std::pair<double, double> best_signs{1, 1};
  for (const double sign_h : {1.0, -1.0})
    for (const double sign_v : {1.0, -1.0}) {
      build(sign_h, sign_v);
      double score = 0;
      for (const Match& match : matches) {
        const HeldView &a = views[static_cast<std::size_t>(match.a)], &b = views[static_cast<std::size_t>(match.b)];
        // Both photos moved to one principal point.
        Match centred = match;
        centred.x_a_px -= a.camera.PrincipalPointPx();
        centred.x_b_px -= b.camera.PrincipalPointPx();
        score += Agreement(centred, b.cam_from_world * a.cam_from_world.Inverse(), Eigen::Vector2d::Zero(), a.camera.FocalPx().x(), 2.0);
      }
      if (score > best) {
        best = score;
        best_signs = {sign_h, sign_v};
      }
    }
  build(best_signs.first, best_signs.second);
  if (!matches.empty()) sink.Message(fmt::format("grid: {} photos, {:.0f} % of the matches between neighbours agree", n, 100 * best / static_cast<double>(matches.size())));
  return views;
}

}  // namespace

Rigid3 RingPose(const RingGeometry& ring, int index) {
  const double angle = index * ring.step_rad;
  const Eigen::Vector3d eye(std::cos(angle) * std::cos(ring.elevation_rad), std::sin(angle) * std::cos(ring.elevation_rad), std::sin(ring.elevation_rad));
  const Rigid3 look = LookAt(eye, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(-ring.roll_rad, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-ring.pan_rad, Eigen::Vector3d::UnitY());
  return Rigid3{turn, Eigen::Vector3d::Zero()} * look;
}

Rigid3 GridPose(double horizontal, double vertical) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-horizontal, -vertical, 0)}; }

std::pair<int, int> ParseGridSize(const std::string& text) {
  int rows = 0, columns = 0;
  char cross = 0, rest = 0;
  std::istringstream in(text);
  if (!(in >> rows >> cross >> columns) || (cross != 'x' && cross != 'X') || (in >> rest) || rows < 1 || columns < 1 || rows > 10000 || columns > 10000)
    throw UsageError(fmt::format("--grid-size {}: ROWSxCOLUMNS is expected, such as 17x17", text));
  return {rows, columns};
}

std::vector<HeldView> AssumeRig(const Capture& capture, const ReconstructOptions& options, const std::filesystem::path& database, ProgressSink& sink) {
  return options.rig == Rig::kRing ? Ring(capture, options, database, sink) : Grid(capture, options, database, sink);
}

}  // namespace lumi
