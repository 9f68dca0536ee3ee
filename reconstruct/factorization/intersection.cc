#include "reconstruct/factorization/intersection.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "reconstruct/factorization/ransac.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/levenberg_marquardt.h"

namespace lumi {
namespace {

constexpr std::size_t kMostPairs = 24;  // of sights, that a track's point is sought from

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
  const auto cost = [&](const Eigen::Vector4d& Y, NormalEquations<4>* normal) {
    double sum = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      if (!use[i]) continue;
      const Matrix34d& P = *views[i].P;
      const Eigen::Vector3d q = P * Y;
      const Eigen::Vector2d y = q.head<2>() / q.z(), r = (y - views[i].x) * views[i].unit;
      sum += r.squaredNorm();
      if (!normal) continue;
      Eigen::Matrix<double, 2, 4> J;
      for (int k = 0; k < 2; ++k) J.row(k) = (P.row(k) - y[k] * P.row(2)) * (views[i].unit / q.z());
      normal->Add(J, r);
    }
    return sum;
  };
  MinimiseSquares<4>({.max_iterations = 8,
                      .max_attempts = 4,
                      .tolerance = 1e-6,
                      .damping = 1e-9,
                      .damping_rise = 1e3,
                      .homogeneous = true},
                     cost, X);
  return X;
}

}  // namespace

bool IntersectTrack(const ImagePoints& points, ProjectiveModel& model, std::size_t track,
                    const IntersectionOptions& options) {
  std::vector<Ray> views;
  const auto& sights = points.tracks[track];
  for (std::size_t k = 0; k < sights.size(); ++k) {
    const auto f = static_cast<std::size_t>(sights[k].frame);
    if (model.placed[f]) views.push_back({&model.P[f], sights[k].x, points.px_per_unit[f], k});
  }
  const std::size_t n = views.size();
  const auto error = [&](const Eigen::Vector4d& X, std::size_t i) { return PointErrorPx2(views[i], X); };
  Consensus<Eigen::Vector4d, decltype(error)> consensus(n, options.inlier_px * options.inlier_px, error);
  if (n >= 2) {
    if (model.solved[track]) consensus.Offer(model.X[track]);
    const std::vector<char> all(n, 1);
    if (consensus.InlierCount() < static_cast<int>(n))
      consensus.Offer(RefinePoint(views, all, LinearPoint(views, all)));
    if (consensus.InlierCount() < static_cast<int>(n) && n > 2) {
      std::mt19937_64 random(options.seed ^ (0x9e3779b97f4a7c15ULL * (track + 1)));
      const int pairs = static_cast<int>(std::min<std::size_t>(n * (n - 1) / 2, kMostPairs));
      std::vector<char> two(n, 0);
      DrawModels<2>({.max_trials = pairs, .confidence = 0.99}, n, random, consensus,
                    [&](const std::array<std::size_t, 2>& pair) {
                      two[pair[0]] = two[pair[1]] = 1;
                      const bool better = consensus.Offer(LinearPoint(views, two));
                      two[pair[0]] = two[pair[1]] = 0;
                      return better;
                    });
    }
  }
  model.solved[track] = 0;
  int count = consensus.InlierCount();
  if (count < std::max(2, options.min_inliers)) return false;
  // The point is fitted to the sights that agree, and then the sights that agree with it are determined again.
  for (int again = 0, before = -1; again < 2 && count != before; ++again) {
    before = count;
    consensus.Offer(RefinePoint(views, consensus.Inliers(), consensus.best()));
    count = consensus.InlierCount();
  }
  if (count < std::max(2, options.min_inliers)) return false;
  model.X[track] = consensus.best().normalized();
  model.solved[track] = 1;
  const std::vector<char> agrees = consensus.Inliers();
  for (std::size_t i = 0; i < n; ++i) model.inlier[track][views[i].sight] = agrees[i];
  return true;
}

}  // namespace lumi
