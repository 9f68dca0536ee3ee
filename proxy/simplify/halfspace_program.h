// A linear program in three variables: the point of an intersection of half spaces that lies farthest along a
// direction, as each collapse of a progressive hull asks for one. Seidel's incremental method (Small-dimensional linear
// programming and convex hulls made easy, 1991): constraints come one by one, and where the best point so far breaks
// one, the new best lies on its plane: the same problem with one dimension less. A dozen constraints take about a
// microsecond; a general solver's set-up alone takes longer.
//
// Where many points are equally good (an edge amid a flat patch), the one nearest to the origin is meant. Both wishes
// are one: of all allowed points, the nearest to a goal far off along the direction. That point is unique, so that
// nothing is ever unbounded and ties do not exist; it is the linear program's own optimum as long as the planes there
// differ by more than 1 / `reach` radians.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace lumi {

// normal . x >= offset, |normal| = 1.
struct HalfSpace {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;
};

// How far a point may break a constraint, in the units of x. Callers scale their problem so that it is about 1 across:
// rounding of planes and of a goal a thousand units away is 1e-13, and a ten-billionth of an edge's length shows in no
// pixel.
inline constexpr double kHalfSpaceTolerance = 1e-10;

// The allowed point nearest to `goal`. nullopt: there is none, or the constraints are so nearly contradictory that
// rounding decides. Deterministic: the order of the constraints is shuffled always in the same way.
std::optional<Eigen::Vector3d> NearestAllowed(const Eigen::Vector3d& goal, std::span<const HalfSpace> constraints);

}  // namespace lumi
