// A projective scene of a video as stabilisation reads it (thesis sec. 6.2): one matrix a frame, points, and where each
// frame saw them, in a frame of the world and of the image in which numbers are of the order of one.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "scene/geometry/projection.h"
#include "scene/model/scene.h"

namespace lumi {

struct SightOfPoint {
  std::int32_t point = -1;                      // into FilmedScene::X
  Eigen::Vector2d x = Eigen::Vector2d::Zero();  // units: see FilmedScene
};

struct FilmedFrame {
  std::string name;  // of the photo
  double time_s = 0;
  Matrix34d P = Matrix34d::Zero();      // units from the balanced world, norm 1, w > 0 in front
  std::vector<SightOfPoint> sights;     // that agree with P and X
  std::vector<Eigen::Vector4d> border;  // points seen along the picture's very border, in order around it: the depth of
                                        // the points inside, extended (where they are fewer than four: the
                                        // nearest frame's that has them). Empty where no frame has points
};

// A unit is half the picture's longer side, its origin the picture's middle. The world is balanced: the matrices, each
// of norm 1 and stacked, have orthogonal columns of one length, and the first is [L | 0]: the same numbers whatever
// projective frame the scene came in.
struct FilmedScene {
  Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
  double fps = 30;                           // one over the median step; steps may differ
  std::vector<FilmedFrame> frames;           // in the order of time
  std::vector<Eigen::Vector4d> X;            // norm 1, w > 0 in front of who sees them
  Plane plane_at_infinity = Plane::UnitW();  // approximate: from cheirality alone. Norm 1, positive at the points
  Eigen::Matrix4d world_from_balanced = Eigen::Matrix4d::Identity(), balanced_from_world = Eigen::Matrix4d::Identity();
  bool one_centre = false;  // all matrices share their centre: homographies, no structure; X are directions from it

  // Times of the frames, in frames of 1 / fps after the first: whole numbers where they differ from these by the
  // rounding of seconds only.
  std::vector<double> TimesInFrames() const;
  double px_per_unit() const { return 0.5 * size_px.maxCoeff(); }
  // Half the picture, units: (1, 0.5625) at 16:9.
  Eigen::Vector2d half() const { return size_px.cast<double>() / (2 * px_per_unit()); }
  Matrix34d InPixels(const Matrix34d& P) const;    // pixels from the scene's own world
  Matrix34d InUnits(const Matrix34d& P_px) const;  // its inverse, norm 1
};

// Any frame of the world: metric scenes are projective ones with a plane at infinity that is known. Frames are the
// views in the order of their frame numbers, else of their names; times are the views' own, else the order over `fps`
// (where given, else 30). Throws DataError: fewer than two views, views of several sizes, no plane at infinity.
FilmedScene ReadFilmedScene(const Scene& scene, std::optional<double> fps);

}  // namespace lumi
