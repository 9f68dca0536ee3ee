// Heigl, Koch, Pollefeys, Denzler and Van Gool, "Plenoptic Modeling and Rendering from Image Sequences Taken by a
// Hand-held Camera", DAGM 1999: the camera centres are projected into the view and triangulated there; a pixel blends
// the photos of its triangle's corners by its barycentric coordinates. Outside the triangles the paper draws nothing;
// here a pixel takes the weights of the nearest point on their border.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "render/comparators/methods.h"
#include "render/comparators/point_method.h"
#ifndef LUMI_NO_CGAL
#include "render/radiance/sparse/constrained_delaunay.h"
#endif
#include "scene/program/error.h"

namespace lumi {
namespace {

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

class Heigl final : public PointMethod {
 public:
  explicit Heigl(const ViewSetup& setup) : m_(setup.desired.P.leftCols<3>()) {
    std::map<std::pair<double, double>, std::vector<std::int32_t>> at;
    std::vector<Eigen::Vector2d> images;
    for (std::int32_t j = 0; j < setup.sources.count; ++j) {
      if (!(setup.sources.enabled[static_cast<std::size_t>(j)] > 0)) continue;
      const Eigen::Vector3d q = m_ * CentreOf(setup, j);
      // Centres behind the view count, too: their projection is the same line. A centre in the view's principal plane
      // projects to infinity and is left out.
      if (!(std::abs(q.z()) > kAtInfinity * q.norm())) {
        if (q.norm() == 0) own_.push_back(j);
        continue;
      }
      const Eigen::Vector2d x = q.head<2>() / q.z();
      auto& here = at[{x.x(), x.y()}];
      if (here.empty()) images.push_back(x);
      here.push_back(j);
    }
#ifdef LUMI_NO_CGAL
    throw MachineError("heigl-1999 triangulates the cameras with CGAL, which this build is without");
#else
    PlanarTriangulation plane;
    TriangulateConstrained(images, {}, plane);
    if (!plane.triangles.empty()) {
      points_ = plane.points;
      triangles_ = plane.triangles;
      for (std::size_t i = 0; i < triangles_.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
          if (plane.neighbour[i][c] < 0) border_.push_back({triangles_[i][(c + 1) % 3], triangles_[i][(c + 2) % 3]});
    } else {
      points_ = images;  // collinear: segments from each point to the next
      if (points_.size() > 1) {
        Eigen::Vector2d along = Eigen::Vector2d::Zero();
        for (const auto& x : points_)
          if ((x - points_[0]).norm() > along.norm()) along = x - points_[0];
        std::ranges::sort(points_, {}, [&](const Eigen::Vector2d& x) { return along.dot(x); });
      }
      for (std::size_t i = 0; i < points_.size(); ++i)
        border_.push_back(
            {static_cast<std::int32_t>(i), static_cast<std::int32_t>(std::min(i + 1, points_.size() - 1))});
    }
#endif
    for (const auto& x : points_) photos_.push_back(at[{x.x(), x.y()}]);
    for (const auto& t : triangles_) {
      Eigen::AlignedBox2d box;
      for (const auto c : t) box.extend(points_[static_cast<std::size_t>(c)]);
      boxes_.push_back(box);
    }
  }

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const override {
    std::array<std::pair<std::int32_t, double>, 3> corners;
    const std::size_t count = Corners(m_ * point.direction, corners);
    double sum = 0;
    const auto add = [&](std::int32_t j, double weight) {
      if (!std::binary_search(point.seeing.begin(), point.seeing.end(), j)) return;
      out.camera.push_back(j);
      out.weight.push_back(static_cast<float>(weight));
      sum += weight;
    };
    for (const std::int32_t j : own_) add(j, 1);
    if (sum > 0) return;
    for (std::size_t i = 0; i < count; ++i) {
      const auto& here = photos_[static_cast<std::size_t>(corners[i].first)];
      for (const std::int32_t j : here) add(j, corners[i].second / static_cast<double>(here.size()));
    }
    if (sum > 1e-9) return;
    out.camera.assign(1, NearestInAngle(point));
    out.weight.assign(1, 1.0F);
  }

 private:
  static constexpr double kAtInfinity = 1e-9;

  // Writes the corners and weights of a pixel; returns how many.
  std::size_t Corners(const Eigen::Vector3d& q, std::array<std::pair<std::int32_t, double>, 3>& out) const {
    const Eigen::Vector2d x = q.head<2>() / q.z();
    const auto at = [&](std::int32_t i) -> const Eigen::Vector2d& { return points_[static_cast<std::size_t>(i)]; };
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (!boxes_[i].contains(x)) continue;
      const auto& t = triangles_[i];
      const double area = Cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
      if (!(std::abs(area) > 0)) continue;
      const double a = Cross(at(t[1]) - x, at(t[2]) - x) / area, b = Cross(at(t[2]) - x, at(t[0]) - x) / area,
                   c = 1 - a - b;
      if (std::min({a, b, c}) < 0) continue;
      out = {{{t[0], a}, {t[1], b}, {t[2], c}}};
      return 3;
    }
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [from, to] : border_) {
      const Eigen::Vector2d way = at(to) - at(from);
      const double s = way.squaredNorm() > 0 ? std::clamp((x - at(from)).dot(way) / way.squaredNorm(), 0.0, 1.0) : 0;
      const double distance = (at(from) + s * way - x).norm();
      if (!(distance < least)) continue;
      least = distance;
      out[0] = {from, 1 - s};
      out[1] = {to, s};
    }
    return border_.empty() ? 0 : 2;
  }

  Eigen::Matrix3d m_;
  std::vector<std::int32_t> own_;  // photos at the view's own centre
  std::vector<Eigen::Vector2d> points_;
  std::vector<std::vector<std::int32_t>> photos_;  // at each point
  std::vector<std::array<std::int32_t, 3>> triangles_;
  std::vector<Eigen::AlignedBox2d> boxes_;
  std::vector<std::pair<std::int32_t, std::int32_t>> border_;
};

}  // namespace

std::shared_ptr<const RayMethod> MakeHeigl(const Sources&, const ProxyTracer&, const ViewSetup& setup) {
  return std::make_shared<Heigl>(setup);
}

}  // namespace lumi
