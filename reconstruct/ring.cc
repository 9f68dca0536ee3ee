#include "reconstruct/ring.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "reconstruct/nelder_mead.h"
#include "reconstruct/rig_matches.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr double kTurnRad = 360 * kRadPerDeg;

// How well a match agrees with two poses: 1 exactly, 1/2 at `scale_px` from the epipolar line, 0 behind a camera.
double Agreement(const RigMatch& match, const Rigid3& b_from_a, const Eigen::Vector2d& middle_px, double focal_px,
                 double scale_px) {
  const Eigen::Vector3d a = ((match.x_a_px - middle_px) / focal_px).homogeneous(),
                        b = ((match.x_b_px - middle_px) / focal_px).homogeneous();
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

double RingScore(const RingGeometry& ring, const std::vector<RigMatch>& matches, const Eigen::Vector2d& middle_px,
                 double scale_px) {
  double sum = 0;
  std::map<int, Rigid3> b_from_a;  // by the distance in the ring: poses of neighbours differ by that alone
  for (const RigMatch& match : matches) {
    auto it = b_from_a.find(match.b - match.a);
    if (it == b_from_a.end())
      it = b_from_a.emplace(match.b - match.a, RingPose(ring, match.b - match.a) * RingPose(ring, 0).Inverse()).first;
    sum += Agreement(match, it->second, middle_px, ring.focal_px, scale_px);
  }
  return sum / static_cast<double>(matches.size());
}

}  // namespace

Rigid3 RingPose(const RingGeometry& ring, int index) {
  const double angle = index * ring.step_rad;
  const Eigen::Vector3d eye(std::cos(angle) * std::cos(ring.elevation_rad),
                            std::sin(angle) * std::cos(ring.elevation_rad), std::sin(ring.elevation_rad));
  const Rigid3 look = LookAt(eye, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(-ring.roll_rad, Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(-ring.pan_rad, Eigen::Vector3d::UnitY());
  return Rigid3{turn, Eigen::Vector3d::Zero()} * look;
}

std::vector<HeldView> AssumeRing(const Capture& capture, const ReconstructOptions& options,
                                 const std::filesystem::path& database, ProgressSink& sink) {
  const int n = static_cast<int>(capture.photos.size());
  const InputPhoto& first = capture.photos.front();
  for (const InputPhoto& photo : capture.photos)
    if (photo.width_px != first.width_px || photo.height_px != first.height_px)
      throw DataError("the photos of a turntable have one size; these have several",
                      "scale them to one size, or leave out --rig");
  // Neighbours up to three steps away overlap; the room's points move by less than this.
  constexpr int kReach = 3;
  constexpr std::size_t kPerPair = 40, kMinMatches = 100;
  constexpr double kRoomPx = 2;
  const auto matches = MatchesOfRig(capture, database, kPerPair, kRoomPx, [n](int a, int b) {
    const int d = std::abs(a - b);
    return std::min(d, n - d) <= kReach;
  });
  if (matches.size() < kMinMatches)
    throw DataError(fmt::format("only {} matches between neighbours on the ring", matches.size()),
                    "photos of a ring need texture and steps of 15 degrees or less");

  const std::optional<Camera> given = IntrinsicsFromOptions(options, first.width_px, first.height_px);
  const Eigen::Vector2d middle =
      given ? given->PrincipalPointPx() : Eigen::Vector2d(first.width_px / 2.0, first.height_px / 2.0);
  // Coarse to fine: a wide tolerance over a grid of focal lengths, elevations and both senses of rotation, then a
  // narrow one from the best of them. Agreement saturates, so wrong matches do not pull.
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
  ParallelEach(grid.size(), 1, [&](std::size_t i) {
    scores[i] = {-RingScore(grid[i], matches, middle, kWidePx), i};
    progress.Step();
  });
  std::ranges::sort(scores);
  const auto starts = std::min<std::size_t>(kStarts, scores.size());
  std::vector<std::pair<double, RingGeometry>> refined(starts);
  ParallelEach(starts, 1, [&](std::size_t s) {
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
      x = NelderMead([&](const std::vector<double>& y) { return -RingScore(ring_at(y), matches, middle, scale_px); }, x,
                     {given ? 0.0 : 0.1, 2 * angle, angle, angle}, 300);
    }
    refined[s] = {RingScore(ring_at(x), matches, middle, kNarrowPx), ring_at(x)};
    progress.Step();
  });
  const auto best = *std::ranges::max_element(refined, [](const auto& a, const auto& b) { return a.first < b.first; });
  if (best.first < kMinAgreement)
    throw DataError(
        fmt::format("no ring of {} evenly spaced cameras explains the matches (agreement {:.2f}, {:.2f} is asked for)",
                    n, best.first, kMinAgreement),
        "the photos must be one full turn in the order of their names; else leave out --rig");
  sink.Message(
      fmt::format("ring: focal length {:.1f} px, cameras {:.1f} degrees above the object, {}, {:.0f} % agreement",
                  best.second.focal_px, best.second.elevation_rad * kDegPerRad,
                  best.second.step_rad > 0 ? "counter-clockwise" : "clockwise", 100 * best.first));
  std::vector<HeldView> views;
  for (int i = 0; i < n; ++i) {
    HeldView view;
    view.name = capture.photos[static_cast<std::size_t>(i)].name;
    view.camera = given ? *given
                        : Camera::Pinhole(first.width_px, first.height_px, best.second.focal_px, best.second.focal_px,
                                          middle.x(), middle.y());
    view.cam_from_world = RingPose(best.second, i);
    views.push_back(std::move(view));
  }
  return views;
}

}  // namespace lumi
