// What two photos' matches agree on, labelled as COLMAP labels it: the fundamental matrix, with known focal lengths the
// essential matrix too, and the homography, each by RANSAC (OpenCV's USAC: MSAC scores, local optimisation, DEGENSAC's
// test for planes), and which of them the pair's inliers are taken from. Bounds are those of COLMAP 3.8's
// TwoViewGeometry.
//
// Same matches and seed, same geometry.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "scene/model/camera.h"

namespace lumi {

// COLMAP's numbers, as they stand in a database.
enum class PairLabel : int {
  kUndefined = 0,
  kDegenerate = 1,         // no model has kMinInliers
  kCalibrated = 2,         // essential matrix
  kUncalibrated = 3,       // fundamental matrix
  kPlanar = 4,             // homography; focal lengths known: no rotation explains it
  kPanoramic = 5,          // homography of a camera that only turned; focal lengths known
  kPlanarOrPanoramic = 6,  // homography; focal lengths unknown
  kWatermark = 7,          // a shift of what stands along the photos' borders
};
std::string Name(PairLabel label);

struct PairGeometry {
  PairLabel label = PairLabel::kUndefined;
  std::vector<std::pair<int, int>> inliers;     // of the matches, in their order
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();  // x_b^T F x_a = 0, pixels
  Eigen::Matrix3d E = Eigen::Matrix3d::Zero();  // the same of points on the plane z = 1
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();  // x_b ~ H x_a, pixels
};

struct PairGeometryOptions {
  double max_error_px = 4;    // to the epipolar line (Sampson's), or to where the homography maps a point
  int min_inliers = 15;       // of a pair that counts
  double confidence = 0.999;  // that one of the samples drawn held no outlier
  int max_trials = 10000;
  std::uint64_t seed = 0;
};

// One photo of a pair.
struct PairPhoto {
  const std::vector<Eigen::Vector2d>& keypoints_px;
  const Camera& camera;
  bool focal_is_known = false;  // by EXIF or the user, not guessed
};

// matches: positions in the keypoints of a and b.
PairGeometry EstimatePairGeometry(const PairPhoto& a, const PairPhoto& b,
                                  const std::vector<std::pair<int, int>>& matches, const PairGeometryOptions& options);

}  // namespace lumi
