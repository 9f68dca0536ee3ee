// What one silhouette says about space: a point is carved where it projects beside the silhouette. The cone is kept as
// the signed distance of a pixel to the silhouette's border, so that a silhouette of any shape (holes, several parts)
// is one smooth function, and no polygon is ever intersected with another.
//
// Where a silhouette touches a side of its image, the object may go on beyond that side: there the view says nothing,
// and the other views decide. Beyond a side that it does not touch, and behind the camera, there is no object.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "scene/geometry/projection.h"
#include "scene/model/image.h"

namespace lumi {

// A silhouette with its camera, as hulls are made from.
struct SilhouetteView {
  std::string name;
  Matrix34d P = Matrix34d::Zero();  // pixels from world, w > 0 in front
  Image8 mask;                      // one channel, 255 = object, 0 = not
};

// Pixels of object.
std::size_t CountObject(const Image8& mask);

class SilhouetteCone {
 public:
  // What it says of a point that lies behind the camera, in pixels: outside, whatever the dilation.
  static constexpr float kBehind = 1e6F;

  // mask: at least one pixel of object and one without. World lengths are `unit` long and start at `origin` in what
  // follows (a frame in which numbers are about 1: a scene may be in any unit, anywhere).
  SilhouetteCone(const SilhouetteView& view, const Eigen::Vector3d& origin, double unit);

  // Signed distance from the silhouette's border to the point's projection, in pixels, negative inside.
  float Distance(const Eigen::Vector3d& x) const {
    const double w = p_[8] * x[0] + p_[9] * x[1] + p_[10] * x[2] + p_[11];
    if (!(w > kNearest)) return kBehind;
    const double r = 1 / w;
    return AtPixel((p_[0] * x[0] + p_[1] * x[1] + p_[2] * x[2] + p_[3]) * r,
                   (p_[4] * x[0] + p_[5] * x[1] + p_[6] * x[2] + p_[7]) * r);
  }
  // Of a pixel (the centre of the first is (0.5, 0.5)), inside the image or outside.
  float AtPixel(double u, double v) const;

  // Bounds of Distance over a ball: [low, high]. A ball that reaches the camera's plane has [-inf, kBehind].
  struct Range {
    float low, high;
  };
  Range Bounds(const Eigen::Vector3d& centre, double radius) const;

  // Distance from the image's frame, in pixels, negative inside; kBehind behind the camera.
  float FrameDistance(const Eigen::Vector3d& x) const;
  // Pixels that a step of one unit at x moves at most; 0 behind the camera.
  double PixelsPerUnit(const Eigen::Vector3d& x) const;
  bool IsCut() const { return open_[0] || open_[1] || open_[2] || open_[3]; }  // touches a side of the image
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  static constexpr double kNearest = 1e-9;  // depth, in units: nearer counts as behind

  std::array<double, 12> p_;  // row-major, the third row's first three of length 1: w is the depth
  int width_, height_, stride_, rows_;
  std::array<bool, 4> open_;     // left, top, right, bottom
  std::vector<float> distance_;  // at pixel centres, with a margin around the image
};

}  // namespace lumi
