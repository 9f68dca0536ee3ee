// Where an imported mesh belongs in the scene: units, axes, pairs of points.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/geometry/similarity3.h"

namespace lumi {

// Metres in one of `unit`: um, mm, cm, dm, m, km, in, ft. Throws UsageError naming them.
double MetresIn(const std::string& unit);

// What the mesh's axes are in the scene's frame, a rotation or, where the mesh is of a left-handed frame, one with a
// reflection.
// - "y-up", "z-up", "-y-up" ...: the mesh's axis that is the scene's up, turned there the shortest way (about x from
//   straight below)
// - "x,-z,y": the scene's x, y and z, each as one of the mesh's axes
// Throws UsageError.
Eigen::Matrix3d AxesFromText(const std::string& text, const Eigen::Vector3d& scene_up);

struct PointPair {
  Eigen::Vector3d mesh = Eigen::Vector3d::Zero();   // in the file's own coordinates
  Eigen::Vector3d scene = Eigen::Vector3d::Zero();  // in world
};
// JSON, {"pairs": [{"mesh": [x, y, z], "scene": [x, y, z]}, ...]}, or CSV: six numbers a line, mesh then scene,
// separated by commas, semicolons or blanks; a line that starts with # or with a letter says nothing. Throws InputError
// naming the place.
std::vector<PointPair> ReadPointPairs(const std::filesystem::path& file);

struct PairAlignment {
  Similarity3 scene_from_mesh;
  std::vector<double> distance;  // that is left of each pair, in world units
  double rms = 0;
  double rms_of_extent = 0;  // over the diagonal of the scene points' bounding box
};
// Umeyama 1991. Throws DataError for fewer than three pairs, collinear ones and ones at one place.
PairAlignment AlignPairs(const std::vector<PointPair>& pairs);

}  // namespace lumi
