#include "stabilize/world_map.h"

#include <algorithm>
#include <cmath>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

constexpr int kRounds = 10;
constexpr double kHuber = 2.5;      // of the median distance
constexpr double kLeastHuber = 1e-6;
constexpr double kInFront = 1e-9;

using Row16 = Eigen::Matrix<double, 1, 16>;
using Matrix16 = Eigen::Matrix<double, 16, 16>;

// P_a G and P_b have one direction: of (I - b b^T) vec(P_a G) the least.
Eigen::Matrix4d FromCameras(const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(16, 16);
  for (std::size_t t = 0; t < a.size(); ++t) {
    Eigen::Matrix<double, 12, 16> V = Eigen::Matrix<double, 12, 16>::Zero();  // vec by columns: vec(A G) = (I kron A) vec(G)
    for (int c = 0; c < 4; ++c) V.block<3, 4>(3 * c, 4 * c) = a[t];
    const Eigen::Matrix<double, 12, 1> direction = Eigen::Map<const Eigen::Matrix<double, 12, 1>>(b[t].data()).normalized();
    V -= direction * (direction.transpose() * V).eval();
    N += V.transpose() * V;
  }
  const Eigen::VectorXd g = LeastDirection(N);
  return Eigen::Map<const Eigen::Matrix4d>(g.data());
}

}  // namespace

std::optional<WorldMap> MapBetweenWorlds(const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b, const std::vector<std::vector<Eigen::Vector4d>>& points_b) {
  if (a.size() < 3 || a.size() != b.size() || a.size() != points_b.size()) return std::nullopt;
  WorldMap map;
  map.a_from_b = FromCameras(a, b);
  if (!map.a_from_b.allFinite()) return std::nullopt;
  long ahead = 0, behind = 0;
  for (std::size_t t = 0; t < a.size(); ++t)
    for (const Eigen::Vector4d& X : points_b[t]) (a[t].row(2) * map.a_from_b * X > 0 ? ahead : behind) += 1;
  if (behind > ahead) map.a_from_b = -map.a_from_b;

  struct State {
    double cost = 0, rms = 0;
    long count = 0;
    Matrix16 N = Matrix16::Zero();
    Eigen::Matrix<double, 16, 1> right = Eigen::Matrix<double, 16, 1>::Zero();
  };
  double huber = 0;
  const auto look = [&](const Eigen::Matrix4d& G, bool scale) {
    State state;
    std::vector<double> distances;
    for (int pass = scale ? 0 : 1; pass < 2; ++pass) {
      for (std::size_t t = 0; t < a.size(); ++t)
        for (const Eigen::Vector4d& X : points_b[t]) {
          const Eigen::Vector3d q = a[t] * (G * X), x = b[t] * X;
          if (!(q.z() > kInFront * q.norm()) || !(x.z() > kInFront)) continue;
          const Eigen::Vector2d y = q.head<2>() / q.z(), off = y - x.head<2>() / x.z();
          const double distance = off.norm();
          if (pass == 0) {
            distances.push_back(distance);
            continue;
          }
          const double weight = distance > huber ? huber / distance : 1;
          state.cost += distance > huber ? huber * (2 * distance - huber) : distance * distance;
          ++state.count;
          if (distance < 3 * huber / kHuber) state.rms += distance * distance;
          for (int r = 0; r < 2; ++r) {
            const Eigen::RowVector4d by_point = (a[t].row(r) - y[r] * a[t].row(2)) / q.z();
            Row16 J;
            for (int c = 0; c < 4; ++c) J.segment<4>(4 * c) = by_point * X[c];
            state.N.selfadjointView<Eigen::Lower>().rankUpdate(J.transpose(), weight);
            state.right -= weight * off[r] * J.transpose();
          }
        }
      if (pass == 0 && !distances.empty()) {
        std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2), distances.end());
        huber = std::max(kLeastHuber, kHuber * distances[distances.size() / 2]);
      }
    }
    if (state.count > 0) state.rms = std::sqrt(state.rms / static_cast<double>(state.count));
    return state;
  };
  State now = look(map.a_from_b, true);
  if (now.count == 0) return std::nullopt;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd N = now.N.selfadjointView<Eigen::Lower>();
    N.diagonal().array() += 1e-10 * N.trace() / 16;  // its own scale, and what the frames do not tell
    const Eigen::VectorXd step = SolveSymmetric(N, now.right);
    const Eigen::Matrix4d next = (map.a_from_b + Eigen::Map<const Eigen::Matrix4d>(step.data())).normalized();
    if (!next.allFinite()) break;
    const State then = look(next, false);
    if (then.count < now.count || !(then.cost < now.cost)) break;
    map.a_from_b = next;
    const bool done = then.cost > (1 - 1e-6) * now.cost;
    now = look(next, true);
    if (done) break;
  }
  map.rms = now.rms;
  return map;
}

}  // namespace lumi
