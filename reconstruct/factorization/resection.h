// A camera from points that are already known: six-point RANSAC, then all that agree, by the direct linear
// transformation and Gauss-Newton on the reprojection error (Hartley & Zisserman, sec. 7.1). Projective: P has 11
// degrees of freedom.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "scene/geometry/levenberg_marquardt.h"
#include "scene/geometry/projection.h"

namespace lumi {

struct ResectionOptions {
  double inlier_px = 4.0;
  int max_iterations = 1000;
  int min_inliers = 10;
  std::uint64_t seed = 0;
};

struct Resection {
  Matrix34d P = Matrix34d::Zero();  // norm 1
  std::vector<char> inlier;
  int inlier_count = 0;
  double rms_px = 0;            // of the inliers
  LeastSquaresSummary refined;  // of the last refinement
};

// X: homogeneous, norm 1; x: normalised image points. nullopt where fewer than min_inliers agree with any camera.
std::optional<Resection> Resect(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x,
                                double px_per_unit, const ResectionOptions& options);

// P to the least reprojection error of the points in `use`; Cauchy weights of this scale (0: least squares).
LeastSquaresSummary RefineCamera(const std::vector<Eigen::Vector4d>& X, const std::vector<Eigen::Vector2d>& x,
                                 const std::vector<char>& use, double px_per_unit, double scale_px, Matrix34d& P);

}  // namespace lumi
