// A light slab: rays by where they cross the plane of the cameras and where they meet a surface. Cameras on a grid are
// its samples; others are resampled to a grid by their rays, whose holes are filled from coarser grids (the push-pull
// of Gortler et al. 1996). Light field and lumigraph differ in the surface: a plane, or the proxy.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/comparators/point_method.h"

namespace lumi {

// The plane that the cameras lie along and a grid in it, normalised frame.
struct CameraGrid {
  Eigen::Vector3d origin, normal, e1, e2;  // normal: the mean viewing direction
  Eigen::Vector2d first, step;             // of the grid, in (e1, e2)
  int columns = 1, rows = 1;
};

// Fits the grid to all cameras, also to those that are left out: their positions are known. cells: wanted number of
// grid points; below 1: as many as cameras. Throws DataError if a camera looks more than 60 degrees away from the mean
// direction: one slab cannot hold such a capture.
CameraGrid FitCameraGrid(const Sources& sources, double cells, std::string_view method);

class LightSlab : public PointMethod {
 public:
  LightSlab(const CameraGrid& grid, const ViewSetup& setup);

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const override;
  bool heeds_visibility() const override { return false; }

 private:
  // Where the line from `from` to the point crosses the plane of the cameras, in grid steps.
  Eigen::Vector2d Crossing(const Eigen::Vector3d& from, const Eigen::Vector3d& point) const;

  CameraGrid grid_;
  Eigen::Vector3d eye_;
};

}  // namespace lumi
