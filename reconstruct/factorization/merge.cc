#include "reconstruct/factorization/merge.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector4d;
using Matrix16d = Eigen::Matrix<double, 16, 16>;
using Vector16d = Eigen::Matrix<double, 16, 1>;
using RowMajor4d = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;

struct SharedSight {
  Vector4d X;              // the part's point
  const Matrix34d* P;      // the whole's camera
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

// Gauss-Newton with Cauchy weights on the sixteen numbers, their scale held.
Matrix4d RefineTransformation(const std::vector<SharedSight>& sights, Matrix4d H, double scale_px) {
  H.normalize();
  const double s2 = scale_px * scale_px;
  const auto loss = [&](const Matrix4d& G) {
    double sum = 0;
    for (const SharedSight& s : sights) sum += std::log1p(std::min(1e12, SharedErrorPx2(s, G) / s2));
    return sum;
  };
  double best = loss(H), damping = 1e-6;
  for (int round = 0; round < 20; ++round) {
    Matrix16d A = Matrix16d::Zero();
    Vector16d g = Vector16d::Zero();
    for (const SharedSight& s : sights) {
      const Eigen::Vector3d q = *s.P * (H * s.X);
      const Eigen::Vector2d y = q.head<2>() / q.z();
      const Eigen::Vector2d r = (y - s.x) * s.unit;
      const double w = 1 / (1 + r.squaredNorm() / s2);
      Eigen::Matrix<double, 2, 16> J;
      for (int k = 0; k < 2; ++k) {
        const Eigen::RowVector4d by_point = (s.P->row(k) - y[k] * s.P->row(2)) * (s.unit / q.z());
        for (int i = 0; i < 4; ++i) J.block<1, 4>(k, 4 * i) = by_point[i] * s.X.transpose();
      }
      if (!J.allFinite()) continue;
      A.noalias() += w * J.transpose() * J;
      g.noalias() += w * J.transpose() * r;
    }
    const RowMajor4d rows = H;
    const Eigen::Map<const Vector16d> h(rows.data());
    const double size = A.trace() / 16;
    bool better = false;
    for (int attempt = 0; attempt < 5 && !better; ++attempt) {
      const Vector16d next = h - SolveSymmetric(A + size * (h * h.transpose() + damping * Matrix16d::Identity()), g);
      const Matrix4d G = Matrix4d(Eigen::Map<const RowMajor4d>(next.data())).normalized();
      const double c = G.allFinite() ? loss(G) : std::numeric_limits<double>::infinity();
      if (c < best) {
        const bool done = best - c < 1e-7 * best;
        better = true;
        best = c;
        H = G;
        damping = std::max(damping * 0.1, 1e-14);
        if (done) return H;
      } else {
        damping *= 100;
      }
    }
    if (!better) break;
  }
  return H;
}

}  // namespace

MergeSummary Merge(const ImagePoints& points, ProjectiveModel& whole, const Window& window, const ProjectiveModel& part,
    const MergeOptions& options) {
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
  double best = std::numeric_limits<double>::infinity();
  Matrix4d H = Matrix4d::Identity();
  const auto offer = [&](const Matrix4d& G) {
    double score = 0;
    for (const SharedSight& s : sights) {
      score += std::min(limit2, SharedErrorPx2(s, G));
      if (score >= best) return;
    }
    best = score;
    H = G;
  };
  if (cameras.size() >= 2) offer(FromCameras(cameras));
  const double good = 0.1 * limit2 * static_cast<double>(sights.size());
  std::mt19937_64 random(options.seed);
  for (int round = 0; round < options.max_iterations && best > good && shared.size() >= 5; ++round) {
    Matrix16d gram = Matrix16d::Zero();
    for (int k = 0; k < 5; ++k) {
      const auto& [w, p] = shared[random() % shared.size()];
      AddPoint(w, p, gram);
    }
    offer(SmallestTransformation(gram));
  }
  if (!std::isfinite(best)) return summary;
  offer(RefineTransformation(sights, H, options.inlier_px / 2));
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
  for (std::size_t i = 0; i < window.frames.size(); ++i) local[static_cast<std::size_t>(window.frames[i])] = static_cast<int>(i);
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
