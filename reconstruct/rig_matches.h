// Matches between photos that stand near one another in an assumed rig, from COLMAP's database.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <vector>

#include "reconstruct/photos.h"

namespace lumi {

struct RigMatch {
  int a = 0, b = 0;  // photos
  Eigen::Vector2d x_a_px, x_b_px;
};

// Of pairs for which near(a, b) holds, thinned evenly to `per_pair`, moved by min_motion_px at least (on a turntable
// the room stands still: matches that do not move are the room's, not the object's).
std::vector<RigMatch> MatchesOfRig(const Capture& capture, const std::filesystem::path& database, std::size_t per_pair,
                                   double min_motion_px, const std::function<bool(int a, int b)>& near);

}  // namespace lumi
