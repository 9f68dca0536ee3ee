#include "proxy/hull/hull_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kZoomCells = 32;  // a side
constexpr int kZooms = 16;
constexpr double kZoomGain = 0.8;  // of the box's diagonal: a smaller gain ends the search

}  // namespace

std::optional<Box> BoundHull(const std::vector<const SilhouetteCone*>& cones, const Box& start, double dilation_px,
                             int misses) {
  Box box = start;
  const auto dilation = static_cast<float>(dilation_px);
  for (int zoom = 0; zoom < kZooms; ++zoom) {
    const Eigen::Vector3d cell = (box.high - box.low) / kZoomCells;
    const double radius = 0.5 * cell.norm();
    constexpr auto kSlice = static_cast<std::size_t>(kZoomCells) * kZoomCells;
    std::vector<std::uint8_t> kept(kSlice * kZoomCells, 0);
    ParallelEach(kept.size(), kSlice, [&](std::size_t n) {
      const Eigen::Vector3d at(static_cast<double>(n % kZoomCells) + 0.5,
                               static_cast<double>(n / kZoomCells % kZoomCells) + 0.5,
                               static_cast<double>(n / kSlice) + 0.5);
      const Eigen::Vector3d x = box.low + at.cwiseProduct(cell);
      int carved = 0;
      for (const SilhouetteCone* c : cones)
        if (c->Bounds(x, radius).low > dilation && ++carved > misses) break;
      kept[n] = carved <= misses ? 1 : 0;
    });
    Eigen::Array3i low = Eigen::Array3i::Constant(kZoomCells), high = Eigen::Array3i::Constant(-1);
    for (std::size_t n = 0; n < kept.size(); ++n) {
      if (kept[n] == 0) continue;
      const Eigen::Array3i at(static_cast<int>(n % kZoomCells), static_cast<int>(n / kZoomCells % kZoomCells),
                              static_cast<int>(n / kSlice));
      low = low.min(at);
      high = high.max(at);
    }
    if (high.x() < 0) return std::nullopt;
    const double before = (box.high - box.low).norm();
    const Eigen::Vector3d corner = box.low;
    box.low = corner + low.cast<double>().matrix().cwiseProduct(cell);
    box.high = corner + (high + 1).cast<double>().matrix().cwiseProduct(cell);
    if ((box.high - box.low).norm() > kZoomGain * before) break;
  }
  return box;
}

std::optional<SurfaceCubes> FindSurfaceCubes(const std::vector<const SilhouetteCone*>& cones, const GridFrame& grid,
                                             double dilation_px, std::size_t most, double* too_many) {
  const int side = std::max({grid.cells[0], grid.cells[1], grid.cells[2]});
  int level = 0;
  while ((1 << level) < side) ++level;
  const auto dilation = static_cast<float>(dilation_px);
  const auto say_too_many = [&](double cubes) {
    if (too_many != nullptr) *too_many = std::max(1.0, cubes / static_cast<double>(most));
  };
  struct Node {
    std::array<int, 3> at;  // least corner, in cubes of the grid
    std::uint32_t parent;   // whose cones it has to ask
  };
  std::vector<Node> nodes{{{0, 0, 0}, 0}};
  std::vector<std::vector<std::uint16_t>> asked(1);
  for (std::size_t c = 0; c < cones.size(); ++c) asked[0].push_back(static_cast<std::uint16_t>(c));
  for (;; --level) {
    const int size = 1 << level;
    const double radius = 0.5 * std::sqrt(3.0) * grid.cell * size;
    std::vector<std::uint8_t> entered(nodes.size(), 0);
    std::vector<std::vector<std::uint16_t>> open(nodes.size());
    ParallelFor(nodes.size(), 512, [&](std::size_t begin, std::size_t end) {
      CheckInterrupted();
      std::vector<std::uint16_t> border;
      for (std::size_t n = begin; n < end; ++n) {
        const std::array<int, 3>& at = nodes[n].at;
        const Eigen::Vector3d x = grid.Corner(at[0], at[1], at[2]) + Eigen::Vector3d::Constant(0.5 * grid.cell * size);
        bool at_boundary = false, carved = false;
        // What touches the grid's boundary, where everything counts as outside, is entered unless it is carved.
        for (std::size_t a = 0; a < 3; ++a) at_boundary = at_boundary || at[a] <= 0 || at[a] + size >= grid.cells[a];
        border.clear();
        for (const std::uint16_t c : asked[nodes[n].parent]) {
          const SilhouetteCone::Range d = cones[c]->Bounds(x, radius);
          carved = d.low > dilation;
          if (carved) break;
          if (!(d.high < dilation)) border.push_back(c);
        }
        if (carved || (border.empty() && !at_boundary)) continue;
        entered[n] = 1;
        open[n] = border;
      }
    });
    if (level == 0) {
      SurfaceCubes result;
      for (std::size_t n = 0; n < nodes.size(); ++n) {
        if (entered[n] == 0) continue;
        result.cubes.push_back(nodes[n].at);
        result.cones.push_back(std::move(open[n]));
      }
      if (result.cubes.size() <= most) return result;
      say_too_many(static_cast<double>(result.cubes.size()));
      return std::nullopt;
    }
    std::vector<Node> next;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (entered[n] == 0) continue;
      const int half = size / 2;
      for (int c = 0; c < 8; ++c) {
        const std::array<int, 3> child{nodes[n].at[0] + (c & 1) * half, nodes[n].at[1] + (c >> 1 & 1) * half,
                                       nodes[n].at[2] + (c >> 2) * half};
        if (child[0] < grid.cells[0] && child[1] < grid.cells[1] && child[2] < grid.cells[2])
          next.push_back({child, static_cast<std::uint32_t>(n)});
      }
    }
    nodes = std::move(next);
    asked = std::move(open);
    if (nodes.empty()) return SurfaceCubes{};
    // The level below has not been asked yet: about half of a cube's eight parts are at the surface.
    if (nodes.size() > 4 * most) {
      say_too_many(0.5 * static_cast<double>(nodes.size()) * std::pow(4.0, level - 1));
      return std::nullopt;
    }
  }
}

}  // namespace lumi
