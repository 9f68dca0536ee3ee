// The view cut along grid lines, the projected borders of the proxy's facets, and at epipoles (thesis
// sec. 5.2.1, 5.2.2).
//
// The grid's own lines are constraints, as the thesis advises (a grid's Delaunay triangulation is ambiguous, and
// changes from frame to frame). A constrained triangulation then falls apart into one a cell: cells that nothing
// crosses, nearly all of them, need no triangulation at all, and the others are small and independent of one another.
// Points lie on a lattice of 1/256 pixel, so that what lies on a grid line does so exactly, for both of its cells: no
// T-junctions, no cracks.
#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "render/radiance/sparse/constrained_delaunay.h"
#include "render/radiance/sparse/tessellate.h"

namespace lumi {
namespace {

constexpr double kLattice = 256;
// Relative depth within which two facets over a pixel count as touching: above what the lattice moves a vertex.
constexpr double kTouching = 1e-4;
// A facet whose plane passes this close to the centre of projection (normalised units) is seen as a line.
constexpr double kEdgeOn = 1e-9;

using LatticePoint = Eigen::Matrix<std::int64_t, 2, 1>;  // times kLattice

// A facet in this view.
struct SeenFacet {
  const Facet* facet = nullptr;
  Eigen::Vector3d inverse_depth;     // dot (x_px, y_px, 1)
  double nearest = 0, farthest = 0;  // inverse depths of its corners: largest, smallest
  Eigen::Vector2d low, high;         // its bounds, px
};

struct Cell {
  std::vector<Eigen::Vector2d> points;  // px, beside its corners
  std::vector<std::array<Eigen::Vector2d, 2>> segments;
};

struct LocalTriangle {
  std::array<Eigen::Vector2d, 3> x_px;
  std::int32_t facet;
  bool alone;
};

class Tessellation {
 public:
  Tessellation(const ViewSetup& setup, const SparseProxy& proxy)
      : setup_(setup),
        proxy_(proxy),
        M_(setup.desired.P.leftCols<3>()),
        columns_(setup.settings.grid_columns),
        rows_(setup.settings.grid_rows) {
    const Eigen::Vector2i size = setup.desired.size_px;
    for (int i = 0; i < columns_; ++i) grid_x_.push_back(std::llround(SamplePx(i, columns_, size.x()) * kLattice));
    for (int j = 0; j < rows_; ++j) grid_y_.push_back(std::llround(SamplePx(j, rows_, size.y()) * kLattice));
    cells_.resize(static_cast<std::size_t>(CellCount()));
    Project();
    for (const auto& e : proxy.edges())
      if (wanted_[static_cast<std::size_t>(&e - proxy.edges().data())])
        AddEdge(camera_[static_cast<std::size_t>(e.a)], camera_[static_cast<std::size_t>(e.b)]);
  }

  int CellCount() const { return (columns_ - 1) * (rows_ - 1); }

  void AddEpipoles(std::vector<Eigen::Vector2f>& out) {
    const RelativeSources& s = setup_.sources;
    const Eigen::Vector2i size = setup_.desired.size_px;
    for (std::size_t j = 0; j < static_cast<std::size_t>(s.count); ++j) {
      if (!(s.enabled[j] > 0)) continue;
      // Whatever the sign of w: the ray through the pixel, extended backwards, meets a camera behind.
      const Eigen::Vector3d e = M_ * Eigen::Vector3d(s.dx[j], s.dy[j], s.dz[j]);
      const double w = std::abs(e.z());
      const Eigen::Vector2d x = e.z() < 0 ? Eigen::Vector2d(-e.head<2>()) : Eigen::Vector2d(e.head<2>());
      if (!(w > 0 && x.x() >= 0 && x.y() >= 0 && x.x() <= size.x() * w && x.y() <= size.y() * w)) continue;
      const LatticePoint p = Snap(x / w);
      if (e.z() > 0 && NearestInverseDepth(ToPx(p)) > 1 / e.z()) continue;  // the proxy hides the camera
      AddPoint(p);
      out.push_back(ToPx(p).cast<float>());
    }
  }

  // Thread-safe for distinct cells.
  void Cut(int cell, PlanarTriangulation& scratch, std::vector<LocalTriangle>& out) const {
    const int i = cell % (columns_ - 1), j = cell / (columns_ - 1);
    const Eigen::Vector2d a = Corner(i, j), b = Corner(i + 1, j), c = Corner(i + 1, j + 1), d = Corner(i, j + 1);
    std::vector<std::int32_t> near;
    for (std::size_t f = 0; f < seen_.size(); ++f)
      if ((seen_[f].low.array() <= c.array()).all() && (seen_[f].high.array() >= a.array()).all())
        near.push_back(static_cast<std::int32_t>(f));
    if (near.empty()) return;
    const Cell& own = cells_[static_cast<std::size_t>(cell)];
    std::vector<std::int32_t> facets;
    if (own.segments.empty() && own.points.size() <= 1) {
      Covering((a + c) / 2, near, facets);
      if (facets.empty()) return;
      if (own.points.empty()) {
        // Diagonals run towards the view's middle from all sides: neither flips from frame to frame.
        const bool down = (2 * i + 1 < columns_ - 1) == (2 * j + 1 < rows_ - 1);
        Emit(down ? std::array{a, b, c} : std::array{a, b, d}, facets, out);
        Emit(down ? std::array{a, c, d} : std::array{b, c, d}, facets, out);
      } else {
        const Eigen::Vector2d& p = own.points.front();
        for (const auto& [u, v] : {std::pair(a, b), std::pair(b, c), std::pair(c, d), std::pair(d, a)})
          if (std::abs((v - u).x() * (p - u).y() - (v - u).y() * (p - u).x()) > 0) Emit({u, v, p}, facets, out);
      }
      return;
    }
    std::vector<Eigen::Vector2d> points{a, b, c, d};
    points.insert(points.end(), own.points.begin(), own.points.end());
    TriangulateConstrained(points, own.segments, scratch);
    // Triangles that no constraint separates lie in the same facets: only the largest one of a region is tested.
    const std::size_t n = scratch.triangles.size();
    std::vector<std::int32_t> region(n, -1), stack;
    const auto corner = [&](std::size_t t, std::size_t k) -> const Eigen::Vector2d& {
      return scratch.points[static_cast<std::size_t>(scratch.triangles[t][k])];
    };
    for (std::size_t seed = 0; seed < n; ++seed) {
      if (region[seed] >= 0) continue;
      std::vector<std::size_t> members;
      stack.assign(1, static_cast<std::int32_t>(seed));
      region[seed] = static_cast<std::int32_t>(seed);
      double largest = -1;
      Eigen::Vector2d inner = Eigen::Vector2d::Zero();
      while (!stack.empty()) {
        const auto t = static_cast<std::size_t>(stack.back());
        stack.pop_back();
        members.push_back(t);
        const Eigen::Vector2d u = corner(t, 1) - corner(t, 0), v = corner(t, 2) - corner(t, 0);
        if (const double area = std::abs(u.x() * v.y() - u.y() * v.x()); area > largest) {
          largest = area;
          inner = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3;
        }
        for (const std::int32_t next : scratch.neighbour[t])
          if (next >= 0 && region[static_cast<std::size_t>(next)] < 0) {
            region[static_cast<std::size_t>(next)] = static_cast<std::int32_t>(seed);
            stack.push_back(next);
          }
      }
      Covering(inner, near, facets);
      if (facets.empty()) continue;
      for (const std::size_t t : members) Emit({corner(t, 0), corner(t, 1), corner(t, 2)}, facets, out);
    }
  }

  double Depth(std::int32_t facet, const Eigen::Vector2d& x_px) const {
    return 1 / InverseDepth(seen_[static_cast<std::size_t>(facet)], x_px);
  }
  const Facet& At(std::int32_t facet) const { return *seen_[static_cast<std::size_t>(facet)].facet; }

 private:
  static Eigen::Vector2d ToPx(const LatticePoint& p) { return p.cast<double>() / kLattice; }
  Eigen::Vector2d Corner(int i, int j) const {
    return ToPx({grid_x_[static_cast<std::size_t>(i)], grid_y_[static_cast<std::size_t>(j)]});
  }
  LatticePoint Snap(const Eigen::Vector2d& x_px) const {
    return {std::clamp<std::int64_t>(std::llround(x_px.x() * kLattice), 0, grid_x_.back()),
            std::clamp<std::int64_t>(std::llround(x_px.y() * kLattice), 0, grid_y_.back())};
  }

  // Pixels times depth, and depth, of every vertex; which facets can be seen at all; which edges are theirs.
  void Project() {
    for (const auto& v : proxy_.vertices()) camera_.push_back(M_ * (v - setup_.desired.centre));
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    std::vector<std::pair<std::int32_t, std::int32_t>> edges;
    for (const Facet& facet : proxy_.facets()) {
      SeenFacet seen;
      seen.facet = &facet;
      const double off = facet.offset - facet.normal.dot(setup_.desired.centre);
      if (!(std::abs(off) > kEdgeOn)) continue;
      // n . (z ray) = off.
      seen.inverse_depth = setup_.ray_from_pixel.transpose() * facet.normal / off;
      seen.low.setConstant(kInfinity);
      seen.high.setConstant(-kInfinity);
      double nearest = kInfinity, farthest = 0;
      for (const std::int32_t v : facet.vertices) {
        const Eigen::Vector3d& x = camera_[static_cast<std::size_t>(v)];
        nearest = std::min(nearest, x.z());
        farthest = std::max(farthest, x.z());
        if (x.z() <= kNearPlane) continue;
        seen.low = seen.low.cwiseMin(x.head<2>() / x.z());
        seen.high = seen.high.cwiseMax(x.head<2>() / x.z());
      }
      if (!(farthest > kNearPlane)) continue;
      if (nearest <= kNearPlane) {
        seen.low.setConstant(-kInfinity);
        seen.high.setConstant(kInfinity);
        CutAtNearPlane(facet);
      }
      seen.nearest = 1 / std::max(nearest, kNearPlane);
      seen.farthest = 1 / farthest;
      seen_.push_back(seen);
      for (const auto& [a, b] : facet.border_vertices) edges.emplace_back(std::min(a, b), std::max(a, b));
    }
    std::sort(edges.begin(), edges.end());
    wanted_.resize(proxy_.edges().size());
    for (std::size_t e = 0; e < wanted_.size(); ++e)
      wanted_[e] = std::binary_search(edges.begin(), edges.end(), std::pair(proxy_.edges()[e].a, proxy_.edges()[e].b));
  }

  Eigen::Vector3d AtNearPlane(const Eigen::Vector3d& in_front, const Eigen::Vector3d& behind) const {
    const double s = (in_front.z() - kNearPlane) / (in_front.z() - behind.z());
    Eigen::Vector3d x = in_front + s * (behind - in_front);
    x.z() = kNearPlane;
    return x;
  }

  // Where the near plane cuts a facet, its border goes on: the crossings along that line, in pairs.
  void CutAtNearPlane(const Facet& facet) {
    std::vector<Eigen::Vector3d> crossings;
    for (const auto& [a, b] : facet.border_vertices) {
      const Eigen::Vector3d &p = camera_[static_cast<std::size_t>(a)], &q = camera_[static_cast<std::size_t>(b)];
      if ((p.z() > kNearPlane) != (q.z() > kNearPlane))
        crossings.push_back(p.z() > kNearPlane ? AtNearPlane(p, q) : AtNearPlane(q, p));
    }
    if (crossings.size() < 2) return;
    Eigen::Vector3d along = Eigen::Vector3d::Zero();
    for (const auto& x : crossings)
      if (const Eigen::Vector3d d = x - crossings.front(); d.squaredNorm() > along.squaredNorm()) along = d;
    std::sort(crossings.begin(), crossings.end(),
              [&](const auto& x, const auto& y) { return along.dot(x) < along.dot(y); });
    for (std::size_t i = 0; i + 1 < crossings.size(); ++i) AddEdge(crossings[i], crossings[i + 1]);
  }

  // An edge of a facet, in camera_'s coordinates: cut at the near plane and the view's borders, then at the grid's
  // lines.
  void AddEdge(Eigen::Vector3d p, Eigen::Vector3d q) {
    if (p.z() < kNearPlane && q.z() < kNearPlane) return;
    if (p.z() < kNearPlane) p = AtNearPlane(q, p);
    if (q.z() < kNearPlane) q = AtNearPlane(p, q);
    const Eigen::Vector2d a = p.head<2>() / p.z(), b = q.head<2>() / q.z(), d = b - a;
    const Eigen::Vector2d size = setup_.desired.size_px.cast<double>();
    double from = 0, to = 1;
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0) {
        if (a[k] < 0 || a[k] > size[k]) return;
        continue;
      }
      const double low = -a[k] / d[k], high = (size[k] - a[k]) / d[k];
      from = std::max(from, std::min(low, high));
      to = std::min(to, std::max(low, high));
    }
    if (!(from <= to)) return;
    // From the nearer end each: an end far outside the view keeps no digits.
    AddSegment(Snap(from == 0 ? a : Eigen::Vector2d(a + from * d)), Snap(to == 1 ? b : Eigen::Vector2d(a + to * d)));
  }

  void AddSegment(const LatticePoint& a, const LatticePoint& b) {
    struct Stop {
      double s;
      LatticePoint x;
    };
    std::vector<Stop> stops{{0, a}, {1, b}};
    const LatticePoint d = b - a;
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0) continue;
      const auto& lines = k == 0 ? grid_x_ : grid_y_;
      const auto first = std::upper_bound(lines.begin(), lines.end(), std::min(a[k], b[k]));
      for (auto l = first; l != lines.end() && *l < std::max(a[k], b[k]); ++l) {
        const double s = static_cast<double>(*l - a[k]) / static_cast<double>(d[k]);
        LatticePoint x;
        x[k] = *l;
        x[1 - k] = std::llround(static_cast<double>(a[1 - k]) + s * static_cast<double>(d[1 - k]));
        stops.push_back({s, x});
      }
    }
    std::sort(stops.begin(), stops.end(), [](const Stop& x, const Stop& y) { return x.s < y.s; });
    for (std::size_t i = 0; i + 1 < stops.size(); ++i) {
      const LatticePoint &p = stops[i].x, &q = stops[i + 1].x;
      AddPoint(p);
      if (p == q) continue;
      const auto [column, last_column] = Between(grid_x_, p.x(), q.x());
      const auto [row, last_row] = Between(grid_y_, p.y(), q.y());
      for (int r = row; r <= last_row; ++r)
        for (int c = column; c <= last_column; ++c)
          cells_[static_cast<std::size_t>(r * (columns_ - 1) + c)].segments.push_back({ToPx(p), ToPx(q)});
    }
    AddPoint(b);
  }

  // The cells along one axis that hold both p and q: two where both lie on the line between them.
  static std::pair<int, int> Between(const std::vector<std::int64_t>& lines, std::int64_t p, std::int64_t q) {
    const std::int64_t low = std::min(p, q), high = std::max(p, q);
    const int cells = static_cast<int>(lines.size()) - 1;
    const int first = static_cast<int>(std::lower_bound(lines.begin(), lines.end(), high) - lines.begin()) - 1;
    const int last = static_cast<int>(std::upper_bound(lines.begin(), lines.end(), low) - lines.begin()) - 1;
    return {std::clamp(std::min(first, last), 0, cells - 1), std::clamp(std::max(first, last), 0, cells - 1)};
  }

  // A vertex of every cell it touches, unless it is their corner.
  void AddPoint(const LatticePoint& p) {
    const bool on_x = std::binary_search(grid_x_.begin(), grid_x_.end(), p.x()),
               on_y = std::binary_search(grid_y_.begin(), grid_y_.end(), p.y());
    if (on_x && on_y) return;
    const auto [column, last_column] = Between(grid_x_, p.x(), p.x());
    const auto [row, last_row] = Between(grid_y_, p.y(), p.y());
    for (int r = row; r <= last_row; ++r)
      for (int c = column; c <= last_column; ++c) {
        auto& points = cells_[static_cast<std::size_t>(r * (columns_ - 1) + c)].points;
        const Eigen::Vector2d x = ToPx(p);
        if (std::find(points.begin(), points.end(), x) == points.end()) points.push_back(x);
      }
  }

  // Kept within the facet's own range: next to the horizon of its plane a point moved by the lattice may have any
  // depth.
  static double InverseDepth(const SeenFacet& f, const Eigen::Vector2d& x_px) {
    return std::clamp(f.inverse_depth.dot(x_px.homogeneous()), f.farthest, f.nearest);
  }

  bool Covers(const SeenFacet& f, const Eigen::Vector2d& x_px) const {
    if ((x_px.array() < f.low.array()).any() || (x_px.array() > f.high.array()).any()) return false;
    const double inverse_depth = f.inverse_depth.dot(x_px.homogeneous());
    if (!(inverse_depth > 0 && inverse_depth <= 1 / kNearPlane)) return false;
    return f.facet->Contains(setup_.desired.centre + setup_.ray_from_pixel * x_px.homogeneous() / inverse_depth);
  }

  void Covering(const Eigen::Vector2d& x_px, const std::vector<std::int32_t>& near,
                std::vector<std::int32_t>& out) const {
    out.clear();
    for (const std::int32_t f : near)
      if (Covers(seen_[static_cast<std::size_t>(f)], x_px)) out.push_back(f);
  }

  double NearestInverseDepth(const Eigen::Vector2d& x_px) const {
    double nearest = 0;
    for (const SeenFacet& f : seen_)
      if (Covers(f, x_px)) nearest = std::max(nearest, InverseDepth(f, x_px));
    return nearest;
  }

  // One triangle a facet, less those that another facet hides everywhere.
  void Emit(const std::array<Eigen::Vector2d, 3>& x_px, const std::vector<std::int32_t>& facets,
            std::vector<LocalTriangle>& out) const {
    if (facets.size() == 1) {
      out.push_back({x_px, facets.front(), true});
      return;
    }
    struct Layer {
      std::int32_t facet;
      Eigen::Vector3d inverse_depth;
    };
    std::vector<Layer> layers;
    for (const std::int32_t f : facets) {
      const SeenFacet& s = seen_[static_cast<std::size_t>(f)];
      layers.push_back({f, {InverseDepth(s, x_px[0]), InverseDepth(s, x_px[1]), InverseDepth(s, x_px[2])}});
    }
    std::stable_sort(layers.begin(), layers.end(),
                     [](const Layer& a, const Layer& b) { return a.inverse_depth.sum() > b.inverse_depth.sum(); });
    std::size_t kept = 0;
    for (const Layer& layer : layers) {
      bool hidden = false;
      for (std::size_t i = 0; i < kept && !hidden; ++i)
        hidden = (layers[i].inverse_depth.array() >= (1 - kTouching) * layer.inverse_depth.array()).all();
      if (!hidden) layers[kept++] = Layer(layer);
    }
    for (std::size_t i = 0; i < kept; ++i) out.push_back({x_px, layers[i].facet, kept == 1});
  }

  const ViewSetup& setup_;
  const SparseProxy& proxy_;
  const Eigen::Matrix3d M_;
  const int columns_, rows_;
  std::vector<std::int64_t> grid_x_, grid_y_;
  std::vector<Eigen::Vector3d> camera_;  // M (x - centre) of the proxy's vertices
  std::vector<SeenFacet> seen_;
  std::vector<bool> wanted_;  // of SparseProxy::edges()
  std::vector<Cell> cells_;
};

// (x, y, facet) -> vertex, open addressing.
class VertexTable {
 public:
  explicit VertexTable(std::size_t expected) {
    std::size_t n = 64;
    while (n < 4 * expected) n *= 2;
    slots_.resize(n, {0, 0, -1, -1});
  }
  // The vertex, or a new one's number: `next`.
  std::int32_t Find(const Eigen::Vector2d& x, std::int32_t facet, std::int32_t next) {
    std::uint64_t h = std::bit_cast<std::uint64_t>(x.x()) * 0x9E3779B97F4A7C15U ^
                      std::bit_cast<std::uint64_t>(x.y()) * 0xC2B2AE3D27D4EB4FU ^
                      static_cast<std::uint64_t>(facet) * 0x165667B19E3779F9U;
    h ^= h >> 29;
    h *= 0xBF58476D1CE4E5B9U;
    for (std::size_t i = (h >> 20) & (slots_.size() - 1);; i = (i + 1) & (slots_.size() - 1)) {
      Slot& s = slots_[i];
      if (s.vertex < 0) {
        s = {x.x(), x.y(), facet, next};
        return next;
      }
      if (s.x == x.x() && s.y == x.y() && s.facet == facet) return s.vertex;
    }
  }

 private:
  struct Slot {
    double x, y;
    std::int32_t facet, vertex;
  };
  std::vector<Slot> slots_;
};

}  // namespace

void TessellateFacets(const ViewSetup& setup, const SparseProxy& proxy, const ForRanges& for_ranges,
                      SparseGeometry& out) {
  Tessellation tessellation(setup, proxy);
  if (setup.settings.epipoles) tessellation.AddEpipoles(out.epipoles_px);
  const auto cells = static_cast<std::size_t>(tessellation.CellCount());
  std::vector<std::vector<LocalTriangle>> triangles(cells);
  for_ranges(cells, 16, [&](std::size_t begin, std::size_t end) {
    PlanarTriangulation scratch;
    for (std::size_t c = begin; c < end; ++c) tessellation.Cut(static_cast<int>(c), scratch, triangles[c]);
  });

  std::size_t count = 0;
  for (const auto& t : triangles) count += t.size();
  out.triangles.reserve(count);
  out.first_of_cell.reserve(cells + 1);
  VertexTable table(count);
  std::vector<std::int32_t> facet_of_vertex;
  std::vector<Eigen::Vector2d> x_px;
  for (const auto& cell : triangles) {
    out.first_of_cell.push_back(static_cast<std::int32_t>(out.triangles.size()));
    for (const LocalTriangle& t : cell) {
      SparseTriangle& s = out.triangles.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) {
        s.vertex[i] = table.Find(t.x_px[i], t.facet, static_cast<std::int32_t>(x_px.size()));
        if (static_cast<std::size_t>(s.vertex[i]) < x_px.size()) continue;
        x_px.push_back(t.x_px[i]);
        facet_of_vertex.push_back(t.facet);
      }
      s.face = tessellation.At(t.facet).face;
      s.alone = t.alone;
    }
  }
  out.first_of_cell.push_back(static_cast<std::int32_t>(out.triangles.size()));
  out.x_px.reserve(x_px.size());
  for (std::size_t i = 0; i < x_px.size(); ++i) {
    out.x_px.push_back(x_px[i].cast<float>());
    out.offset.push_back(
        (tessellation.Depth(facet_of_vertex[i], x_px[i]) * (setup.ray_from_pixel * x_px[i].homogeneous()))
            .cast<float>());
    out.normal.push_back(tessellation.At(facet_of_vertex[i]).normal.cast<float>());
  }
}

}  // namespace lumi
