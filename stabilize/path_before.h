// A long film's path is made window by window: what the path of the window before says about the frames that both have,
// and how the one gives way to the other.
#pragma once

#include <optional>
#include <vector>

#include "scene/files/matrix_path.h"
#include "stabilize/filmed_scene.h"
#include "stabilize/path_problem.h"
#include "stabilize/world_map.h"

namespace lumi {

// Of the frames that two windows have in common, in the order of time: before `begin` the earlier path alone, from
// `end` on the later one alone. The later window shows those from `begin` on: there it has the frames before that fill
// a picture. The seam is as wide as that allows: a path is less certain the nearer it is to its end, and a wider seam
// makes the transition slower.
struct Seam {
  int begin = 0, end = 0;
};
Seam SeamOf(int overlap, int half_window);

// The later path's share in what is shown of frame `frame`: 0, then rising with continuous acceleration to 1.
double SeamShare(const std::vector<double>& times, std::size_t frame, const Seam& seam);

// Of a point in homogeneous coordinates, units; nullopt: not in front of the camera.
std::optional<Eigen::Vector2d> ImageOf(const Matrix34d& P, const Eigen::Vector4d& X);

struct Move {
  Eigen::Vector2d to_px = Eigen::Vector2d::Zero();
  double sureness = 1;  // 1: from the same feature; less where neighbours, of other depths maybe, stand for it
};

// Where the frame's pixels went, near x: the affine map of the nearest anchors, and where one of them is the same
// feature, that one's. nullopt: fewer than four anchors.
std::optional<Move> Moved(const std::vector<Anchor>& anchors, const Eigen::Vector2d& x_px);

// Where the path before puts a pixel of frame t, seen at `filmed_px` and in this window's world at X: by that path's
// own matrices where both windows have structure, since what the shake's parallax is depends on depth; else as its
// neighbours in the picture went.
class PathBefore {
 public:
  // shown: that path's keys of this window's frames, nullptr where it has none; points: this window's, a frame each.
  // film and shown must outlive it.
  PathBefore(const FilmedScene& film, const std::vector<const MatrixKey*>& shown,
             const std::vector<std::vector<WantedPoint>>& points);

  std::optional<Move> Of(std::size_t t, const Eigen::Vector4d& X, const Eigen::Vector2d& filmed_px) const;

 private:
  const FilmedScene& film_;
  const std::vector<const MatrixKey*>& shown_;
  std::optional<WorldMap> map_;
};

}  // namespace lumi
