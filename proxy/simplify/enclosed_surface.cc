#include "proxy/simplify/enclosed_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lumi {
namespace {

using Eigen::Vector3d;

constexpr double kCellsPerFace = 1.0;  // of the grid, for faces as many as there are

// Is x within the tetrahedron a b c d, of whatever orientation? Its border counts: what lies on the outer surface is
// passed by any move inwards.
bool IsWithin(const Vector3d& x, const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const auto side = [](const Vector3d& u, const Vector3d& v, const Vector3d& w, const Vector3d& y) {
    return (v - u).cross(w - u).dot(y - u);
  };
  const double whole = side(a, b, c, d);
  if (whole == 0) return false;
  const double sign = whole > 0 ? 1 : -1;
  const double least = -1e-9 * std::abs(whole);
  return sign * side(a, b, c, x) >= least && sign * side(a, d, b, x) >= least && sign * side(b, d, c, x) >= least &&
         sign * side(a, c, d, x) >= least;
}

}  // namespace

EnclosedSurface::EnclosedSurface(std::vector<Vector3d> vertices, std::vector<std::array<std::int32_t, 3>> faces)
    : vertices_(std::move(vertices)), faces_(std::move(faces)), first_cell_(faces_.size()) {
  if (faces_.empty()) {
    first_.assign(2, 0);
    return;
  }
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : vertices_) box.extend(v);
  low_ = box.min();
  // A surface passes through about n^2 cells of a grid of n^3.
  cell_ = std::max(1e-9, box.sizes().maxCoeff() / std::sqrt(kCellsPerFace * static_cast<double>(faces_.size()) / 4));
  for (int a = 0; a < 3; ++a)
    cells_[static_cast<std::size_t>(a)] = static_cast<std::size_t>(box.sizes()[a] / cell_) + 1;
  first_.assign(cells_[0] * cells_[1] * cells_[2] + 1, 0);
  for (const bool count : {true, false}) {
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      Eigen::AlignedBox3d around;
      for (const std::int32_t v : faces_[f]) around.extend(vertices_[static_cast<std::size_t>(v)]);
      const Vector3d from = around.min(), to = around.max();
      for (int a = 0; a < 3; ++a)
        first_cell_[f][static_cast<std::size_t>(a)] = static_cast<std::uint16_t>(CellOf(from[a], a));
      for (std::size_t z = CellOf(from.z(), 2); z <= CellOf(to.z(), 2); ++z)
        for (std::size_t y = CellOf(from.y(), 1); y <= CellOf(to.y(), 1); ++y)
          for (std::size_t x = CellOf(from.x(), 0); x <= CellOf(to.x(), 0); ++x) {
            std::uint32_t& at = first_[(z * cells_[1] + y) * cells_[0] + x];
            if (count)
              ++at;
            else
              face_of_cell_[--at] = static_cast<std::uint32_t>(f);
          }
    }
    if (!count) break;
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    face_of_cell_.resize(first_.back());
  }
}

std::size_t EnclosedSurface::CellOf(double x, int axis) const {
  const double cell = std::floor((x - low_[axis]) / cell_);
  return static_cast<std::size_t>(
      std::clamp(cell, 0.0, static_cast<double>(cells_[static_cast<std::size_t>(axis)] - 1)));
}

std::vector<Vector3d> EnclosedSurface::PointsWithin(std::size_t count, double depth) const {
  // The middles of faces: a vertex's own normal may lead out of a crease.
  std::vector<Vector3d> points;
  const std::size_t every = std::max<std::size_t>(1, faces_.size() / std::max<std::size_t>(1, count));
  for (std::size_t f = 0; f < faces_.size(); f += every) {
    const auto at = [&](std::size_t k) -> const Vector3d& { return vertices_[static_cast<std::size_t>(faces_[f][k])]; };
    const Vector3d area = (at(1) - at(0)).cross(at(2) - at(0));
    const double area2 = area.norm();
    if (area2 > depth * depth) points.emplace_back((at(0) + at(1) + at(2)) / 3 - depth / area2 * area);
  }
  return points;
}

void EnclosedSurface::FindObstacles(const Vector3d& from, const Vector3d& to, const Vector3d& p, const Vector3d& q,
                                    std::vector<Vector3d>& obstacles) const {
  const Vector3d area = (p - to).cross(q - to);
  const double area2 = area.norm();
  if (!(area2 > 0)) return;
  const Vector3d normal = area / area2;
  const Vector3d low = from.cwiseMin(to).cwiseMin(p).cwiseMin(q), high = from.cwiseMax(to).cwiseMax(p).cwiseMax(q);
  // The new face's sides, as planes upright on it, inwards.
  const std::array<Vector3d, 3> corners = {to, p, q};
  std::array<Vector3d, 3> inwards;
  // What lies a little outside the old face is passed too.
  const double move = (from - to).norm();
  const Vector3d before = move > 0 ? Vector3d(from + 10 * kMargin / move * (from - to)) : from;
  for (std::size_t k = 0; k < 3; ++k) inwards[k] = normal.cross(corners[(k + 1) % 3] - corners[k]).normalized();
  const std::array<std::size_t, 3> from_cell = {CellOf(low.x(), 0), CellOf(low.y(), 1), CellOf(low.z(), 2)};
  const std::array<std::size_t, 3> to_cell = {CellOf(high.x(), 0), CellOf(high.y(), 1), CellOf(high.z(), 2)};
  for (std::size_t z = from_cell[2]; z <= to_cell[2]; ++z)
    for (std::size_t y = from_cell[1]; y <= to_cell[1]; ++y)
      for (std::size_t x = from_cell[0]; x <= to_cell[0]; ++x) {
        const std::size_t cell = (z * cells_[1] + y) * cells_[0] + x;
        for (std::uint32_t i = first_[cell]; i < first_[cell + 1]; ++i) {
          const std::uint32_t f = face_of_cell_[i];
          // Each face once: in the first cell that both boxes share.
          if (x != std::max<std::size_t>(from_cell[0], first_cell_[f][0]) ||
              y != std::max<std::size_t>(from_cell[1], first_cell_[f][1]) ||
              z != std::max<std::size_t>(from_cell[2], first_cell_[f][2]))
            continue;
          std::array<Vector3d, 3> t;
          std::array<double, 3> height;
          for (std::size_t k = 0; k < 3; ++k) {
            t[k] = vertices_[static_cast<std::size_t>(faces_[f][k])];
            height[k] = normal.dot(t[k] - p);
          }
          if (std::max({height[0], height[1], height[2]}) <= kTolerance) continue;
          bool passed = false;
          for (std::size_t k = 0; k < 3 && !passed; ++k)
            passed = height[k] > kTolerance && IsWithin(t[k], before, to, p, q);
          if (!passed && std::min({height[0], height[1], height[2]}) < 0) {
            // Where it crosses the new face's plane: a segment, of which a part may be in the face.
            std::array<Vector3d, 2> ends = {Vector3d::Zero(), Vector3d::Zero()};
            std::size_t found = 0;
            for (std::size_t k = 0; k < 3 && found < 2; ++k) {
              const std::size_t l = (k + 1) % 3;
              if ((height[k] < 0) != (height[l] < 0))
                ends[found++] = t[k] + height[k] / (height[k] - height[l]) * (t[l] - t[k]);
            }
            double begin = 0, end = 1;
            for (std::size_t k = 0; k < 3 && found == 2; ++k) {
              // A face that touches the other surface along its own border does not cut through it.
              const double a = inwards[k].dot(ends[0] - corners[k]) - kTolerance,
                           b = inwards[k].dot(ends[1] - corners[k]) - kTolerance;
              if (a < 0 && b < 0)
                end = -1;
              else if (a < 0)
                begin = std::max(begin, a / (a - b));
              else if (b < 0)
                end = std::min(end, a / (a - b));
            }
            passed = found == 2 && begin <= end;
          }
          if (!passed) continue;
          for (std::size_t k = 0; k < 3; ++k)
            if (height[k] > kTolerance) obstacles.push_back(t[k]);
        }
      }
}

}  // namespace lumi
