// Fine proxies are sampled at their vertices (thesis Examples #4 and #5): the mesh's triangles, cut at the near plane
// and at the view's borders, and split where they are larger than a grid cell. Which edges are split depends on the
// edge alone, and by how much as well, so that neighbours agree: no cracks.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "render/radiance/sparse/hidden.h"
#include "render/radiance/sparse/tessellate.h"

namespace lumi {
namespace {

// Halvings of an edge; the view's diagonal holds 2^13 cells at most.
constexpr int kDeepest = 16;

// Edges that were cut lie on a border up to rounding, and are in the view.
constexpr double kOnBorderPx = 1e-3;
constexpr int kSides = 5;                         // the near plane, and the view's borders
constexpr std::size_t kMostCorners = 3 + kSides;  // of a triangle that each of them cuts

struct Corner {
  Eigen::Vector3d camera;  // M (x - centre): pixels times depth, and depth
  Eigen::Vector3f normal;
  std::int32_t sample = -1;  // in SparseGeometry
};

class MeshCutter {
 public:
  MeshCutter(const ViewSetup& setup, const SparseProxy& proxy, SparseGeometry& out)
      : setup_(setup), proxy_(proxy), size_(setup.desired.size_px.cast<double>()), out_(out) {
    const RadianceSettings& s = setup.settings;
    cell_px_ = {size_.x() / (s.grid_columns - 1), size_.y() / (s.grid_rows - 1)};
    const Eigen::Matrix3d M = setup.desired.P.leftCols<3>();
    corners_.reserve(proxy.vertices().size());
    for (std::size_t v = 0; v < proxy.vertices().size(); ++v)
      corners_.push_back({M * (proxy.vertices()[v] - setup.desired.centre), proxy.vertex_normals()[v], -1});
  }

  void Add(std::size_t face) {
    face_ = proxy_.face_ids()[face];
    const auto& f = proxy_.faces()[face];
    std::array<std::int32_t, kMostCorners> polygon = {f[0], f[1], f[2]}, kept;
    std::size_t n = 3;
    // Cuts at the near plane and at the view's borders: a photo taken from this view would not contain samples outside
    // it.
    for (int side = 0; side < kSides && n >= 3; ++side) {
      std::size_t m = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const std::int32_t a = polygon[i], b = polygon[(i + 1) % n];
        const bool in = Inside(a, side);
        if (in) kept[m++] = a;
        if (in != Inside(b, side)) kept[m++] = in ? Cut(a, b, side) : Cut(b, a, side);
      }
      polygon = kept;
      n = m;
    }
    for (std::size_t i = 2; i < n; ++i) Split({polygon[0], polygon[i - 1], polygon[i]}, 0);
  }

 private:
  const Corner& At(std::int32_t v) const { return corners_[static_cast<std::size_t>(v)]; }
  // How far inside a side of what is seen: the near plane, then left, right, top, bottom. Linear in space.
  double Room(const Eigen::Vector3d& x, int side) const {
    switch (side) {
      case 0: return x.z() - kNearPlane;
      case 1: return x.x();
      case 2: return size_.x() * x.z() - x.x();
      case 3: return x.y();
      default: return size_.y() * x.z() - x.y();
    }
  }
  bool Inside(std::int32_t v, int side) const { return Room(At(v).camera, side) >= 0; }
  static std::uint64_t Key(std::int32_t a, std::int32_t b) {
    return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::min(a, b))) << 32) |
           static_cast<std::uint32_t>(std::max(a, b));
  }

  // Always from the same end: both faces of the edge get the same point.
  std::int32_t Cut(std::int32_t in, std::int32_t out, int side) {
    const auto [at, fresh] =
        cut_[static_cast<std::size_t>(side)].try_emplace(Key(in, out), static_cast<std::int32_t>(corners_.size()));
    if (fresh) {
      const Corner &p = At(in), &q = At(out);
      const double room = Room(p.camera, side), u = room / (room - Room(q.camera, side));
      Corner c{p.camera + u * (q.camera - p.camera), p.normal, -1};
      // On the side to the last digit, so that what comes after agrees.
      if (side == 0) c.camera.z() = kNearPlane;
      if (side == 1) c.camera.x() = 0;
      if (side == 2) c.camera.x() = size_.x() * c.camera.z();
      if (side == 3) c.camera.y() = 0;
      if (side == 4) c.camera.y() = size_.y() * c.camera.z();
      corners_.push_back(c);
    }
    return at->second;
  }

  // Outside the view on one side of it: no part of it is seen.
  bool Outside(const std::array<std::int32_t, 3>& t) const {
    const auto all = [&](auto&& beyond) {
      return beyond(At(t[0]).camera) && beyond(At(t[1]).camera) && beyond(At(t[2]).camera);
    };
    return all([](const auto& x) { return x.x() < 0; }) || all([](const auto& x) { return x.y() < 0; }) ||
           all([&](const auto& x) { return x.x() > size_.x() * x.z(); }) ||
           all([&](const auto& x) { return x.y() > size_.y() * x.z(); });
  }

  // Where an edge is to be halved, as a share of it from a to b in the image; 0: nowhere. Only the part in the view
  // counts.
  double Halving(const Eigen::Vector3d& p, const Eigen::Vector3d& q) const {
    const Eigen::Vector2d a = p.head<2>() / p.z(), d = q.head<2>() / q.z() - a;
    double from = 0, to = 1;
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0) {
        if (a[k] < -kOnBorderPx || a[k] > size_[k] + kOnBorderPx) return 0;
        continue;
      }
      const double low = (-kOnBorderPx - a[k]) / d[k], high = (size_[k] + kOnBorderPx - a[k]) / d[k];
      from = std::max(from, std::min(low, high));
      to = std::min(to, std::max(low, high));
    }
    if (!(from < to)) return 0;
    // A cell's own edges and diagonal pass.
    const double cells = (d.array() / cell_px_.array()).matrix().norm() * (to - from);
    return cells > 1.5 ? (from + to) / 2 : 0;
  }

  // The vertex that halves edge ab, or -1.
  std::int32_t Middle(std::int32_t a, std::int32_t b) {
    const auto [at, fresh] = middle_.try_emplace(Key(a, b), -1);
    if (!fresh) return at->second;
    const Corner &p = At(std::min(a, b)), &q = At(std::max(a, b));
    const double s = Halving(p.camera, q.camera);
    if (!(s > 0 && s < 1)) return -1;
    // Linear in the image: the share in space follows from the depths.
    const double u = s * p.camera.z() / (s * p.camera.z() + (1 - s) * q.camera.z());
    if (!(u > 1e-9 && u < 1 - 1e-9)) return -1;
    const Eigen::Vector3f normal = (1 - static_cast<float>(u)) * p.normal + static_cast<float>(u) * q.normal;
    const Corner c{p.camera + u * (q.camera - p.camera),
                   normal.squaredNorm() > 0 ? Eigen::Vector3f(normal.normalized()) : normal, -1};
    at->second = static_cast<std::int32_t>(corners_.size());
    corners_.push_back(c);
    return at->second;
  }

  void Split(const std::array<std::int32_t, 3>& t, int depth) {
    if (Outside(t)) return;
    std::array<std::int32_t, 3> m{-1, -1, -1};
    int halved = 0;
    if (depth < kDeepest)
      for (std::size_t i = 0; i < 3; ++i)
        if (m[i] = Middle(t[i], t[(i + 1) % 3]); m[i] >= 0) ++halved;
    if (halved == 0) return Emit(t);
    if (halved == 3) {
      for (std::size_t i = 0; i < 3; ++i) Split({t[i], m[i], m[(i + 2) % 3]}, depth + 1);
      return Split({m[0], m[1], m[2]}, depth + 1);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      if (halved == 1 && m[i] >= 0) {
        Split({t[i], m[i], t[k]}, depth + 1);
        return Split({m[i], t[j], t[k]}, depth + 1);
      }
      if (halved == 2 && m[i] < 0) {  // edges jk and ki are halved
        Split({m[k], m[j], t[k]}, depth + 1);
        Split({t[i], t[j], m[j]}, depth + 1);
        return Split({t[i], m[j], m[k]}, depth + 1);
      }
    }
  }

  void Emit(const std::array<std::int32_t, 3>& t) {
    SparseTriangle s;
    for (std::size_t i = 0; i < 3; ++i) {
      Corner& c = corners_[static_cast<std::size_t>(t[i])];
      if (c.sample < 0) {
        c.sample = static_cast<std::int32_t>(out_.x_px.size());
        out_.x_px.push_back((c.camera.head<2>() / c.camera.z()).cast<float>());
        out_.offset.push_back((setup_.ray_from_pixel * c.camera).cast<float>());
        out_.normal.push_back(c.normal);
      }
      s.vertex[i] = c.sample;
    }
    s.face = face_;
    out_.triangles.push_back(s);
  }

  const ViewSetup& setup_;
  const SparseProxy& proxy_;
  const Eigen::Vector2d size_;
  Eigen::Vector2d cell_px_;
  SparseGeometry& out_;
  std::vector<Corner> corners_;
  std::array<std::unordered_map<std::uint64_t, std::int32_t>, kSides> cut_;
  std::unordered_map<std::uint64_t, std::int32_t> middle_;
  std::int32_t face_ = -1;
};

}  // namespace

void TessellateMesh(const ViewSetup& setup, const SparseProxy& proxy, const ForRanges& for_ranges,
                    SparseGeometry& out) {
  MeshCutter cutter(setup, proxy, out);
  for (std::size_t f = 0; f < proxy.faces().size(); ++f) cutter.Add(f);
  DropHidden(setup, for_ranges, out);
}

}  // namespace lumi
