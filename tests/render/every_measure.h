// A ray's photos weighed in double, from the measures' own records and nothing else of the renderer: what every path is
// held to.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "scene/model/scene.h"

namespace lumi::test {

// Every measure's own number, for every photo, at random: a few cells each way.
inline void GiveGrids(Scene& scene, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<float> uniform(0.2F, 1.0F);
  for (View& view : scene.views) {
    PhotoGrids grids;
    MeasureList::ForEach([&]<typename M> {
      if constexpr (Estimated<M>) {
        PhotoGrid grid{4, 3, {}};
        for (int i = 0; i < 12; ++i) grid.value.push_back(uniform(engine));
        grids[std::string(M::kName)] = grid;
      }
    });
    view.grids = std::make_shared<const PhotoGrids>(std::move(grids));
  }
}

// One term of h alone beside the angle, so strong that whoever forgets it is far off.
template <Term M>
RadianceSettings OnlyWith(double time_s) {
  RadianceSettings s;
  ForEachTerm([&]<typename Other> { Other::Switch(s, false); });
  M::Switch(s, true);
  s.visibility = false;
  s.prefilter = false;
  s.time_s = time_s;
  s.time_window_s = 0.6;
  s.resolution_low = 0.3;
  s.resolution_high = 3;
  s.r_max_rad = 20 * kRadPerDeg;
  return s;
}

// What measures ask of the place where a point lies for a photo, by its definition.
struct ExactSight {
  double theta_rad, u_px, v_px, w_depth, width_px, height_px, sigma, dt, has_time, number;
  double theta() const { return theta_rad; }
  double u() const { return u_px; }
  double v() const { return v_px; }
  double w() const { return w_depth; }
  double width() const { return width_px; }
  double height() const { return height_px; }
  double stretch() const { return sigma; }
  double dt_s() const { return dt; }
  double timed() const { return has_time; }
  double field() const { return number; }
};

inline double BilinearInGrid(const PhotoGrid& grid, double u01, double v01) {
  const double x = std::clamp(u01 * grid.columns - 0.5, 0.0, grid.columns - 1.0),
               y = std::clamp(v01 * grid.rows - 0.5, 0.0, grid.rows - 1.0);
  double sum = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      sum += std::max(0.0, 1 - std::abs(x - column)) * std::max(0.0, 1 - std::abs(y - row)) *
             static_cast<double>(grid.value[static_cast<std::size_t>(row * grid.columns + column)]);
  return sum;
}

// The largest stretch of a photo's pixel in the view on the plane through p, by finite differences in space.
inline double StretchOnPlane(const RenderView& photo, const RenderView& view, const Eigen::Vector3d& p,
                             const Eigen::Vector3d& normal) {
  const Eigen::Vector3d e1 = normal.unitOrthogonal(), e2 = normal.cross(e1);
  const double step = 1e-5 * (p - view.centre).norm();
  const auto jacobian = [&](const RenderView& v) {
    const auto at = [&](const Eigen::Vector3d& x) { return Eigen::Vector2d((v.P * x.homogeneous()).hnormalized()); };
    Eigen::Matrix2d J;
    J.col(0) = (at(p + step * e1) - at(p - step * e1)) / (2 * step);
    J.col(1) = (at(p + step * e2) - at(p - step * e2)) / (2 * step);
    return J;
  };
  const Eigen::Matrix2d J = jacobian(view) * jacobian(photo).inverse();
  const Eigen::Matrix2d JtJ = J.transpose() * J;
  const double mean = 0.5 * JtJ.trace();
  return std::sqrt(mean + std::sqrt(std::max(0.0, mean * mean - JtJ.determinant())));
}

struct DefinedPhoto {
  double theta = 0, f = 0, value = 0, h = std::numeric_limits<double>::infinity();
};

// `p`: the point, `normal`: of the proxy there; both in the normalised frame, as `sources` and setup.desired are.
template <Term M>
std::vector<DefinedPhoto> Define(const Sources& sources, const ViewSetup& setup, const Eigen::Vector3d& p,
                                 const Eigen::Vector3d& normal) {
  const RadianceSettings& s = setup.settings;
  std::vector<DefinedPhoto> out;
  for (const RenderView& photo : sources.views) {
    DefinedPhoto& d = out.emplace_back();
    const Eigen::Vector3d to_view = (setup.desired.centre - p).normalized(), to_photo = (photo.centre - p).normalized();
    d.theta = std::atan2(to_view.cross(to_photo).norm(), to_view.dot(to_photo));
    const Eigen::Vector3d x = photo.P * p.homogeneous();
    const double width = photo.size_px.x(), height = photo.size_px.y();
    ExactSight at{d.theta, x.x() / x.z(), x.y() / x.z(), x.z(), width, height, 1, 0, photo.time_s ? 1.0 : 0.0, 1};
    const double edge = std::min({at.u_px, width - at.u_px, at.v_px, height - at.v_px});
    if (!(x.z() > 0 && edge >= 0)) continue;
    const double inside = std::min(1.0, edge / (s.fov_feather * std::min(width, height)));
    d.f = 0.5 - 0.5 * std::cos(std::numbers::pi * inside);
    if (photo.time_s) at.dt = *photo.time_s - s.time_s;
    const auto focal = [](const RenderView& v) {
      const Eigen::Matrix3d m = v.P.template leftCols<3>() / v.P.row(2).template head<3>().norm();
      return std::sqrt(std::abs(m.determinant()));
    };
    at.sigma = s.resolution == Resolution::kJacobian ? StretchOnPlane(photo, setup.desired, p, normal)
                                                     : (p - photo.centre).norm() * focal(setup.desired) /
                                                           ((p - setup.desired.centre).norm() * focal(photo));
    if (photo.grids && photo.grids->contains(M::kName))
      at.number = BilinearInGrid(photo.grids->find(M::kName)->second, at.u_px / width, at.v_px / height);
    d.value = M::Value(at, M::ShapeOf(s));
    const double g = s.alpha * d.theta + M::Factor(s) * 2 * s.r_max_rad * std::abs(M::kOwn - d.value);
    if (d.f > 0) d.h = g * (1 + s.gamma * (1 / d.f - 1));
  }
  return out;
}

// Weights of the k nearest, windowed at the k + 1st; empty where too few photos see the point.
inline std::vector<double> DefinedWeights(const std::vector<DefinedPhoto>& photos, int k) {
  std::vector<double> sorted, weight;
  for (const DefinedPhoto& p : photos) sorted.push_back(p.h);
  std::sort(sorted.begin(), sorted.end());
  if (!(sorted[static_cast<std::size_t>(k)] < std::numeric_limits<double>::infinity())) return {};
  double sum = 0;
  for (const DefinedPhoto& p : photos) {
    weight.push_back(std::max(0.0, sorted[0] / p.h - sorted[0] / sorted[static_cast<std::size_t>(k)]));
    sum += weight.back();
  }
  for (double& w : weight) w /= sum;
  return weight;
}

}  // namespace lumi::test
