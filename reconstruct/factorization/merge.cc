#include "reconstruct/factorization/merge.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "reconstruct/factorization/ransac.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector4d;
using Matrix16d = Eigen::Matrix<double, 16, 16>;
using Vector16d = Eigen::Matrix<double, 16, 1>;
using RowMajor4d = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

constexpr double kMostLoss =
    28;  // of a sight, of its scale's square: one at infinity counts as one a million scales off

struct SharedSight {
  Vector4d X;          // the part's point
  const Matrix34d* P;  // the whole's camera
  Eigen::Vector2d x;
  double unit;
};

double SharedErrorPx2(const SharedSight& s, const Matrix4d& H) {
  const Eigen::Vector3d q = *s.P * (H * s.X);
  const double e = (q.head<2>() / q.z() - s.x).squaredNorm() * s.unit * s.unit;
  return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

Matrix4d SmallestTransformation(const Matrix16d& gram) {
  const Vector16d h = LeastDirection(gram);
  return Eigen::Map<const RowMajor4d>(h.data());
}

// P_part ~ P_whole H for every shared camera.
Matrix4d FromCameras(const std::vector<std::pair<Matrix34d, Matrix34d>>& cameras) {
  Matrix16d gram = Matrix16d::Zero();
  for (const auto& [whole, part] : cameras) {
    Eigen::Matrix<double, 12, 16> A = Eigen::Matrix<double, 12, 16>::Zero();
    for (int r = 0; r < 3; ++r)
      for (int k = 0; k < 4; ++k) A.block<4, 4>(4 * r, 4 * k) = whole(r, k) * Matrix4d::Identity();
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = part.normalized();
    const Eigen::Map<const Eigen::Matrix<double, 12, 1>> p(rows.data());
    const Eigen::Matrix<double, 12, 16> across = A - p * (p.transpose() * A);
    gram.noalias() += across.transpose() * across;
  }
  return SmallestTransformation(gram);
}

// X_whole ~ H X_part for points.
void AddPoint(const Vector4d& whole, const Vector4d& part, Matrix16d& gram) {
  const Matrix4d across = Matrix4d::Identity() - whole * whole.transpose() / whole.squaredNorm();
  const Matrix4d outer = part * part.transpose() / part.squaredNorm();
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) gram.block<4, 4>(4 * i, 4 * j) += across(i, j) * outer;
}

Matrix4d RefineTransformation(const std::vector<SharedSight>& sights, const Matrix4d& H, double scale_px,
                              LeastSquaresSummary& summary) {
  const auto cost = [&](const Vector16d& h, NormalEquations<16>* normal) {
    const Matrix4d G = Eigen::Map<const RowMajor4d>(h.data());
    double sum = 0;
    for (const SharedSight& s : sights) {
      const Eigen::Vector3d q = *s.P * (G * s.X);
      const Eigen::Vector2d y = q.head<2>() / q.z(), r = (y - s.x) * s.unit;
      const RobustLoss loss = Cauchy(SharedErrorPx2(s, G), scale_px * scale_px);
      sum += std::min(loss.cost, kMostLoss * scale_px * scale_px);
      if (!normal) continue;
      Eigen::Matrix<double, 2, 16> J;
      for (int k = 0; k < 2; ++k) {
        const Eigen::RowVector4d by_point = (s.P->row(k) - y[k] * s.P->row(2)) * (s.unit / q.z());
        for (int i = 0; i < 4; ++i) J.block<1, 4>(k, 4 * i) = by_point[i] * s.X.transpose();
      }
      if (J.allFinite()) normal->Add(J, r, loss.weight);
    }
    return sum;
  };
  const RowMajor4d rows = H;
  Vector16d h = Eigen::Map<const Vector16d>(rows.data());
  summary = MinimiseSquares<16>({.max_iterations = 20, .tolerance = 1e-7, .min_damping = 1e-14, .homogeneous = true},
                                cost, h);
  return Eigen::Map<const RowMajor4d>(h.data());
}

}  // namespace

MergeSummary Merge(const ImagePoints& points, ProjectiveModel& whole, const FrameWindow& window,
                   const ProjectiveModel& part, const MergeOptions& options) {
  MergeSummary summary;
  std::vector<std::pair<Matrix34d, Matrix34d>> cameras;
  for (std::size_t i = 0; i < window.frames.size(); ++i) {
    const auto f = static_cast<std::size_t>(window.frames[i]);
    if (whole.placed[f] && part.placed[i]) cameras.emplace_back(whole.P[f], part.P[i]);
  }
  std::vector<std::pair<Vector4d, Vector4d>> shared;
  std::vector<SharedSight> sights;
  for (std::size_t i = 0; i < window.tracks.size(); ++i) {
    const auto t = static_cast<std::size_t>(window.tracks[i]);
    if (!whole.solved[t] || !part.solved[i]) continue;
    shared.emplace_back(whole.X[t], part.X[i]);
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& s = points.tracks[t][k];
      const auto f = static_cast<std::size_t>(s.frame);
      if (whole.placed[f] && whole.inlier[t][k]) sights.push_back({part.X[i], &whole.P[f], s.x, points.px_per_unit[f]});
    }
  }
  summary.shared_frames = static_cast<int>(cameras.size());
  summary.shared_tracks = static_cast<int>(shared.size());
  if (summary.shared_tracks < options.min_shared_tracks || sights.empty()) return summary;

  const double limit2 = options.inlier_px * options.inlier_px;
  const auto error = [&](const Matrix4d& G, std::size_t i) { return SharedErrorPx2(sights[i], G); };
  Consensus<Matrix4d, decltype(error)> consensus(sights.size(), limit2, error);
  if (cameras.size() >= 2) consensus.Offer(FromCameras(cameras));
  std::mt19937_64 random(options.seed);
  DrawModels<5>({.max_trials = options.max_iterations}, shared.size(), random, consensus,
                [&](const std::array<std::size_t, 5>& sample) {
                  Matrix16d gram = Matrix16d::Zero();
                  for (const std::size_t k : sample) AddPoint(shared[k].first, shared[k].second, gram);
                  return consensus.Offer(SmallestTransformation(gram));
                });
  if (!consensus.found()) return summary;
  consensus.Offer(RefineTransformation(sights, consensus.best(), options.inlier_px / 2, summary.refined));
  const Matrix4d H = consensus.best();
  int inliers = 0;
  double sum = 0;
  for (const SharedSight& s : sights) {
    const double e = SharedErrorPx2(s, H);
    if (e >= limit2) continue;
    ++inliers;
    sum += e;
  }
  summary.inlier_share = inliers / static_cast<double>(sights.size());
  summary.rms_px = inliers > 0 ? std::sqrt(sum / inliers) : 0.0;
  const auto inverse = InverseOf(H);
  if (summary.inlier_share < options.min_inlier_share || !inverse) return summary;

  const Matrix4d back = *inverse;
  std::vector<char> fresh(points.FrameCount(), 0);
  for (std::size_t i = 0; i < window.frames.size(); ++i) {
    const auto f = static_cast<std::size_t>(window.frames[i]);
    if (!part.placed[i] || whole.placed[f]) continue;
    whole.P[f] = (part.P[i] * back).eval().normalized();
    whole.placed[f] = 1;
    fresh[f] = 1;
  }
  std::vector<int> local(points.FrameCount(), -1);
  for (std::size_t i = 0; i < window.frames.size(); ++i)
    local[static_cast<std::size_t>(window.frames[i])] = static_cast<int>(i);
  for (std::size_t i = 0; i < window.tracks.size(); ++i) {
    if (!part.solved[i]) continue;
    const auto t = static_cast<std::size_t>(window.tracks[i]);
    const bool added = !whole.solved[t];
    if (added) {
      whole.X[t] = (H * part.X[i]).normalized();
      whole.solved[t] = 1;
    }
    // Sights in frames outside the window are judged when the whole is culled.
    std::size_t in_window = 0;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const int f = points.tracks[t][k].frame;
      if (local[static_cast<std::size_t>(f)] < 0) continue;
      const char flag = part.inlier[i][in_window++];
      if (added || fresh[static_cast<std::size_t>(f)]) whole.inlier[t][k] = flag;
    }
  }
  summary.merged = true;
  return summary;
}

}  // namespace lumi
