// What a corner looked like when its track began, found again in later frames under an affine map and a change of
// exposure (Shi and Tomasi 1994: dissimilarity to the first frame; Baker and Matthews 2004: inverse compositional).
// A track that is held to its first patch does not drift: errors of single steps do not add up.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

constexpr int kPatchLanes = 16;

struct AffinePatch {
  int radius_px = 0;
  // (2 radius + 1)^2 pixels row by row, then zeros up to a multiple of kPatchLanes.
  std::vector<float> value;     // weighted mean 0, weighted variance 1
  std::vector<float> weight;    // sum 1
  std::vector<float> steepest;  // six times as many: weight x d value / d a11, all pixels, then a12 a21 a22 tx ty
  Eigen::Matrix<double, 6, 6> inverse_hessian = Eigen::Matrix<double, 6, 6>::Zero();
};

// Pixel d of the patch lies at x_px + A d of a frame.
struct PatchPose {
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();  // corner of the image is (0, 0)
  Eigen::Matrix2d A = Eigen::Matrix2d::Identity();
};

struct PatchMatch {
  PatchPose pose;
  double correlation = 0;  // normalised, -1 ... 1
};

// grey: one channel. nullopt where the patch does not lie inside the frame, or where it has too little contrast in some
// direction to be found again.
std::optional<AffinePatch> TakePatch(const ImageF& grey, const Eigen::Vector2d& x_px, int radius_px);

// From `start`, to within about 0.01 px of the optimum. nullopt where it leaves the frame, does not settle, or settles
// at an A that is no view of the same patch (scale beyond 2.5, stretched beyond 3 to 1, mirrored).
std::optional<PatchMatch> AlignPatch(const AffinePatch& patch, const ImageF& grey, const PatchPose& start);

}  // namespace lumi
