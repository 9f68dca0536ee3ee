#include "stabilize/path_before.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

namespace lumi {
namespace {

constexpr double kSameWorld =
    0.02;  // units: two windows that disagree more about the frames that both have are no projective map of each other

}  // namespace

Seam SeamOf(int overlap, int half_window) {
  const int margin = std::min(half_window, overlap / 3);
  return {margin, overlap - margin};
}

double SeamShare(const std::vector<double>& times, std::size_t frame, const Seam& seam) {
  const auto begin = static_cast<std::size_t>(std::max(0, seam.begin)),
             end = std::min(times.size() - 1, static_cast<std::size_t>(std::max(seam.begin + 1, seam.end)));
  if (frame <= begin) return 0;
  if (frame >= end) return 1;
  const double u = (times[frame] - times[begin]) / (times[end] - times[begin]);
  return u * u * u * (10 - 15 * u + 6 * u * u);
}

std::optional<Eigen::Vector2d> ImageOf(const Matrix34d& P, const Eigen::Vector4d& X) {
  const Eigen::Vector3d q = P * X;
  if (!(q.z() > 1e-9)) return std::nullopt;
  return Eigen::Vector2d(q.head<2>() / q.z());
}

std::optional<Move> Moved(const std::vector<Anchor>& anchors, const Eigen::Vector2d& x_px) {
  constexpr std::size_t kNearest = 8;
  constexpr double kSameFeaturePx = 0.7;
  if (anchors.size() < 4) return std::nullopt;
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < anchors.size(); ++i) near.emplace_back((anchors[i].from_px - x_px).squaredNorm(), i);
  const std::size_t n = std::min(kNearest, near.size());
  std::partial_sort(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(n), near.end());
  const double reach = near[n - 1].first + 1;
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  Eigen::Vector2d plain = Eigen::Vector2d::Zero();
  double weights = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const Anchor& a = anchors[near[k].second];
    const double w = 1 / (1 + near[k].first / (kSameFeaturePx * kSameFeaturePx));
    const Eigen::Vector2d d = (a.from_px - x_px) / std::sqrt(reach);
    const Eigen::Vector3d row(1, d.x(), d.y());
    N += w * row * row.transpose();
    right += w * row * (a.to_px - a.from_px).transpose();
    plain += w * (a.to_px - a.from_px);
    weights += w;
  }
  N.diagonal().tail<2>().array() +=
      1e-3 * N.diagonal().tail<2>().sum() + 1e-9 * weights;  // anchors on a line determine nothing across it
  const Eigen::Matrix<double, 3, 2> fit = N.inverse() * right;
  return Move{x_px + fit.row(0).transpose(), 1 / (1 + near[0].first / (kSameFeaturePx * kSameFeaturePx))};
}

PathBefore::PathBefore(const FilmedScene& film, const std::vector<const MatrixKey*>& shown,
                       const std::vector<std::vector<WantedPoint>>& points)
    : film_(film), shown_(shown) {
  if (film.one_centre) return;
  std::vector<Matrix34d> a, b;
  std::vector<std::vector<Eigen::Vector4d>> seen;
  for (std::size_t t = 0; t < shown.size(); ++t) {
    if (!shown[t] || shown[t]->filmed.isZero(0)) continue;
    a.push_back(shown[t]->filmed);
    b.push_back(film.frames[t].P);
    std::vector<Eigen::Vector4d>& X = seen.emplace_back();
    for (const WantedPoint& point : points[t]) X.push_back(point.X);
  }
  map_ = MapBetweenWorlds(a, b, seen);
  if (map_ && map_->rms > kSameWorld) map_.reset();
}

std::optional<Move> PathBefore::Of(std::size_t t, const Eigen::Vector4d& X, const Eigen::Vector2d& filmed_px) const {
  if (!map_ || shown_[t]->filmed.isZero(0)) return Moved(shown_[t]->anchors, filmed_px);
  // Only the difference of the two images is added to the pixel: where the windows put the point in the filmed frame
  // may differ, but it is the same pixel.
  const Eigen::Vector4d X_before = map_->a_from_b * X;
  const auto from = ImageOf(shown_[t]->filmed, X_before), to = ImageOf(shown_[t]->steady, X_before);
  if (!from || !to || (*to - *from).norm() > 1) return std::nullopt;
  return Move{filmed_px + (*to - *from) * film_.px_per_unit(), 1};
}

}  // namespace lumi
