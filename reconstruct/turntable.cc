#include "reconstruct/turntable.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kLeastStep = 1e-4,
                 kMostStep =
                     0.45;  // turns between two photos that tell the axis: from rounding to where the sense is open
constexpr std::size_t kFewestSteps = 3;
constexpr int kRounds = 30;      // of reweighting
constexpr double kPace = 0.05;   // by which the cameras may go round faster or slower than the turns say
constexpr double kStands = 0.5;  // of its way in the object's frame: more in the room, and the axis explains nothing
constexpr double kSameMoment = 1e-4;  // turns: a point that moves by a pixel a frame of a 100th turn moves by 0.01 px

struct Step {
  std::size_t a, b;
  double turns;              // from a to b, in (-1/2, 1/2]
  Eigen::Vector3d rotation;  // vector of R_a^T R_b, per radian turned: the axis, where the camera stands
};

Eigen::Vector3d RotationVector(const Eigen::Quaterniond& q) {
  const Eigen::AngleAxisd a(q.w() < 0 ? Eigen::Quaterniond(-q.coeffs()) : q);
  return a.angle() * a.axis();
}

// Least squares whose residuals beyond the usual one count less (Cauchy): rounds of solve and weigh.
template <typename Solve, typename Residual>
Eigen::Vector3d Reweighted(std::size_t n, const Solve& solve, const Residual& residual) {
  std::vector<double> weight(n, 1.0);
  Eigen::Vector3d x = solve(weight);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> r(n);
    for (std::size_t i = 0; i < n; ++i) r[i] = residual(i, x);
    const double usual = Median(r);
    if (!(usual > 0)) break;
    for (std::size_t i = 0; i < n; ++i) weight[i] = 1 / (1 + std::pow(r[i] / (2 * usual), 2));
    x = solve(weight);
  }
  return x;
}

}  // namespace

Rigid3 TurnAxis::RoomFromObject(double turns) const {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(2 * std::numbers::pi * (turns - std::floor(turns)), direction));
  return {q, point - q * point};
}

TurnAxis FindTurnAxis(const std::vector<Rigid3>& cam_from_object, const std::vector<double>& turns) {
  std::vector<Step> steps;
  for (std::size_t i = 1; i < turns.size(); ++i) {
    const double by = std::remainder(turns[i] - turns[i - 1], 1.0);
    if (std::abs(by) < kLeastStep || std::abs(by) > kMostStep) continue;
    const Eigen::Quaterniond q = cam_from_object[i - 1].rotation.conjugate() * cam_from_object[i].rotation;
    steps.push_back({i - 1, i, by, RotationVector(q) / (2 * std::numbers::pi * by)});
  }
  if (steps.size() < kFewestSteps)
    throw DataError(
        fmt::format("{} pairs of photos less than half a turn apart are too few to tell what the object turns about",
                    steps.size()),
        "give the photos of a turn, in the order of their times");
  // A short step tells little of the axis: what a camera is off is divided by it.
  const auto counts = [&](std::size_t i) { return steps[i].turns * steps[i].turns; };
  TurnAxis axis;
  axis.direction = Reweighted(
      steps.size(),
      [&](const std::vector<double>& weight) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        double all = 0;
        for (std::size_t i = 0; i < steps.size(); ++i)
          sum += weight[i] * counts(i) * steps[i].rotation, all += weight[i] * counts(i);
        return Eigen::Vector3d(sum / all);
      },
      [&](std::size_t i, const Eigen::Vector3d& a) {
        return std::abs(steps[i].turns) * (steps[i].rotation - a).norm();
      });
  const double pace = axis.direction.norm();
  if (!(std::abs(pace - 1) < kPace))
    throw DataError(fmt::format("the cameras go round by {:.2f} of what the phases say", pace),
                    "--turntable is for cameras in the frame of an object that turns once a period: check the phases, "
                    "and --period-s");
  axis.direction /= pace;
  // C_a and C_b are one place in the room: (Q_a - Q_b) p = Q_a C_a - Q_b C_b, Q the rotation into the room about an
  // axis through 0.
  const auto Q = [&](std::size_t i) {
    return Eigen::AngleAxisd(2 * std::numbers::pi * (turns[i] - std::floor(turns[i])), axis.direction)
        .toRotationMatrix();
  };
  std::vector<Eigen::Vector3d> centre;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  // of what is free along the axis, the shortest: from here
  for (const Rigid3& pose : cam_from_object) {
    centre.push_back(pose.OriginInSource());
    middle += centre.back() / static_cast<double>(cam_from_object.size());
  }
  std::vector<Eigen::Matrix3d> A;
  std::vector<Eigen::Vector3d> b;
  for (const Step& s : steps) {
    const Eigen::Matrix3d Qa = Q(s.a), Qb = Q(s.b);
    A.push_back(Qa - Qb);
    b.push_back(Qa * (centre[s.a] - middle) - Qb * (centre[s.b] - middle));
  }
  axis.point = middle + Reweighted(
                            steps.size(),
                            [&](const std::vector<double>& weight) {
                              Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
                              Eigen::Vector3d r = Eigen::Vector3d::Zero();
                              for (std::size_t i = 0; i < A.size(); ++i)
                                N += weight[i] * A[i].transpose() * A[i], r += weight[i] * A[i].transpose() * b[i];
                              return Eigen::Vector3d(SolveLeastNorm(N, r));
                            },
                            [&](std::size_t i, const Eigen::Vector3d& p) { return (A[i] * p - b[i]).norm(); });
  std::vector<double> in_object, in_room;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    in_object.push_back((centre[steps[i].a] - centre[steps[i].b]).norm());
    in_room.push_back((A[i] * (axis.point - middle) - b[i]).norm());
  }
  axis.object_step = Median(in_object);
  axis.room_step = Median(in_room);
  if (!(axis.room_step < kStands * axis.object_step))
    throw DataError("no axis explains how the cameras go round: in the room they would move as far as about the object",
                    "--turntable is for an object that turns about one axis, once a period");
  return axis;
}

TurnAxis PutIntoRoom(Scene& scene, double period_s) {
  std::vector<std::size_t> order(scene.views.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order,
                    [&](std::size_t a, std::size_t b) { return *scene.views[a].time_s < *scene.views[b].time_s; });
  std::vector<Rigid3> cam_from_object;
  std::vector<double> turns;
  for (const std::size_t i : order) {
    cam_from_object.push_back(scene.views[i].cam_from_world);
    turns.push_back(*scene.views[i].time_s / period_s);
  }
  const TurnAxis axis = FindTurnAxis(cam_from_object, turns);
  const auto phase_of = [&](const View& view) {
    const double turn = *view.time_s / period_s;
    return turn - std::floor(turn);
  };
  for (View& view : scene.views)
    view.cam_from_world = view.cam_from_world * axis.RoomFromObject(phase_of(view)).Inverse();
  std::vector<Point> moments;
  for (const Point& point : scene.points) {
    std::vector<std::pair<double, const Observation*>> seen;
    for (const Observation& o : point.track)
      seen.emplace_back(phase_of(scene.views[static_cast<std::size_t>(o.view.value)]), &o);
    std::ranges::sort(seen, [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (i == 0 || seen[i].first - seen[i - 1].first > kSameMoment) {
        moments.push_back(point);
        moments.back().x_in_world = axis.RoomFromObject(seen[i].first) * point.x_in_world;
        moments.back().track.clear();
      }
      moments.back().track.push_back(*seen[i].second);
    }
  }
  scene.points = std::move(moments);
  scene.period_s = period_s;
  return axis;
}

}  // namespace lumi
