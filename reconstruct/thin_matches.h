// Fewer matches for COLMAP's mapper. After each photo that it places it triangulates, completes, merges, filters and
// adjusts points; a photo has thousands of them, and some hundreds hold its camera as well. So cameras are placed by
// the longest tracks (features that verified matches join), as many as each region of each photo and each pair of
// photos needs, and points are triangulated from all matches after that.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

namespace lumi {

struct ThinningOptions {
  int cells = 4;        // each photo is divided into so many by so many
  int of_a_cell = 16;   // observations that are wanted in each, where there are any
  int of_a_pair = 100;  // matches that are wanted of each pair: COLMAP begins with one that has 100 inliers or more
};

// Photos by their numbers, features by their positions among the photo's keypoints.
struct PairMatches {
  std::int32_t photo1 = 0, photo2 = 0;
  std::vector<std::pair<int, int>> matches;
};

// Of each pair the matches that are left, in their order. Tracks that hold two features of one photo contain a wrong
// match: they are taken last. keypoints_px: of each photo. O(matches).
std::vector<PairMatches> ThinMatches(const std::vector<PairMatches>& pairs,
                                     const std::vector<std::vector<Eigen::Vector2d>>& keypoints_px,
                                     const ThinningOptions& options = {});

// A copy of a COLMAP database whose verified matches are thinned; false, and no copy, where more than two thirds of
// the matches would be left.
bool WriteThinnedDatabase(const std::filesystem::path& database, const std::filesystem::path& thinned);

}  // namespace lumi
