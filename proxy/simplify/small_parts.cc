#include "proxy/simplify/small_parts.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "proxy/simplify/mesh_topology.h"

namespace lumi {
namespace {

// Of a face's even share of the surface in the photos: what the smallest closed surface there is, four faces, is worth.
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

std::size_t RemoveSmallParts(Mesh& mesh, std::size_t faces, const std::vector<double>& scale) {
  const LabelledParts labelled = LabelParts(mesh);
  const std::size_t count = labelled.parts.size();
  std::size_t least = 0;
  for (const MeshPart& part : labelled.parts) least += part.least_faces;
  if (kFacesPerLeast * least <= faces) return 0;

  std::vector<double> area_px2(count, 0);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const Eigen::Vector3d& a = mesh.vertices[Slot(mesh.faces[f][0])];
    const double area =
        (mesh.vertices[Slot(mesh.faces[f][1])] - a).cross(mesh.vertices[Slot(mesh.faces[f][2])] - a).norm();
    area_px2[Slot(labelled.of_face[f])] += scale[f] * scale[f] * area / 2;
  }
  const double px2_a_face = std::accumulate(area_px2.begin(), area_px2.end(), 0.0) / static_cast<double>(faces);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return area_px2[i]; });
  std::vector<bool> keep(count, true);
  std::size_t removed = 0;
  for (const std::size_t i : order) {
    const bool large = i == order.back() || area_px2[i] >= kLeastSize * px2_a_face;
    if (large || kFacesPerLeast * least <= faces) break;
    keep[i] = false;
    least -= labelled.parts[i].least_faces;
    ++removed;
  }
  if (removed > 0) KeepParts(mesh, labelled.of_face, keep);
  return removed;
}

}  // namespace lumi
