// A photo's camera at the size that stereo works at, and what lies between two of them.
#pragma once

#include <Eigen/Core>

#include "scene/geometry/rigid3.h"
#include "scene/model/scene.h"

namespace lumi {

struct StereoCamera {
  int width = 0, height = 0;
  Eigen::Vector2d focal_px = Eigen::Vector2d::Ones(), centre_px = Eigen::Vector2d::Zero();
  Rigid3 cam_from_world;

  double FocalPx() const { return focal_px.mean(); }
  // A pixel's ray at depth 1, in the camera's frame.
  Eigen::Vector3d Ray(double x, double y) const {
    return {(x - centre_px.x()) / focal_px.x(), (y - centre_px.y()) / focal_px.y(), 1};
  }
  Eigen::Vector3d InWorld(double x, double y, double depth) const {
    return cam_from_world.rotation.conjugate() * (depth * Ray(x, y) - cam_from_world.translation);
  }
};

// The view's camera with its photo `width` x `height` pixels large. The scene's cameras are pinholes (RequireMetric).
StereoCamera MakeStereoCamera(const Scene& scene, const View& view, int width, int height);
StereoCamera Resized(const StereoCamera& camera, int width, int height);

// A photo's size shrunk until its longer side is at most so long; never enlarged.
Eigen::Vector2i StereoSize(const Eigen::Vector2i& photo_px, int longer_px);

// Homogeneous pixel of the source for pixel (x, y) of the reference at inverse depth w: A (x, y, 1) + w b; its third
// component is the depth in the source times w. Poses are subtracted in double: where the world's origin lies does not
// matter.
struct PairGeometry {
  float a[9] = {};  // row by row
  float b[3] = {};
};
PairGeometry Pair(const StereoCamera& reference, const StereoCamera& source);

}  // namespace lumi
