#include "scene/geometry/mesh.h"

#include <Eigen/Geometry>
#include <unordered_map>

namespace lumi {

Eigen::Vector3d Mesh::FaceNormal(std::size_t face) const {
  const auto& f = faces[face];
  const auto v = [&](int i) -> const Eigen::Vector3d& {
    return vertices[static_cast<std::size_t>(f[static_cast<std::size_t>(i)])];
  };
  const Eigen::Vector3d n = (v(1) - v(0)).cross(v(2) - v(0));
  const double length = n.norm();
  return length > 0 ? Eigen::Vector3d(n / length) : Eigen::Vector3d::Zero();
}

std::optional<std::string> Validate(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
    if (!mesh.vertices[i].allFinite()) return "vertex " + std::to_string(i) + " is not a finite number";
  const auto count = static_cast<std::int64_t>(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.faces.size(); ++i)
    for (const std::int32_t v : mesh.faces[i])
      if (v < 0 || v >= count)
        return "face " + std::to_string(i) + " names vertex " + std::to_string(v) + " of " + std::to_string(count);
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.vertices.size()) return "colours are not one a vertex";
  return std::nullopt;
}

bool IsClosed(const Mesh& mesh) {
  // Directed edges: each must appear once, and its opposite once.
  std::unordered_map<std::uint64_t, int> edges;
  edges.reserve(mesh.faces.size() * 3);
  const auto key = [](std::int32_t a, std::int32_t b) {
    return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(a)) << 32) | static_cast<std::uint32_t>(b);
  };
  for (const auto& f : mesh.faces)
    for (std::size_t k = 0; k < 3; ++k)
      if (++edges[key(f[k], f[(k + 1) % 3])] > 1) return false;
  for (const auto& [edge, n] : edges) {
    const auto opposite = edges.find((edge << 32) | (edge >> 32));
    if (opposite == edges.end()) return false;
  }
  return !mesh.faces.empty();
}

void Append(Mesh& mesh, const Mesh& other) {
  const bool colored = (mesh.vertices.empty() || !mesh.colors.empty()) && !other.colors.empty();
  const auto base = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& f : other.faces) mesh.faces.push_back({f[0] + base, f[1] + base, f[2] + base});
  if (colored)
    mesh.colors.insert(mesh.colors.end(), other.colors.begin(), other.colors.end());
  else
    mesh.colors.clear();
}

}  // namespace lumi
