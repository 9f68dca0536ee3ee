#include "proxy/simplify/collapsing_surface.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "proxy/simplify/collapse_rules.h"

namespace lumi {

CollapsingSurface::CollapsingSurface(const Mesh& mesh)
    : frame_(mesh),
      faces_(mesh.faces),
      around_(mesh.vertices.size()),
      normal_(faces_.size()),
      area2_(faces_.size()),
      alive_(faces_.size(), true),
      face_count_(faces_.size()) {
  for (const Vector3d& v : mesh.vertices) x_.push_back(frame_.ToLocal(v));
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    for (const VertexIndex v : faces_[f]) around_[Index(v)].push_back(static_cast<FaceIndex>(f));
    UpdatePlane(static_cast<FaceIndex>(f));
  }
}

Mesh CollapsingSurface::Result() const {
  Mesh mesh;
  std::vector<std::int32_t> name(x_.size(), -1);
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (!alive_[f]) continue;
    std::array<std::int32_t, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      std::int32_t& n = name[Index(faces_[f][k])];
      if (n < 0) {
        n = static_cast<std::int32_t>(mesh.vertices.size());
        mesh.vertices.push_back(frame_.ToWorld(x_[Index(faces_[f][k])]));
      }
      face[k] = n;
    }
    mesh.faces.push_back(face);
  }
  return mesh;
}

void CollapsingSurface::UpdatePlane(FaceIndex f) {
  const auto& t = faces_[Index(f)];
  const TriangleShape shape = ShapeOf(At(t[0]), At(t[1]), At(t[2]));
  const bool flat = shape.quality < kDegenerateQuality;
  normal_[Index(f)] = flat ? Vector3d::Zero() : Vector3d(shape.area_vector / shape.area2);
  area2_[Index(f)] = flat ? 0 : shape.area2;
}

bool CollapsingSurface::Linked(VertexIndex a, VertexIndex b) const {
  int common = 0;
  bool thin = false;
  ForEachNeighbour(a, [&](VertexIndex p) {
    ForEachNeighbour(b, [&](VertexIndex q) {
      if (p != q) return;
      ++common;
      thin = thin || around_[Index(p)].size() <= 3;
    });
  });
  const std::size_t valence = around_[Index(a)].size() + around_[Index(b)].size() - 4;
  return common == 2 && !thin && valence >= 3 && valence <= kMostNeighbours;
}

bool CollapsingSurface::FanIsSound(VertexIndex a, VertexIndex b, const Vector3d& x) const {
  double worst_before = 1;
  double worst_after = 1;
  for (const VertexIndex end : {a, b}) {
    for (const FaceIndex f : around_[Index(end)]) {
      const auto& t = faces_[Index(f)];
      const TriangleShape before = ShapeOf(At(t[0]), At(t[1]), At(t[2]));
      worst_before = std::min(worst_before, before.quality);
      if (Has(f, a) && Has(f, b)) continue;
      std::array<Vector3d, 3> corners = {At(t[0]), At(t[1]), At(t[2])};
      for (std::size_t k = 0; k < 3; ++k)
        if (t[k] == end) corners[k] = x;
      const TriangleShape after = ShapeOf(corners[0], corners[1], corners[2]);
      worst_after = std::min(worst_after, after.quality);
      if (area2_[Index(f)] > 0 && after.quality < kDegenerateQuality) return false;
      if (area2_[Index(f)] > 0 && after.area_vector.dot(normal_[Index(f)]) < kLeastTurnCosine * after.area2)
        return false;
    }
  }
  return worst_after >= std::min(kLeastQuality, worst_before);
}

void CollapsingSurface::AddFan(VertexIndex v, VertexIndex other, std::vector<FanSide>& fan, double& size2,
                               double& worst_before) const {
  for (const FaceIndex f : around_[Index(v)]) {
    const auto& t = faces_[Index(f)];
    const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
    worst_before = std::min(worst_before, ShapeOf(At(t[0]), At(t[1]), At(t[2])).quality);
    if (other >= 0 && Has(f, other)) continue;
    const FanSide side{At(t[(k + 1) % 3]), At(t[(k + 2) % 3]), At(v), normal_[Index(f)]};
    size2 = std::max(size2, (side.p - side.apex).squaredNorm());
    fan.push_back(side);
  }
}

void CollapsingSurface::MoveTo(VertexIndex v, const Vector3d& x) {
  x_[Index(v)] = x;
  for (const FaceIndex f : around_[Index(v)]) UpdatePlane(f);
}

std::vector<CollapsingSurface::VertexIndex> CollapsingSurface::Merge(VertexIndex a, VertexIndex b, const Vector3d& x) {
  x_[Index(a)] = x;
  std::vector<VertexIndex> new_neighbours;
  ForEachNeighbour(b, [&](VertexIndex p) {
    bool known = p == a;
    ForEachNeighbour(a, [&](VertexIndex q) { known = known || p == q; });
    if (!known) new_neighbours.push_back(p);
  });
  const std::vector<FaceIndex> of_b = std::move(around_[Index(b)]);
  around_[Index(b)].clear();
  around_[Index(b)].shrink_to_fit();
  for (const FaceIndex f : of_b) {
    if (Has(f, a)) {
      alive_[Index(f)] = false;
      --face_count_;
      for (const VertexIndex v : faces_[Index(f)])
        if (v != b) std::erase(around_[Index(v)], f);
    } else {
      for (VertexIndex& v : faces_[Index(f)])
        if (v == b) v = a;
      around_[Index(a)].push_back(f);
    }
  }
  for (const FaceIndex f : around_[Index(a)]) UpdatePlane(f);
  return new_neighbours;
}

}  // namespace lumi
