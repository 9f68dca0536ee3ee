#include "proxy/simplify/mesh_topology.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>

#include "scene/geometry/disjoint_sets.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Triangle = std::array<std::int32_t, 3>;

std::size_t At(std::int32_t i) { return static_cast<std::size_t>(i); }

// A face's side, named by its ends in ascending order.
struct Side {
  std::int32_t low, high;
  std::int32_t face;
  bool ascending;
  auto operator<=>(const Side&) const = default;
  bool Meets(const Side& o) const { return low == o.low && high == o.high; }
};

std::vector<Side> SortedSides(const std::vector<Triangle>& faces) {
  std::vector<Side> sides;
  sides.reserve(3 * faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t a = faces[f][k], b = faces[f][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(f), a < b});
    }
  }
  std::ranges::sort(sides);
  return sides;
}

struct SideCount {
  std::size_t borders = 0, crowded = 0, turned = 0;
  bool IsManifold() const { return crowded == 0 && turned == 0; }
};
SideCount CountSides(const std::vector<Triangle>& faces) {
  SideCount count;
  const std::vector<Side> sides = SortedSides(faces);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t j = i;
    while (j < sides.size() && sides[j].Meets(sides[i])) ++j;
    if (j - i == 1) ++count.borders;
    if (j - i > 2) ++count.crowded;
    if (j - i == 2 && sides[i].ascending == sides[i + 1].ascending) ++count.turned;
    i = j;
  }
  return count;
}

std::vector<Triangle> WithoutRepeats(const std::vector<Triangle>& faces) {
  std::vector<Triangle> kept;
  for (const Triangle& f : faces)
    if (f[0] != f[1] && f[1] != f[2] && f[2] != f[0]) kept.push_back(f);
  return kept;
}

}  // namespace

NormalisedFrame::NormalisedFrame(const Mesh& mesh) {
  if (mesh.vertices.empty()) return;
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  const double size = box.sizes().maxCoeff();
  if (!(size > 0)) return;
  int exponent = 0;
  std::frexp(size, &exponent);
  scale_ = std::ldexp(1.0, 1 - exponent);
  const Eigen::Vector3d middle = 0.5 * (box.min() + box.max());
  if (middle.cwiseAbs().maxCoeff() > 4 * size) middle_ = middle;
}

Mesh MakeManifold(const Mesh& mesh, MeshRepair* repair) {
  MeshRepair r;
  std::vector<Triangle> faces = WithoutRepeats(mesh.faces);
  SideCount count = CountSides(faces);
  if (count.borders > 0) {
    // Vertices at one place: of triangles that were written one by one, or of parts that only touch. Merged where that
    // closes gaps and leaves a manifold.
    std::vector<std::int32_t> order(mesh.vertices.size()), first(mesh.vertices.size());
    std::iota(order.begin(), order.end(), 0);
    const auto less = [&](std::int32_t i, std::int32_t j) {
      const Eigen::Vector3d &a = mesh.vertices[At(i)], &b = mesh.vertices[At(j)];
      return a.x() != b.x() ? a.x() < b.x() : a.y() != b.y() ? a.y() < b.y() : a.z() != b.z() ? a.z() < b.z() : i < j;
    };
    std::ranges::sort(order, less);
    for (std::size_t i = 0; i < order.size(); ++i) {
      const bool same = i > 0 && mesh.vertices[At(order[i])] == mesh.vertices[At(order[i - 1])];
      first[At(order[i])] = same ? first[At(order[i - 1])] : order[i];
      r.merged_vertices += same ? 1 : 0;
    }
    std::vector<Triangle> merged = faces;
    for (Triangle& f : merged)
      for (std::int32_t& v : f) v = first[At(v)];
    merged = WithoutRepeats(merged);
    const SideCount after = CountSides(merged);
    if (r.merged_vertices > 0 && after.borders < count.borders &&
        after.crowded + after.turned <= count.crowded + count.turned) {
      faces = std::move(merged);
      count = after;
    } else {
      r.merged_vertices = 0;
    }
  }
  r.dropped_faces = mesh.faces.size() - faces.size();
  if (faces.empty()) throw DataError("the mesh has no face of three different corners");
  if (!count.IsManifold())
    throw DataError(
        fmt::format(
            "the mesh is no surface: {} edges have more than two faces, {} have faces that disagree about the front",
            count.crowded, count.turned),
        "lumi-proxy import mends what can be mended");

  // Corners of faces that share a side at a vertex are one fan; each fan gets a vertex of its own.
  DisjointSets fans(3 * faces.size());
  const auto corner = [&](std::int32_t f, std::int32_t v) {
    const Triangle& t = faces[At(f)];
    return 3 * At(f) + (t[0] == v ? 0u : t[1] == v ? 1u : 2u);
  };
  const std::vector<Side> sides = SortedSides(faces);
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (!sides[i].Meets(sides[i + 1])) continue;
    fans.Join(corner(sides[i].face, sides[i].low), corner(sides[i + 1].face, sides[i].low));
    fans.Join(corner(sides[i].face, sides[i].high), corner(sides[i + 1].face, sides[i].high));
  }
  Mesh out;
  std::vector<std::int32_t> name(3 * faces.size(), -1);
  std::vector<bool> seen(mesh.vertices.size(), false);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    Triangle t;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t fan = fans.Find(3 * f + k), v = At(faces[f][k]);
      if (name[fan] < 0) {
        name[fan] = static_cast<std::int32_t>(out.vertices.size());
        out.vertices.push_back(mesh.vertices[v]);
        r.split_vertices += seen[v] ? 1 : 0;
        seen[v] = true;
      }
      t[k] = name[fan];
    }
    out.faces.push_back(t);
  }
  if (repair != nullptr) *repair = r;
  return out;
}

LabelledParts LabelParts(const Mesh& mesh) {
  DisjointSets sets(mesh.vertices.size());
  for (const Triangle& f : mesh.faces) {
    sets.Join(At(f[0]), At(f[1]));
    sets.Join(At(f[0]), At(f[2]));
  }
  struct Size {
    std::size_t vertices = 0, faces = 0, borders = 0;
  };
  LabelledParts labelled;
  std::vector<Size> sizes;
  std::vector<std::int32_t> label(mesh.vertices.size(), -1);  // of a set, at its least vertex
  labelled.of_face.reserve(mesh.faces.size());
  for (const Triangle& f : mesh.faces) {
    std::int32_t& part = label[sets.Find(At(f[0]))];
    if (part < 0) {
      part = static_cast<std::int32_t>(sizes.size());
      sizes.emplace_back();
    }
    ++sizes[At(part)].faces;
    labelled.of_face.push_back(part);
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    if (const std::int32_t part = label[sets.Find(v)]; part >= 0) ++sizes[At(part)].vertices;
  const std::vector<Side> sides = SortedSides(mesh.faces);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t j = i;
    while (j < sides.size() && sides[j].Meets(sides[i])) ++j;
    if (j - i == 1) ++sizes[At(labelled.of_face[At(sides[i].face)])].borders;
    i = j;
  }
  for (const Size& size : sizes) {
    if (size.borders > 0) {
      labelled.parts.push_back({.closed = false, .faces = size.faces, .handles = 0, .least_faces = 1});
      continue;
    }
    // Euler: vertices - edges + faces = 2 - 2 handles, with 3/2 edges a face.
    const auto euler = static_cast<long>(size.vertices) - static_cast<long>(size.faces / 2);
    const auto handles = static_cast<std::size_t>(std::max(0L, (2 - euler) / 2));
    // Heawood: so few vertices that every two of them share an edge.
    const auto least_vertices =
        static_cast<std::size_t>(std::ceil((7 + std::sqrt(1 + 48.0 * static_cast<double>(handles))) / 2 - 1e-9));
    labelled.parts.push_back({.closed = true,
                              .faces = size.faces,
                              .handles = handles,
                              .least_faces = 2 * (least_vertices + 2 * handles - 2)});
  }
  return labelled;
}

MeshParts CountParts(const Mesh& mesh) {
  MeshParts counted;
  for (const MeshPart& part : LabelParts(mesh).parts) {
    ++counted.parts;
    if (part.closed) ++counted.closed_parts;
    counted.handles += part.handles;
    counted.least_faces += part.least_faces;
  }
  return counted;
}

}  // namespace lumi
