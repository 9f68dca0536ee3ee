#include "scene/view_triangulation/lattice_delaunay.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace lumi {
namespace {

__extension__ using Wide = __int128;

struct LatticeTriangle {
  std::array<std::int32_t, 3> vertex{};
  std::array<std::int32_t, 3> neighbor{};  // across the edge opposite each vertex; -1: the rectangle's border
};

// Position along Hilbert's curve of order 16 over [0, 2^16)^2.
std::uint32_t HilbertIndex(std::uint32_t x, std::uint32_t y) {
  std::uint32_t index = 0;
  for (std::uint32_t s = 1U << 15; s > 0; s >>= 1) {
    const std::uint32_t rx = (x & s) != 0, ry = (y & s) != 0;
    index += s * s * ((3 * rx) ^ ry);
    if (ry == 0) {
      if (rx == 1) {
        x = 0xFFFFU - x;
        y = 0xFFFFU - y;
      }
      std::swap(x, y);
    }
  }
  return index;
}

// In rounds of doubling size (Amenta, Choi & Rote 2003), each along Hilbert's curve: walks stay short, and no order of
// the input makes the triangulation slow.
std::vector<std::int32_t> InsertionOrder(std::span<const LatticePoint> points) {
  const std::int32_t extent = std::max(points[2].x, points[2].y);
  const int shift = std::max(0, static_cast<int>(std::bit_width(static_cast<std::uint32_t>(extent))) - 16);
  struct Key {
    std::uint64_t key;
    std::int32_t point;
  };
  std::vector<Key> keys;
  keys.reserve(points.size());
  for (std::size_t i = 4; i < points.size(); ++i) {
    std::uint64_t hash = (i + 1) * 0x9e3779b97f4a7c15ULL;
    hash ^= hash >> 29;
    const auto round =
        31U - static_cast<std::uint32_t>(std::min(31, std::countr_zero(hash * 0xbf58476d1ce4e5b9ULL >> 20)));
    const std::uint32_t along = HilbertIndex(static_cast<std::uint32_t>(points[i].x) >> shift,
                                             static_cast<std::uint32_t>(points[i].y) >> shift);
    keys.push_back({static_cast<std::uint64_t>(round) << 32 | along, static_cast<std::int32_t>(i)});
  }
  std::sort(keys.begin(), keys.end(),
            [](const Key& a, const Key& b) { return a.key != b.key ? a.key < b.key : a.point < b.point; });
  std::vector<std::int32_t> order;
  order.reserve(keys.size());
  for (const Key& k : keys) order.push_back(k.point);
  return order;
}

class LatticeMesh {
 public:
  explicit LatticeMesh(std::span<const LatticePoint> points)
      : points_(points), starts_at_(points.size(), -1), ends_at_(points.size(), -1) {
    triangles_.reserve(2 * points.size() + 2);
    triangles_.push_back({{0, 1, 2}, {-1, 1, -1}});
    triangles_.push_back({{0, 2, 3}, {-1, -1, 0}});
    mark_.assign(2, 0);
  }

  void Insert(std::int32_t p) {
    const LatticePoint& x = At(p);
    const std::int32_t home = Locate(x);
    for (const std::int32_t v : triangles_[Slot(home)].vertex)
      if (At(v) == x) return;
    FindCavity(home, x);
    // A fan of the point over the cavity's border. An edge that holds the point is the rectangle's: no triangle there.
    std::size_t reused = 0;
    fan_.clear();
    for (const BorderEdge& e : border_) {
      if (TurnOf(At(e.a), At(e.b), x) == 0) continue;
      std::int32_t t = 0;
      if (reused < cavity_.size()) {
        t = cavity_[reused++];
      } else {
        t = static_cast<std::int32_t>(triangles_.size());
        triangles_.emplace_back();
        mark_.push_back(0);
      }
      triangles_[Slot(t)] = {{e.a, e.b, p}, {-1, -1, e.outside}};
      if (e.outside >= 0) triangles_[Slot(e.outside)].neighbor[e.outside_edge] = t;
      starts_at_[Slot(e.a)] = t;
      ends_at_[Slot(e.b)] = t;
      fan_.push_back(t);
    }
    for (const std::int32_t t : fan_) {
      LatticeTriangle& fresh = triangles_[Slot(t)];
      fresh.neighbor[0] = starts_at_[Slot(fresh.vertex[1])];
      fresh.neighbor[1] = ends_at_[Slot(fresh.vertex[0])];
    }
    for (const BorderEdge& e : border_) starts_at_[Slot(e.a)] = ends_at_[Slot(e.b)] = -1;
    last_ = fan_.front();
  }

  std::vector<std::array<std::int32_t, 3>> Triangles() const {
    std::vector<std::array<std::int32_t, 3>> out;
    out.reserve(triangles_.size());
    for (const LatticeTriangle& t : triangles_) out.push_back(t.vertex);
    return out;
  }

 private:
  struct BorderEdge {
    std::int32_t a, b;         // the cavity lies to the positive side
    std::int32_t outside;      // the triangle across, or -1
    std::size_t outside_edge;  // there
  };
  static std::size_t Slot(std::int32_t i) { return static_cast<std::size_t>(i); }
  const LatticePoint& At(std::int32_t v) const { return points_[Slot(v)]; }

  // A triangle that holds x, its border included: from triangle to triangle across an edge that has x beyond it. Ends,
  // as the triangulation is Delaunay's and the predicates are exact.
  std::int32_t Locate(const LatticePoint& x) const {
    std::int32_t t = last_;
    for (;;) {
      const LatticeTriangle& here = triangles_[Slot(t)];
      std::size_t edge = 0;
      while (edge < 3 && TurnOf(At(here.vertex[(edge + 1) % 3]), At(here.vertex[(edge + 2) % 3]), x) >= 0) ++edge;
      if (edge == 3) return t;
      t = here.neighbor[edge];
      if (t < 0) throw std::invalid_argument("TriangulateLattice: a point outside the rectangle");
    }
  }

  // The triangles whose circles hold x, and the edges around them.
  void FindCavity(std::int32_t home, const LatticePoint& x) {
    ++round_;
    cavity_.assign(1, home);
    border_.clear();
    mark_[Slot(home)] = round_;
    for (std::size_t next = 0; next < cavity_.size(); ++next) {
      const std::int32_t t = cavity_[next];
      for (std::size_t edge = 0; edge < 3; ++edge) {
        const std::int32_t n = triangles_[Slot(t)].neighbor[edge];
        const std::int32_t a = triangles_[Slot(t)].vertex[(edge + 1) % 3],
                           b = triangles_[Slot(t)].vertex[(edge + 2) % 3];
        if (n < 0) {
          border_.push_back({a, b, -1, 0});
          continue;
        }
        if (mark_[Slot(n)] == round_) continue;
        const LatticeTriangle& other = triangles_[Slot(n)];
        if (InCircle(At(other.vertex[0]), At(other.vertex[1]), At(other.vertex[2]), x) > 0) {
          mark_[Slot(n)] = round_;
          cavity_.push_back(n);
          continue;
        }
        std::size_t back = 0;
        while (other.neighbor[back] != t) ++back;
        border_.push_back({a, b, n, back});
      }
    }
  }

  std::span<const LatticePoint> points_;
  std::vector<LatticeTriangle> triangles_;
  std::vector<std::int32_t> mark_;
  std::vector<std::int32_t> starts_at_, ends_at_;  // of the fan being made: by its edge's first and second vertex
  std::vector<std::int32_t> cavity_, fan_;
  std::vector<BorderEdge> border_;
  std::int32_t round_ = 0, last_ = 0;
};

}  // namespace

std::int64_t TurnOf(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  const std::int64_t ux = std::int64_t{b.x} - a.x, uy = std::int64_t{b.y} - a.y, vx = std::int64_t{c.x} - a.x,
                     vy = std::int64_t{c.y} - a.y;
  return ux * vy - uy * vx;
}

int InCircle(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c, const LatticePoint& d) {
  const std::int64_t ax = std::int64_t{a.x} - d.x, ay = std::int64_t{a.y} - d.y, bx = std::int64_t{b.x} - d.x,
                     by = std::int64_t{b.y} - d.y, cx = std::int64_t{c.x} - d.x, cy = std::int64_t{c.y} - d.y;
  const std::int64_t bc = bx * cy - by * cx, ca = cx * ay - cy * ax, ab = ax * by - ay * bx;
  const std::int64_t aa = ax * ax + ay * ay, bb = bx * bx + by * by, cc = cx * cx + cy * cy;
  // In doubles first. Each product is of two rounded factors and rounded itself, and two sums are rounded: 8 units are
  // ample.
  const double pa = static_cast<double>(aa) * static_cast<double>(bc),
               pb = static_cast<double>(bb) * static_cast<double>(ca),
               pc = static_cast<double>(cc) * static_cast<double>(ab);
  const double sum = pa + pb + pc, bound = 8 * 0x1p-53 * (std::abs(pa) + std::abs(pb) + std::abs(pc));
  if (sum > bound) return 1;
  if (sum < -bound) return -1;
  const Wide exact = static_cast<Wide>(aa) * bc + static_cast<Wide>(bb) * ca + static_cast<Wide>(cc) * ab;
  return exact > 0 ? 1 : exact < 0 ? -1 : 0;
}

std::vector<std::array<std::int32_t, 3>> TriangulateLattice(std::span<const LatticePoint> points) {
  if (points.size() < 4) throw std::invalid_argument("TriangulateLattice: the rectangle's four corners come first");
  const std::int32_t w = points[2].x, h = points[2].y;
  if (w < 1 || h < 1 || w > kMaxLattice || h > kMaxLattice || points[0] != LatticePoint{0, 0} ||
      points[1] != LatticePoint{w, 0} || points[3] != LatticePoint{0, h})
    throw std::invalid_argument("TriangulateLattice: the first four points are no rectangle's corners");
  for (const LatticePoint& p : points)
    if (p.x < 0 || p.y < 0 || p.x > w || p.y > h)
      throw std::invalid_argument("TriangulateLattice: a point outside the rectangle");
  LatticeMesh mesh(points);
  for (const std::int32_t p : InsertionOrder(points)) mesh.Insert(p);
  return mesh.Triangles();
}

}  // namespace lumi
