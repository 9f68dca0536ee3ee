#include "proxy/simplify/small_parts.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "proxy/simplify/mesh_topology.h"

namespace lumi {
namespace {

// Of the mean face's area in the photos: the smallest closed surface there is has four faces.
constexpr double kLeastSize = 4;

std::size_t Slot(std::int32_t i) { return static_cast<std::size_t>(i); }

void KeepParts(Mesh& mesh, const std::vector<std::int32_t>& part_of_face, const std::vector<bool>& keep) {
  std::vector<std::int32_t> name(mesh.vertices.size(), -1);
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> faces;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    if (!keep[Slot(part_of_face[f])]) continue;
    std::array<std::int32_t, 3>& face = faces.emplace_back(mesh.faces[f]);
    for (std::int32_t& v : face) {
      std::int32_t& n = name[Slot(v)];
      if (n < 0) {
        n = static_cast<std::int32_t>(vertices.size());
        vertices.push_back(mesh.vertices[Slot(v)]);
      }
      v = n;
    }
  }
  mesh.vertices = std::move(vertices);
  mesh.faces = std::move(faces);
}

}  // namespace

SmallParts RemoveSmallParts(Mesh& mesh, std::size_t faces, const std::vector<double>& scale) {
  const LabelledParts labelled = LabelParts(mesh);
  const std::vector<MeshPart>& parts = labelled.parts;
  std::size_t needed = 0;
  SmallParts result;
  const auto shape = [](const MeshPart& part) { return std::min(part.faces, kFacesPerLeast * part.least_faces); };
  const auto least = [&](const MeshPart& part) { return part.handles > 0 ? shape(part) : part.least_faces; };
  for (const MeshPart& part : parts) {
    needed += shape(part);
    result.least += least(part);
  }
  if (needed <= faces) return result;

  std::vector<double> area_px2(parts.size(), 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Eigen::Vector3d& a = mesh.vertices[Slot(mesh.faces[f][0])];
    const double area =
        (mesh.vertices[Slot(mesh.faces[f][1])] - a).cross(mesh.vertices[Slot(mesh.faces[f][2])] - a).norm();
    area_px2[Slot(labelled.of_face[f])] += scale[f] * scale[f] * area / 2;
  }
  const double px2_a_face = std::accumulate(area_px2.begin(), area_px2.end(), 0.0) / static_cast<double>(faces);
  std::vector<std::size_t> order(parts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return area_px2[i]; });
  std::vector<bool> keep(parts.size(), true);
  for (const std::size_t i : order) {
    const bool large = i == order.back() || area_px2[i] >= kLeastSize * px2_a_face;
    if (large || needed <= faces) break;
    keep[i] = false;
    needed -= shape(parts[i]);
    result.least -= least(parts[i]);
    ++result.removed;
  }
  if (result.removed > 0) KeepParts(mesh, labelled.of_face, keep);
  return result;
}

}  // namespace lumi
