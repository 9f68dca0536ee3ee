// A first, robust projective reconstruction of a window: the pair with most parallax, then camera after camera by
// resection and track after track by intersection. It tells outliers from inliers, bridges missing data, and gives the
// factorisation its projective depths (what Sturm and Triggs take from fundamental matrices; theirs fail near an
// epipole).
#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/factorization/projective_model.h"

namespace lumi {

struct SeedOptions {
  double inlier_px = 4.0;    // reprojection error of an inlier
  double epipolar_px = 2.0;  // distance to an epipolar line of an inlier
  int pairs = 6;             // how many pairs are tried as the first
  std::uint64_t seed = 0;
};

enum class SeedOutcome {
  kPlaced,        // two frames at least have cameras
  kTooFewTracks,  // no two frames share enough tracks that agree
  kNoParallax,    // homographies explain all pairs that were tried
};

// Image b from image a where a homography explains both, in normalised coordinates.
struct PairHomography {
  int a = -1, b = -1;
  Eigen::Matrix3d H = Eigen::Matrix3d::Identity();
};

struct Seed {
  SeedOutcome outcome = SeedOutcome::kTooFewTracks;
  ProjectiveModel model;
  int a = -1, b = -1;  // the first pair
  double parallax_px = 0;
  std::vector<PairHomography> homographies;  // of the pairs without parallax
};

Seed SeedWindow(const ImagePoints& points, const SeedOptions& options);

// Places what can be placed among frames not placed yet, by resection from solved tracks, and solves tracks not solved
// yet. Returns the number of frames placed.
int Grow(const ImagePoints& points, ProjectiveModel& model, const SeedOptions& options);

}  // namespace lumi
