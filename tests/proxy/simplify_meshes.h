// Closed bodies as meshes, and what it means that one encloses another.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "scene/geometry/mesh.h"

namespace lumi::test {

inline Mesh MappedVertices(Mesh mesh, const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& map) {
  for (Eigen::Vector3d& v : mesh.vertices) v = map(v);
  return mesh;
}

// The unit cube, n x n squares a side, two triangles each.
inline Mesh SubdividedCube(int n) {
  Mesh mesh;
  std::map<std::array<int, 3>, std::int32_t> names;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [it, is_new] = names.emplace(at, static_cast<std::int32_t>(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(Eigen::Vector3d(at[0], at[1], at[2]) / n);
    return it->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const bool far : {false, true}) {
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int u, int v) {
            std::array<int, 3> x{};
            x[axis] = far ? n : 0;
            x[(axis + 1) % 3] = u;
            x[(axis + 2) % 3] = v;
            return vertex(x);
          };
          const std::int32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
          if (far)
            mesh.faces.insert(mesh.faces.end(), {{a, b, c}, {a, c, d}});
          else
            mesh.faces.insert(mesh.faces.end(), {{a, c, b}, {a, d, c}});
        }
      }
    }
  }
  return mesh;
}

inline Mesh BallMesh(int n) {
  return MappedVertices(SubdividedCube(n),
                        [](const Eigen::Vector3d& x) { return (x - Eigen::Vector3d::Constant(0.5)).normalized(); });
}

// A ring around z: u quads around the axis, v around the tube.
inline Mesh TorusMesh(int u, int v, double ring = 1, double tube = 0.4) {
  Mesh mesh;
  for (int i = 0; i < u; ++i)
    for (int j = 0; j < v; ++j) {
      const double a = 2 * std::numbers::pi * i / u, b = 2 * std::numbers::pi * j / v, r = ring + tube * std::cos(b);
      mesh.vertices.emplace_back(r * std::cos(a), r * std::sin(a), tube * std::sin(b));
    }
  const auto at = [&](int i, int j) { return static_cast<std::int32_t>((i % u) * v + j % v); };
  for (int i = 0; i < u; ++i)
    for (int j = 0; j < v; ++j)
      mesh.faces.insert(mesh.faces.end(),
                        {{at(i, j), at(i + 1, j), at(i + 1, j + 1)}, {at(i, j), at(i + 1, j + 1), at(i, j + 1)}});
  return mesh;
}

// A ball with bumps and hollows: saddles all over.
inline Mesh BumpyBall(int n) {
  return MappedVertices(BallMesh(n), [](const Eigen::Vector3d& x) {
    return Eigen::Vector3d(x * (1 + 0.2 * std::sin(5 * x.x()) * std::sin(4 * x.y() + 1) * std::cos(3 * x.z())));
  });
}

inline Mesh WavySheet(int n) {
  Mesh mesh;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j)
      mesh.vertices.emplace_back(static_cast<double>(i) / n, static_cast<double>(j) / n,
                                 0.1 * std::sin(4.0 * i / n) * std::cos(3.0 * j / n));
  const auto at = [&](int i, int j) { return static_cast<std::int32_t>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      mesh.faces.insert(mesh.faces.end(),
                        {{at(i, j), at(i + 1, j), at(i + 1, j + 1)}, {at(i, j), at(i + 1, j + 1), at(i, j + 1)}});
  return mesh;
}

// How many times a closed surface winds around a point that is not on it (the solid angles of its faces, Van Oosterom
// and Strackee).
inline double WindingNumber(const Mesh& mesh, const Eigen::Vector3d& x) {
  double angle = 0;
  for (const auto& f : mesh.faces) {
    const Eigen::Vector3d a = mesh.vertices[static_cast<std::size_t>(f[0])] - x,
                          b = mesh.vertices[static_cast<std::size_t>(f[1])] - x,
                          c = mesh.vertices[static_cast<std::size_t>(f[2])] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * std::numbers::pi);
}

// Vertices of `inner` that `outer` does not enclose, each drawn inwards by `slack` along its own normal first.
inline std::size_t Escaped(const Mesh& inner, const Mesh& outer, double slack) {
  std::vector<Eigen::Vector3d> normal(inner.vertices.size(), Eigen::Vector3d::Zero());
  for (std::size_t f = 0; f < inner.faces.size(); ++f)
    for (const std::int32_t v : inner.faces[f]) normal[static_cast<std::size_t>(v)] += inner.FaceNormal(f);
  std::size_t escaped = 0;
  for (std::size_t v = 0; v < inner.vertices.size(); ++v)
    escaped += WindingNumber(outer, inner.vertices[v] - slack * normal[v].normalized()) < 0.5 ? 1 : 0;
  return escaped;
}

}  // namespace lumi::test
