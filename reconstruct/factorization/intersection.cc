#include "reconstruct/factorization/intersection.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "scene/geometry/dense_solvers.h"

namespace lumi {
namespace {

struct Ray {
  const Matrix34d* P;
  Eigen::Vector2d x;
  double unit;
  std::size_t sight;
};

double PointErrorPx2(const Ray& v, const Eigen::Vector4d& X) {
  const Eigen::Vector3d q = *v.P * X;
  const double e = (q.head<2>() / q.z() - v.x).squaredNorm() * v.unit * v.unit;
  return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

Eigen::Vector4d LinearPoint(const std::vector<Ray>& views, const std::vector<char>& use) {
  Eigen::Matrix4d gram = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!use[i]) continue;
    const Matrix34d& P = *views[i].P;
    for (int r = 0; r < 2; ++r) {
      const Eigen::RowVector4d row = views[i].x[r] * P.row(2) - P.row(r);
      gram.noalias() += row.transpose() * row;
    }
  }
  return LeastDirection(gram);
}

Eigen::Vector4d RefinePoint(const std::vector<Ray>& views, const std::vector<char>& use, Eigen::Vector4d X) {
  const auto loss = [&](const Eigen::Vector4d& Y) {
    double sum = 0;
    for (std::size_t i = 0; i < views.size(); ++i)
      if (use[i]) sum += PointErrorPx2(views[i], Y);
    return sum;
  };
  double best = loss(X), damping = 1e-9;
  for (int round = 0; round < 8 && std::isfinite(best); ++round) {
    Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (!use[i]) continue;
      const Matrix34d& P = *views[i].P;
      const Eigen::Vector3d q = P * X;
      const Eigen::Vector2d y = q.head<2>() / q.z();
      Eigen::Matrix<double, 2, 4> J;
      for (int r = 0; r < 2; ++r) J.row(r) = (P.row(r) - y[r] * P.row(2)) * (views[i].unit / q.z());
      A.noalias() += J.transpose() * J;
      g.noalias() += J.transpose() * ((y - views[i].x) * views[i].unit);
    }
    const double size = A.trace() / 4;
    const Eigen::Vector4d Y = (X - SolveSymmetric(A + size * (X * X.transpose() + damping * Eigen::Matrix4d::Identity()), g)).normalized();
    const double c = Y.allFinite() ? loss(Y) : std::numeric_limits<double>::infinity();
    if (c < best) {
      const bool done = best - c < 1e-6 * best;
      X = Y;
      best = c;
      if (done) break;
    } else {
      if (damping > 1e-3) break;
      damping *= 1e3;
    }
  }
  return X;
}

}  // namespace

bool IntersectTrack(const ImagePoints& points, ProjectiveModel& model, std::size_t track, const IntersectionOptions& options) {
  std::vector<Ray> views;
  const auto& sights = points.tracks[track];
  for (std::size_t k = 0; k < sights.size(); ++k) {
    const auto f = static_cast<std::size_t>(sights[k].frame);
    if (model.placed[f]) views.push_back({&model.P[f], sights[k].x, points.px_per_unit[f], k});
  }
  const double limit2 = options.inlier_px * options.inlier_px;
  std::vector<char> use(views.size(), 1), best_use;
  Eigen::Vector4d X = model.X[track];
  int best_count = 0;
  double best_sum = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Eigen::Vector4d& Y) {
    int count = 0;
    double sum = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const double e = PointErrorPx2(views[i], Y);
      use[i] = e < limit2;
      count += use[i];
      if (use[i]) sum += e;
    }
    if (count > best_count || (count == best_count && sum < best_sum)) {
      best_count = count;
      best_sum = sum;
      best_use = use;
      X = Y;
    }
  };
  const int n = static_cast<int>(views.size());
  if (n >= 2) {
    if (model.solved[track]) offer(model.X[track]);
    if (best_count < n) {
      std::vector<char> all(views.size(), 1);
      offer(RefinePoint(views, all, LinearPoint(views, all)));
    }
    if (best_count < n && n > 2) {
      std::mt19937_64 random(options.seed ^ (0x9e3779b97f4a7c15ULL * (track + 1)));
      const int pairs = n * (n - 1) / 2, rounds = std::min(pairs, 24);
      std::vector<char> two(views.size(), 0);
      for (int round = 0; round < rounds && best_count < n - 1; ++round) {
        std::size_t i = random() % views.size(), j = random() % (views.size() - 1);
        if (j >= i) ++j;
        two[i] = two[j] = 1;
        offer(LinearPoint(views, two));
        two[i] = two[j] = 0;
      }
    }
  }
  model.solved[track] = 0;
  if (best_count < std::max(2, options.min_inliers)) return false;
  // What agrees is fitted, and asked again who agrees.
  for (int again = 0; again < 2; ++again) {
    const std::vector<char> fit = best_use;
    const int before = best_count;
    best_sum = std::numeric_limits<double>::infinity();
    offer(RefinePoint(views, fit, X));
    if (best_count == before) break;
  }
  model.X[track] = X.normalized();
  model.solved[track] = 1;
  for (std::size_t i = 0; i < views.size(); ++i) model.inlier[track][views[i].sight] = best_use[i];
  return true;
}

}  // namespace lumi
