#include "stabilize/world_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/levenberg_marquardt.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

constexpr int kRounds = 10;
constexpr double kHuber = 2.5;  // of the median distance
constexpr double kLeastHuber = 1e-6;
constexpr double kInFront = 1e-9;

using Vector16 = Eigen::Matrix<double, 16, 1>;

// A point of b's world in front of b's camera, where b's picture shows it, and a's camera of the same frame.
struct SeenByBoth {
  const Matrix34d* P_a;
  Eigen::Vector4d X;
  Eigen::Vector2d x;
};

// The image in a's camera, w > 0; a_from_b by columns.
std::optional<Eigen::Vector3d> InFrontOfA(const SeenByBoth& s, const Vector16& a_from_b) {
  const Eigen::Vector3d q = *s.P_a * (Eigen::Map<const Eigen::Matrix4d>(a_from_b.data()) * s.X);
  return q.z() > kInFront * q.norm() ? std::optional(q) : std::nullopt;
}

std::vector<double> Distances(const std::vector<SeenByBoth>& seen, const Vector16& a_from_b) {
  std::vector<double> distances;
  for (const SeenByBoth& s : seen)
    if (const auto q = InFrontOfA(s, a_from_b)) distances.push_back((q->hnormalized() - s.x).norm());
  return distances;
}

// P_a G and P_b have one direction: of (I - b b^T) vec(P_a G) the least.
Eigen::Matrix4d FromCameras(const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(16, 16);
  for (std::size_t t = 0; t < a.size(); ++t) {
    Eigen::Matrix<double, 12, 16> V =
        Eigen::Matrix<double, 12, 16>::Zero();  // vec by columns: vec(A G) = (I kron A) vec(G)
    for (int c = 0; c < 4; ++c) V.block<3, 4>(3 * c, 4 * c) = a[t];
    const Eigen::Matrix<double, 12, 1> direction =
        Eigen::Map<const Eigen::Matrix<double, 12, 1>>(b[t].data()).normalized();
    V -= direction * (direction.transpose() * V).eval();
    N += V.transpose() * V;
  }
  const Eigen::VectorXd g = LeastDirection(N);
  return Eigen::Map<const Eigen::Matrix4d>(g.data());
}

}  // namespace

std::optional<WorldMap> MapBetweenWorlds(const std::vector<Matrix34d>& a, const std::vector<Matrix34d>& b,
                                         const std::vector<std::vector<Eigen::Vector4d>>& points_b) {
  if (a.size() < 3 || a.size() != b.size() || a.size() != points_b.size()) return std::nullopt;
  WorldMap map;
  map.a_from_b = FromCameras(a, b);
  if (!map.a_from_b.allFinite()) return std::nullopt;
  long ahead = 0, behind = 0;
  for (std::size_t t = 0; t < a.size(); ++t)
    for (const Eigen::Vector4d& X : points_b[t]) (a[t].row(2) * map.a_from_b * X > 0 ? ahead : behind) += 1;
  if (behind > ahead) map.a_from_b = -map.a_from_b;

  std::vector<SeenByBoth> seen;
  for (std::size_t t = 0; t < a.size(); ++t)
    for (const Eigen::Vector4d& X : points_b[t])
      if (const Eigen::Vector3d x = b[t] * X; x.z() > kInFront) seen.push_back({&a[t], X, x.hnormalized()});
  Vector16 g = Eigen::Map<const Vector16>(map.a_from_b.data());
  double huber = 0;
  std::size_t least = 0;  // that have to stay in front
  const auto cost = [&](const Vector16& at, NormalEquations<16>* normal) {
    double sum = 0;
    std::size_t count = 0;
    for (const SeenByBoth& s : seen) {
      const auto q = InFrontOfA(s, at);
      if (!q) continue;
      ++count;
      const Eigen::Vector2d y = q->hnormalized(), off = y - s.x;
      const double distance = off.norm(), weight = distance > huber ? huber / distance : 1;
      sum += distance > huber ? huber * (2 * distance - huber) : distance * distance;
      if (!normal) continue;
      Eigen::Matrix<double, 2, 16> J;
      for (int r = 0; r < 2; ++r)
        for (int c = 0; c < 4; ++c)
          J.block<1, 4>(r, 4 * c) = (s.P_a->row(r) - y[r] * s.P_a->row(2)) * (s.X[c] / q->z());
      normal->Add(J, off, weight);
    }
    return count < least ? std::numeric_limits<double>::infinity() : sum;
  };
  // A step, then Huber's scale anew.
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> distances = Distances(seen, g);
    if (distances.empty()) return std::nullopt;
    least = distances.size();
    huber = std::max(kLeastHuber, kHuber * Median(distances));
    const LeastSquaresOptions one_step{
        .max_iterations = 1, .max_attempts = 1, .tolerance = 1e-6, .damping = 1e-10, .homogeneous = true};
    if (MinimiseSquares<16>(one_step, cost, g).stop != LeastSquaresStop::kMaxIterations) break;
  }
  map.a_from_b = Eigen::Map<const Eigen::Matrix4d>(g.data());
  const std::vector<double> distances = Distances(seen, g);
  const double limit = 3 * std::max(kLeastHuber / kHuber, Median(distances));
  double sum = 0;
  for (const double d : distances) sum += d < limit ? d * d : 0;
  map.rms = std::sqrt(sum / static_cast<double>(distances.size()));
  return map;
}

}  // namespace lumi
