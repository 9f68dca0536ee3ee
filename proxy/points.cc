#include "proxy/points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "scene/geometry/angle.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {

std::vector<ProxyView> MakeProxyViews(const Scene& scene) {
  RequireMetric(scene, "a proxy");
  if (scene.views.empty()) throw DataError("the scene has no views", "reconstruct it from more photos");
  std::vector<ProxyView> views;
  views.reserve(scene.views.size());
  for (const View& view : scene.views) {
    ProxyView v;
    v.render = MakeRenderView(scene, view);
    v.focal_px = scene.CameraOf(view).FocalPx().mean();
    v.forward = view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    views.push_back(v);
  }
  return views;
}

PointSelection SelectPoints(const Scene& scene, const std::vector<ProxyView>& views,
                            const PointSelectionOptions& options) {
  PointSelection selection;
  selection.total = scene.points.size();
  std::vector<ProxyPoint> candidates;
  candidates.reserve(scene.points.size());
  const double min_angle_rad = options.min_angle_deg * kRadPerDeg;
  std::size_t long_tracks = 0;
  for (const Point& point : scene.points) {
    const Eigen::Vector3d& x = point.x_in_world;
    if (!x.allFinite()) {
      ++selection.unusable;
      continue;
    }
    ProxyPoint p;
    p.x_in_world = x;
    for (const Observation& observation : point.track) {
      const auto v = static_cast<std::size_t>(observation.view.value);
      if (observation.view.value < 0 || v >= views.size() || !(views[v].DepthOf(x) > 0)) continue;
      p.views.push_back(observation.view.value);
    }
    std::ranges::sort(p.views);
    p.views.erase(std::unique(p.views.begin(), p.views.end()), p.views.end());
    if (p.views.size() < 2) {
      ++selection.unusable;
      continue;
    }
    double max_angle_rad = 0;
    p.footprint = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < p.views.size(); ++i) {
      const ProxyView& a = views[static_cast<std::size_t>(p.views[i])];
      p.footprint = std::min(p.footprint, a.DepthOf(x) / a.focal_px);
      for (std::size_t j = i + 1; j < p.views.size(); ++j) {
        const ProxyView& b = views[static_cast<std::size_t>(p.views[j])];
        max_angle_rad = std::max(max_angle_rad, AngleBetween(a.render.centre - x, b.render.centre - x));
      }
    }
    if (!(max_angle_rad >= min_angle_rad) || !(point.error_px <= options.max_error_px)) {
      ++selection.inaccurate;
      continue;
    }
    p.sigma = p.footprint * std::max(point.error_px, 0.5) / std::sin(std::min(max_angle_rad, 90 * kRadPerDeg));
    if (p.views.size() >= static_cast<std::size_t>(options.min_track)) ++long_tracks;
    candidates.push_back(std::move(p));
  }
  if (long_tracks >= static_cast<std::size_t>(options.enough_points)) {
    selection.inaccurate += std::erase_if(
        candidates, [&](const ProxyPoint& p) { return p.views.size() < static_cast<std::size_t>(options.min_track); });
  }

  // A point far from all others, measured in its own depth, is a mismatch that passed the other tests.
  if (candidates.size() > static_cast<std::size_t>(options.neighbours) + 1) {
    std::vector<Eigen::Vector3d> positions;
    for (const ProxyPoint& p : candidates) positions.push_back(p.x_in_world);
    std::vector<double> ratio = MeanNeighbourDistance(positions, options.neighbours);
    for (std::size_t i = 0; i < ratio.size(); ++i) ratio[i] /= candidates[i].footprint;
    const double limit = options.max_neighbour_ratio * Quantile(ratio, 0.5);
    std::vector<ProxyPoint> kept;
    kept.reserve(candidates.size());
    for (std::size_t i = 0; i < candidates.size(); ++i)
      if (limit > 0 && ratio[i] > limit)
        ++selection.isolated;
      else
        kept.push_back(std::move(candidates[i]));
    candidates = std::move(kept);
  }
  selection.points = std::move(candidates);
  return selection;
}

namespace {

// Accepted points by cell of a grid whose cells are as large as a power of two that is at least the merging radius.
struct GridKey {
  std::array<std::int64_t, 4> v;  // level, i, j, k
  bool operator==(const GridKey&) const = default;
};
struct GridHash {
  std::size_t operator()(const GridKey& key) const {
    std::uint64_t h = 0x9e3779b97f4a7c15ull;
    for (const std::int64_t x : key.v) {
      h ^= static_cast<std::uint64_t>(x);
      h *= 0xff51afd7ed558ccdull;
      h ^= h >> 32;
    }
    return static_cast<std::size_t>(h);
  }
};

}  // namespace

std::vector<ProxyPoint> MergePoints(const std::vector<ProxyPoint>& points, double distance) {
  std::vector<std::int32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](std::int32_t a, std::int32_t b) {
    const ProxyPoint& p = points[static_cast<std::size_t>(a)];
    const ProxyPoint& q = points[static_cast<std::size_t>(b)];
    return p.views.size() != q.views.size() ? p.views.size() > q.views.size() : p.sigma < q.sigma;
  });
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  if (!points.empty()) origin = points.front().x_in_world;

  std::vector<ProxyPoint> merged;
  std::unordered_map<GridKey, std::vector<std::int32_t>, GridHash> grid;
  const auto level_of = [](double r) { return static_cast<std::int64_t>(std::ceil(std::log2(r))); };
  const auto key_of = [&](const Eigen::Vector3d& x, std::int64_t level) {
    const double size = std::exp2(static_cast<double>(level));
    const Eigen::Array3d cell = ((x - origin) / size).array().floor();
    return GridKey{{level, static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()),
                    static_cast<std::int64_t>(cell.z())}};
  };
  for (const std::int32_t i : order) {
    const ProxyPoint& p = points[static_cast<std::size_t>(i)];
    // Coincident points merge at any distance setting: a vertex of the triangulation is one point.
    const double r = std::max(distance * p.footprint, 1e-12 * (p.x_in_world - origin).norm() + 1e-300);
    const std::int64_t level = level_of(r);
    std::int32_t nearest = -1;
    double nearest_distance = r;
    // Points accepted with a footprint up to twice finer or coarser lie one level down or up.
    for (std::int64_t l = level - 1; l <= level + 1; ++l) {
      const auto low = key_of(p.x_in_world.array() - r, l);
      const auto high = key_of(p.x_in_world.array() + r, l);
      for (std::int64_t a = low.v[1]; a <= high.v[1]; ++a) {
        for (std::int64_t b = low.v[2]; b <= high.v[2]; ++b) {
          for (std::int64_t c = low.v[3]; c <= high.v[3]; ++c) {
            const auto cell = grid.find(GridKey{{l, a, b, c}});
            if (cell == grid.end()) continue;
            for (const std::int32_t m : cell->second) {
              const double d = (merged[static_cast<std::size_t>(m)].x_in_world - p.x_in_world).norm();
              if (d < nearest_distance || (d == nearest_distance && nearest < 0)) {
                nearest = m;
                nearest_distance = d;
              }
            }
          }
        }
      }
    }
    if (nearest >= 0) {
      ProxyPoint& keeper = merged[static_cast<std::size_t>(nearest)];
      std::vector<std::int32_t> views;
      std::set_union(keeper.views.begin(), keeper.views.end(), p.views.begin(), p.views.end(),
                     std::back_inserter(views));
      keeper.views = std::move(views);
    } else {
      grid[key_of(p.x_in_world, level)].push_back(static_cast<std::int32_t>(merged.size()));
      merged.push_back(p);
    }
  }
  return merged;
}

namespace {

// A balanced kd-tree over positions, stored as a permutation: the median of each range is its node.
class KdTree {
 public:
  explicit KdTree(const std::vector<Eigen::Vector3d>& points) : points_(points), order_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    axis_.resize(points.size());
    Build(0, order_.size());
  }
  // Ascending squared distances to the k nearest points other than `self`.
  void Nearest(std::int32_t self, std::size_t k, std::vector<double>& squared) const {
    squared.clear();
    Search(0, order_.size(), self, k, squared);
  }

 private:
  void Build(std::size_t begin, std::size_t end) {
    if (begin >= end) return;
    Eigen::AlignedBox3d box;
    for (std::size_t i = begin; i < end; ++i) box.extend(points_[static_cast<std::size_t>(order_[i])]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + static_cast<std::ptrdiff_t>(begin),
                     order_.begin() + static_cast<std::ptrdiff_t>(middle),
                     order_.begin() + static_cast<std::ptrdiff_t>(end), [&](std::int32_t a, std::int32_t b) {
                       const double xa = points_[static_cast<std::size_t>(a)][axis];
                       const double xb = points_[static_cast<std::size_t>(b)][axis];
                       return xa != xb ? xa < xb : a < b;
                     });
    axis_[middle] = static_cast<std::uint8_t>(axis);
    Build(begin, middle);
    Build(middle + 1, end);
  }
  void Search(std::size_t begin, std::size_t end, std::int32_t self, std::size_t k,
              std::vector<double>& squared) const {
    if (begin >= end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const std::int32_t node = order_[middle];
    const Eigen::Vector3d& x = points_[static_cast<std::size_t>(self)];
    const Eigen::Vector3d& y = points_[static_cast<std::size_t>(node)];
    if (node != self) {
      const double d = (x - y).squaredNorm();
      if (squared.size() < k || d < squared.back()) {
        squared.insert(std::ranges::upper_bound(squared, d), d);
        if (squared.size() > k) squared.pop_back();
      }
    }
    const double offset = x[axis_[middle]] - y[axis_[middle]];
    const bool left_first = offset < 0;
    if (left_first)
      Search(begin, middle, self, k, squared);
    else
      Search(middle + 1, end, self, k, squared);
    if (squared.size() < k || offset * offset <= squared.back()) {
      if (left_first)
        Search(middle + 1, end, self, k, squared);
      else
        Search(begin, middle, self, k, squared);
    }
  }
  const std::vector<Eigen::Vector3d>& points_;
  std::vector<std::int32_t> order_;
  std::vector<std::uint8_t> axis_;
};

}  // namespace

std::vector<double> MeanNeighbourDistance(const std::vector<Eigen::Vector3d>& points, int k) {
  std::vector<double> mean(points.size(), 0.0);
  if (points.size() < 2 || k < 1) return mean;
  const KdTree tree(points);
  ParallelFor(points.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<double> squared;
    for (std::size_t i = begin; i < end; ++i) {
      tree.Nearest(static_cast<std::int32_t>(i), static_cast<std::size_t>(k), squared);
      double sum = 0;
      for (const double d : squared) sum += std::sqrt(d);
      mean[i] = squared.empty() ? 0 : sum / static_cast<double>(squared.size());
    }
  });
  return mean;
}

}  // namespace lumi
