#include "proxy/hull/contour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr std::size_t kGrain = 2048;
constexpr int kBits = 20;
constexpr double kNearCorner = 0.01;     // of an edge: no vertex is nearer to its end
constexpr double kRootTolerance = 1e-3;  // of an edge
constexpr int kRootSteps = 12;

std::uint64_t Key(const std::array<int, 3>& c) {
  return static_cast<std::uint64_t>(c[0]) | static_cast<std::uint64_t>(c[1]) << kBits |
         static_cast<std::uint64_t>(c[2]) << (2 * kBits);
}

// Key -> number in the order of first insertion. Open addressing; deterministic.
class KeyIndex {
 public:
  explicit KeyIndex(std::size_t expected) { Rehash(std::max<std::size_t>(64, expected * 2)); }
  std::int32_t Insert(std::uint64_t key) {
    if ((keys_.size() + 1) * 2 > slots_.size()) Rehash(slots_.size() * 2);
    std::size_t at = Slot(key);
    while (slots_[at] >= 0) {
      if (keys_[static_cast<std::size_t>(slots_[at])] == key) return slots_[at];
      at = (at + 1) & mask_;
    }
    slots_[at] = static_cast<std::int32_t>(keys_.size());
    keys_.push_back(key);
    return slots_[at];
  }
  std::int32_t Find(std::uint64_t key) const {
    for (std::size_t at = Slot(key); slots_[at] >= 0; at = (at + 1) & mask_)
      if (keys_[static_cast<std::size_t>(slots_[at])] == key) return slots_[at];
    return -1;
  }
  const std::vector<std::uint64_t>& keys() const { return keys_; }

 private:
  std::size_t Slot(std::uint64_t key) const {
    key ^= key >> 31;
    key *= 0x9E3779B97F4A7C15ULL;
    return static_cast<std::size_t>(key ^ key >> 29) & mask_;
  }
  void Rehash(std::size_t wanted) {
    std::size_t size = 64;
    while (size < wanted) size *= 2;
    slots_.assign(size, -1);
    mask_ = size - 1;
    for (std::size_t n = 0; n < keys_.size(); ++n) {
      std::size_t at = Slot(keys_[n]);
      while (slots_[at] >= 0) at = (at + 1) & mask_;
      slots_[at] = static_cast<std::int32_t>(n);
    }
  }
  std::vector<std::uint64_t> keys_;
  std::vector<std::int32_t> slots_;
  std::size_t mask_ = 0;
};

std::array<int, 3> Unkey(std::uint64_t key) {
  constexpr std::uint64_t mask = (1ULL << kBits) - 1;
  return {static_cast<int>(key & mask), static_cast<int>(key >> kBits & mask),
          static_cast<int>(key >> (2 * kBits) & mask)};
}

std::array<int, 3> CubeCorner(const std::array<int, 3>& cube, unsigned c) {
  return {cube[0] + static_cast<int>(c & 1), cube[1] + static_cast<int>(c >> 1 & 1),
          cube[2] + static_cast<int>(c >> 2)};
}

// The least corner of edge e, within its cube.
unsigned EdgeCorner(int e) {
  const auto n = static_cast<unsigned>(e & 3);
  if (e < 4) return n << 1;
  if (e < 8) return (n & 1U) | (n >> 1) << 2;
  return n;
}

// Corners of the cubes, their values, and the cubes that the surface turns out to enter.
struct Sampled {
  KeyIndex cubes, corners;
  std::vector<float> values;
  std::vector<std::int32_t> cube_of;  // a cube that has the corner
  std::size_t given = 0;              // cubes
  std::int32_t Given(std::size_t cube) const { return cube < given ? static_cast<std::int32_t>(cube) : -1; }
  explicit Sampled(std::size_t expected) : cubes(expected), corners(expected * 2) {}
};

void SampleCorners(const GridFrame& grid, const Solid& solid, Sampled& s) {
  const std::size_t before = s.values.size(), after = s.corners.keys().size();
  s.values.resize(after);
  ParallelFor(after - before, kGrain, [&](std::size_t begin, std::size_t end) {
    CheckInterrupted();
    for (std::size_t n = before + begin; n < before + end; ++n) {
      const std::array<int, 3> c = Unkey(s.corners.keys()[n]);
      bool boundary = false;
      for (std::size_t a = 0; a < 3; ++a) boundary = boundary || c[a] <= 0 || c[a] >= grid.cells[a];
      const float value = solid(grid.Corner(c[0], c[1], c[2]), s.Given(static_cast<std::size_t>(s.cube_of[n])));
      s.values[n] = boundary ? std::max(value, 1.0F) : value;
    }
  });
}

unsigned SignsOf(const Sampled& s, const std::array<int, 3>& cube) {
  unsigned inside = 0;
  for (unsigned c = 0; c < 8; ++c) {
    const std::int32_t n = s.corners.Find(Key(CubeCorner(cube, c)));
    if (s.values[static_cast<std::size_t>(n)] < 0) inside |= 1U << c;
  }
  return inside;
}

// Neighbours that the surface enters through a face of a known cube, until there are no more.
void Close(const GridFrame& grid, const Solid& solid, Sampled& s) {
  constexpr unsigned low_side[3] = {0x55, 0x33, 0x0F};  // corners of the face at the axis' low end
  std::size_t done = 0;
  while (done < s.cubes.keys().size()) {
    const std::size_t end = s.cubes.keys().size();
    for (std::size_t n = done; n < end; ++n) {
      const std::array<int, 3> cube = Unkey(s.cubes.keys()[n]);
      for (unsigned c = 0; c < 8; ++c) {
        s.corners.Insert(Key(CubeCorner(cube, c)));
        s.cube_of.resize(s.corners.keys().size(), static_cast<std::int32_t>(n));
      }
    }
    SampleCorners(grid, solid, s);
    for (std::size_t n = done; n < end; ++n) {
      const std::array<int, 3> cube = Unkey(s.cubes.keys()[n]);
      const unsigned inside = SignsOf(s, cube);
      if (inside == 0 || inside == 255) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int side : {0, 1}) {
          const unsigned face = side == 0 ? low_side[axis] : ~low_side[axis] & 255U;
          if ((inside & face) == 0 || (inside & face) == face) continue;
          std::array<int, 3> next = cube;
          next[axis] += side == 0 ? -1 : 1;
          if (next[axis] >= 0 && next[axis] < grid.cells[axis]) s.cubes.Insert(Key(next));
        }
      }
    }
    done = end;
  }
}

// Where between a (value va) and b (vb, of the other sign) the solid ends, as a fraction: Illinois' regula falsi.
double Crossing(const Solid& solid, std::int32_t cube, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double va,
                double vb) {
  double low = 0, high = 1;
  double t = 0.5;
  for (int step = 0; step < kRootSteps && high - low > kRootTolerance; ++step) {
    t = std::abs(vb - va) > 0 ? low + (high - low) * va / (va - vb) : 0.5 * (low + high);
    t = std::clamp(t, low + 0.02 * (high - low), high - 0.02 * (high - low));
    const double v = solid(a + t * (b - a), cube);
    if (v == 0) return t;
    if ((v < 0) == (va < 0)) {
      low = t;
      va = v;
      vb *= 0.5;
    } else {
      high = t;
      vb = v;
      va *= 0.5;
    }
  }
  return t;
}

}  // namespace

Mesh Contour(const GridFrame& grid, const std::vector<std::array<int, 3>>& cubes, const Solid& solid) {
  Sampled s(cubes.size());
  for (const auto& cube : cubes) s.cubes.Insert(Key(cube));
  s.given = s.cubes.keys().size();
  if (s.given != cubes.size()) throw std::invalid_argument("a cube is given twice");
  Close(grid, solid, s);

  Mesh mesh;
  KeyIndex edges(s.cubes.keys().size());
  struct Centre {
    std::int32_t vertex;
    std::array<std::int32_t, 12> of;
    std::size_t count;
  };
  std::vector<Centre> centres;  // their vertices are appended after all others: numbered from -1 downwards until then
  std::vector<std::int32_t> cube_of_edge;
  for (std::size_t n = 0; n < s.cubes.keys().size(); ++n) {
    const std::array<int, 3> cube = Unkey(s.cubes.keys()[n]);
    const unsigned inside = SignsOf(s, cube);
    if (inside == 0 || inside == 255) continue;
    const CubeCase& shape = CaseOf(inside);
    const auto vertex = [&](int e) {
      const auto axis = static_cast<std::uint64_t>(e >> 2);
      return edges.Insert(Key(CubeCorner(cube, EdgeCorner(e))) | axis << (3 * kBits));
    };
    const auto first_centre = static_cast<std::int32_t>(centres.size());
    for (const auto& loop : shape.centres) {
      Centre c{0, {}, loop.size()};
      for (std::size_t i = 0; i < loop.size(); ++i) c.of[i] = vertex(loop[i]);
      centres.push_back(c);
    }
    for (const auto& t : shape.triangles) {
      std::array<std::int32_t, 3> face;
      for (std::size_t i = 0; i < 3; ++i)
        face[i] = t[i] < CubeCase::kCentre ? vertex(t[i]) : -1 - (first_centre + t[i] - CubeCase::kCentre);
      mesh.faces.push_back(face);
    }
    cube_of_edge.resize(edges.keys().size(), s.Given(n));
  }

  const std::size_t on_edges = edges.keys().size();
  mesh.vertices.resize(on_edges + centres.size());
  ParallelEach(on_edges, kGrain, [&](std::size_t n) {
    const std::uint64_t key = edges.keys()[n];
    const auto axis = static_cast<std::size_t>(key >> (3 * kBits));
    const std::array<int, 3> a = Unkey(key);
    std::array<int, 3> b = a;
    ++b[axis];
    const Eigen::Vector3d xa = grid.Corner(a[0], a[1], a[2]), xb = grid.Corner(b[0], b[1], b[2]);
    const double t =
        Crossing(solid, cube_of_edge[n], xa, xb, s.values[static_cast<std::size_t>(s.corners.Find(Key(a)))],
                 s.values[static_cast<std::size_t>(s.corners.Find(Key(b)))]);
    mesh.vertices[n] = xa + std::clamp(t, kNearCorner, 1 - kNearCorner) * (xb - xa);
  });
  for (std::size_t n = 0; n < centres.size(); ++n) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < centres[n].count; ++i)
      mean += mesh.vertices[static_cast<std::size_t>(centres[n].of[i])];
    mesh.vertices[on_edges + n] = mean / static_cast<double>(centres[n].count);
  }
  for (auto& face : mesh.faces) {
    for (std::int32_t& v : face)
      if (v < 0) v = static_cast<std::int32_t>(on_edges) - 1 - v;
  }
  return mesh;
}

}  // namespace lumi
