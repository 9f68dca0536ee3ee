// Scenes whose shape is known: points on planes, seen by cameras that look freely at them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "scene/model/scene.h"

namespace lumi::test {

// A rectangle: centre, half edges. Blocks lines of sight.
struct Rectangle {
  Eigen::Vector3d centre, a, b;
  // Where the segment from `eye` to `x` meets it, as a fraction in (0, 1), or 2.
  double Meets(const Eigen::Vector3d& eye, const Eigen::Vector3d& x) const;
};

class SceneBuilder {
 public:
  explicit SceneBuilder(std::uint64_t seed) : state_(seed) {}
  // Pinhole 640x480, 500 px focal length.
  void AddCamera(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);
  // `count` points spread over it.
  void AddSurface(const Rectangle& rectangle, int count);
  void AddPoint(const Eigen::Vector3d& x);
  // Tracks: every view that has the point in its picture, with no rectangle before it. Points seen by fewer than two
  // views are left out.
  Scene Build();
  double Random();  // [0, 1)

 private:
  std::uint64_t state_;
  Scene scene_;
  std::vector<Rectangle> rectangles_;
  std::vector<Eigen::Vector3d> points_;
};

// A room 4 x 4 x 3 around the origin, six walls of points, cameras on a ring inside that look at the walls.
Scene BoxRoom(int points_a_wall, std::uint64_t seed);
double DistanceToBoxRoom(const Eigen::Vector3d& x);

// A wall at z = 4 (8 x 6) and a plate at z = 2 (1 x 1, around the axis), seen by cameras on a row at z = 0.
Scene PlateBeforeWall(int wall_points, int plate_points, std::uint64_t seed);

// The observation of a view, where its pixel does not matter.
Observation SeenBy(int view);

// Everything moved: the same photos, another world.
Scene Moved(Scene scene, double scale, const Eigen::Vector3d& translation);

}  // namespace lumi::test
