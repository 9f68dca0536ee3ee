#include "proxy/simplify/deviation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "proxy/mesh_query.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

// Evenly over the area: every so many square units a point, at low-discrepancy places of the face that it falls on.
std::vector<Eigen::Vector3d> PointsOn(const Mesh& mesh, std::size_t samples) {
  std::vector<double> area(mesh.faces.size() + 1, 0);
  const auto corner = [&](std::size_t f, std::size_t k) -> const Eigen::Vector3d& {
    return mesh.vertices[static_cast<std::size_t>(mesh.faces[f][k])];
  };
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    area[f + 1] = area[f] + (corner(f, 1) - corner(f, 0)).cross(corner(f, 2) - corner(f, 0)).norm();
  std::vector<Eigen::Vector3d> points;
  std::size_t f = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const double at = (static_cast<double>(i) + 0.5) / static_cast<double>(samples) * area.back();
    while (f + 1 < mesh.faces.size() && area[f + 1] < at) ++f;
    // The R2 sequence.
    double u = std::fmod(0.5 + 0.7548776662466927 * static_cast<double>(i), 1),
           v = std::fmod(0.5 + 0.5698402909980532 * static_cast<double>(i), 1);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    points.emplace_back(corner(f, 0) + u * (corner(f, 1) - corner(f, 0)) + v * (corner(f, 2) - corner(f, 0)));
  }
  return points;
}

Deviation OneWay(const Mesh& from, const Mesh& to, std::size_t samples) {
  const std::vector<Eigen::Vector3d> points = PointsOn(from, samples);
  const MeshQuery query(to);
  std::vector<double> distance(points.size());
  ParallelEach(points.size(), 256, [&](std::size_t i) { distance[i] = query.Distance(points[i]); });
  Deviation d;
  for (const double x : distance) {
    d.mean += x / static_cast<double>(distance.size());
    d.max = std::max(d.max, x);
  }
  return d;
}

}  // namespace

Deviation MeasureDeviation(const Mesh& a, const Mesh& b, std::size_t samples) {
  const Deviation forth = OneWay(a, b, samples), back = OneWay(b, a, samples);
  return {std::max(forth.mean, back.mean), std::max(forth.max, back.max)};
}

}  // namespace lumi
