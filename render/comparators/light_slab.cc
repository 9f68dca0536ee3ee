#include "render/comparators/light_slab.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "render/comparators/photo_rank.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kWidestLook = 60 * std::numbers::pi / 180;

// Chooses columns and rows, about `cells` grid points in all, so that the points lie nearest to the places. Places that
// form a regular grid give exactly that grid.
void ChooseGrid(const std::vector<Eigen::Vector2d>& places, double cells, CameraGrid& grid) {
  Eigen::Vector2d low = places[0], high = places[0];
  for (const auto& x : places) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const Eigen::Vector2d extent = high - low;
  const double size = std::max(extent.maxCoeff(), 1e-12);
  const int n = std::max(1, static_cast<int>(std::lround(cells)));
  double least = std::numeric_limits<double>::infinity();
  for (int columns = 1; columns <= n; ++columns) {
    const int rows = (n + columns - 1) / columns;
    const Eigen::Vector2d step(columns > 1 ? extent.x() / (columns - 1) : size,
                               rows > 1 ? extent.y() / (rows - 1) : size);
    // A single column (or row) lies in the middle.
    const Eigen::Vector2d first(columns > 1 ? low.x() : low.x() + 0.5 * extent.x(),
                                rows > 1 ? low.y() : low.y() + 0.5 * extent.y());
    if (!(step.minCoeff() > 0)) continue;
    double off = 0;
    for (const auto& x : places) {
      const Eigen::Vector2d g = (x - first).cwiseQuotient(step);
      off += ((g - g.array().round().matrix()).cwiseProduct(step)).squaredNorm();
    }
    if (off < least * (1 - 1e-9)) {
      least = off;
      grid.first = first;
      grid.step = step;
      grid.columns = columns;
      grid.rows = rows;
    }
  }
}

// Adds to `shares` scale times each photo's share at grid position u. Each of the four grid points around u takes the
// mean of the photos' rays under a tent of one cell's size; where these weights sum to less than 1, a grid of twice the
// step fills the rest.
class PushPull {
 public:
  PushPull(const CameraGrid& grid, const std::vector<Eigen::Vector2d>& rays, std::vector<double>& shares)
      : grid_(grid), rays_(rays), shares_(shares) {
    while ((1 << levels_) < 2 * std::max(grid.columns, grid.rows)) ++levels_;
  }

  void Add(const Eigen::Vector2d& u, int level, double scale) {
    if (scale < kNothing) return;
    if (level > levels_) {
      for (double& s : shares_) s += scale / static_cast<double>(shares_.size());
      return;
    }
    const double step = 1 << level;
    const Eigen::Vector2d at = u / step;
    const Eigen::Vector2d corner = at.array().floor();
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2d vertex = corner + Eigen::Vector2d(k & 1, k >> 1);
      const double part = Tent(at.x() - vertex.x()) * Tent(at.y() - vertex.y());
      if (part * scale < kNothing) continue;
      double sum = 0;
      for (const Eigen::Vector2d& r : rays_) sum += Near(r / step - vertex);
      const double own = std::min(1.0, sum);
      if (sum > 0)
        for (std::size_t i = 0; i < rays_.size(); ++i)
          shares_[i] += scale * part * own * Near(rays_[i] / step - vertex) / sum;
      Add(vertex * step, level + 1, scale * part * (1 - own));
    }
  }

 private:
  static constexpr double kNothing = 1e-4;
  static double Tent(double x) { return std::max(0.0, 1 - std::abs(x)); }
  static double Near(const Eigen::Vector2d& d) { return Tent(d.x()) * Tent(d.y()); }

  const CameraGrid& grid_;
  const std::vector<Eigen::Vector2d>& rays_;
  std::vector<double>& shares_;
  int levels_ = 0;
};

}  // namespace

CameraGrid FitCameraGrid(const Sources& sources, double cells, std::string_view method) {
  CameraGrid grid;
  grid.origin = grid.normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const RenderView& v : sources.views) {
    grid.origin += v.centre / static_cast<double>(sources.views.size());
    grid.normal += AxisOf(v);
    right += v.P.row(0).head<3>().transpose() - v.P.row(0).head<3>().dot(AxisOf(v)) * AxisOf(v);
  }
  grid.normal.normalize();
  double widest = 0;
  for (const RenderView& v : sources.views) {
    const Eigen::Vector3d a = AxisOf(v);
    widest = std::max(widest, 2 * std::atan2((a - grid.normal).norm(), (a + grid.normal).norm()));
  }
  if (!(widest <= kWidestLook))
    throw DataError(fmt::format("{}: a camera looks {:.0f} degrees away from the others' mean direction, and one light "
                                "slab holds at most 60",
                                method, widest * 180 / std::numbers::pi),
                    "another --method");
  right -= right.dot(grid.normal) * grid.normal;
  grid.e1 = right.squaredNorm() > 0 ? right.normalized() : grid.normal.unitOrthogonal();
  grid.e2 = grid.normal.cross(grid.e1);
  std::vector<Eigen::Vector2d> places;
  for (const RenderView& v : sources.views) {
    const Eigen::Vector3d d = v.centre - grid.origin;
    places.emplace_back(d.dot(grid.e1), d.dot(grid.e2));
  }
  grid.first.setZero();
  grid.step.setOnes();
  ChooseGrid(places, cells >= 1 ? std::min(cells, 4096.0) : static_cast<double>(places.size()), grid);
  return grid;
}

LightSlab::LightSlab(const CameraGrid& grid, const ViewSetup& setup) : grid_(grid), eye_(setup.desired.centre) {}

Eigen::Vector2d LightSlab::Crossing(const Eigen::Vector3d& from, const Eigen::Vector3d& point) const {
  const Eigen::Vector3d way = point - from;
  const double along = way.dot(grid_.normal);
  // A ray parallel to the plane never crosses it: its start is used instead.
  const double s = std::abs(along) > 1e-9 * way.norm() ? (grid_.origin - eye_ - from).dot(grid_.normal) / along : 0.0;
  const Eigen::Vector3d x = from + s * way - (grid_.origin - eye_);
  return (Eigen::Vector2d(x.dot(grid_.e1), x.dot(grid_.e2)) - grid_.first).cwiseQuotient(grid_.step);
}

void LightSlab::AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const {
  const Eigen::Vector3d p = point.point();
  thread_local std::vector<Eigen::Vector2d> rays;
  thread_local std::vector<double> shares;
  rays.clear();
  for (const std::int32_t j : point.seeing) rays.push_back(Crossing(CentreOf(point.setup, j), p));
  shares.assign(rays.size(), 0.0);
  // Outside the grid the paper draws nothing; here the grid's border is used.
  const Eigen::Vector2d u = Crossing(Eigen::Vector3d::Zero(), p)
                                .cwiseMax(Eigen::Vector2d::Zero())
                                .cwiseMin(Eigen::Vector2d(grid_.columns - 1, grid_.rows - 1));
  PushPull(grid_, rays, shares).Add(u, 0, 1);
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (!(shares[i] > 1e-6)) continue;
    out.camera.push_back(point.seeing[i]);
    out.weight.push_back(static_cast<float>(shares[i]));
  }
}

}  // namespace lumi
