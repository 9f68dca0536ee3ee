#include "proxy/simplify/halfspace_program.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

namespace lumi {
namespace {

// Sines of angles below this are parallel: the point where such planes meet would have lost the digits of the
// tolerance.
constexpr double kParallel = 1e-7;

struct HalfPlane {
  Eigen::Vector2d normal;  // of length 1
  double offset;
};

// The allowed point of the line base + s * along nearest to s = 0.
std::optional<double> OnLine(const Eigen::Vector2d& base, const Eigen::Vector2d& along,
                             std::span<const HalfPlane> constraints) {
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (const HalfPlane& h : constraints) {
    const double slope = h.normal.dot(along), missing = h.offset - h.normal.dot(base);
    if (std::abs(slope) < kParallel) {
      if (missing > kHalfSpaceTolerance) return std::nullopt;
    } else if (slope > 0) {
      low = std::max(low, missing / slope);
    } else {
      high = std::min(high, missing / slope);
    }
  }
  if (low > high) {
    if (low - high > kHalfSpaceTolerance) return std::nullopt;
    return 0.5 * (low + high);
  }
  return std::clamp(0.0, low, high);
}

// The allowed point of the plane nearest to its origin.
std::optional<Eigen::Vector2d> InPlane(std::span<const HalfPlane> constraints) {
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < constraints.size(); ++i) {
    const HalfPlane& h = constraints[i];
    if (h.normal.dot(best) >= h.offset - kHalfSpaceTolerance) continue;
    const Eigen::Vector2d base = h.offset * h.normal, along(-h.normal.y(), h.normal.x());
    const auto s = OnLine(base, along, constraints.first(i));
    if (!s) return std::nullopt;
    best = base + *s * along;
  }
  return best;
}

}  // namespace

std::optional<Eigen::Vector3d> NearestAllowed(const Eigen::Vector3d& goal, std::span<const HalfSpace> constraints) {
  constexpr std::size_t kFew = 64;
  const std::size_t count = constraints.size();
  std::array<HalfSpace, kFew> few_spaces;
  std::array<HalfPlane, kFew> few_planes;
  std::vector<HalfSpace> many_spaces(count > kFew ? count : 0);
  std::vector<HalfPlane> many_planes(count > kFew ? count : 0);
  HalfSpace* const order = count > kFew ? many_spaces.data() : few_spaces.data();
  HalfPlane* const planes = count > kFew ? many_planes.data() : few_planes.data();
  std::uint32_t random = 12345;
  for (std::size_t i = 0; i < count; ++i) {
    random = random * 1664525u + 1013904223u;
    const std::size_t j = (random >> 8) % (i + 1);
    order[i] = order[j];
    order[j] = constraints[i];
  }

  Eigen::Vector3d best = goal;
  for (std::size_t i = 0; i < count; ++i) {
    const HalfSpace& plane = order[i];
    if (plane.normal.dot(best) >= plane.offset - kHalfSpaceTolerance) continue;
    // Coordinates in the plane, its origin the point of it nearest to the goal.
    const Eigen::Vector3d origin = goal + (plane.offset - plane.normal.dot(goal)) * plane.normal;
    const Eigen::Vector3d u = plane.normal.unitOrthogonal(), v = plane.normal.cross(u);
    std::size_t used = 0;
    for (std::size_t j = 0; j < i; ++j) {
      const HalfSpace& other = order[j];
      const Eigen::Vector2d across(other.normal.dot(u), other.normal.dot(v));
      const double length = across.norm(), missing = other.offset - other.normal.dot(origin);
      if (length < kParallel) {
        // Of two planes that face each other one is beyond the other's reach; of two that look the same way the farther
        // counts.
        if (missing > kHalfSpaceTolerance) return std::nullopt;
        continue;
      }
      planes[used++] = {across / length, missing / length};
    }
    const auto y = InPlane({planes, used});
    if (!y) return std::nullopt;
    best = origin + y->x() * u + y->y() * v;
  }
  // Planes that are parallel to seven digits were taken for parallel: far from where they were compared they may not
  // be.
  for (std::size_t i = 0; i < count; ++i)
    if (order[i].normal.dot(best) < order[i].offset - 4 * kHalfSpaceTolerance) return std::nullopt;
  return best;
}

}  // namespace lumi
