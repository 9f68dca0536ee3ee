// How far a factorised scene is from the simulated truth.
#pragma once

#include <algorithm>

#include "factorization_scenes.h"
#include "reconstruct/factorization/reconstruct_from_tracks.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/similarity3.h"

namespace lumi::test {

struct TruthErrors {
  std::size_t placed = 0;
  double rotation_max_deg = 0;  // after alignment
  double neighbour_rotation_max_deg =
      0;                        // between neighbouring placed frames: says whether a scene is bent, whatever its extent
  double centre_max_share = 0;  // of the scene's size
};

// Of a metric result.
inline TruthErrors ErrorsAgainst(const SimulatedTracks& s, const FactorizationResult& r) {
  TruthErrors e;
  std::vector<Rigid3> found, truth;
  for (std::size_t f = 0; f < r.placed.size(); ++f) {
    if (!r.placed[f]) continue;
    if (!found.empty()) {
      const Eigen::Quaterniond step = r.cam_from_world[f].rotation * found.back().rotation.conjugate();
      const Eigen::Quaterniond true_step = s.cam_from_world[f].rotation * truth.back().rotation.conjugate();
      e.neighbour_rotation_max_deg =
          std::max(e.neighbour_rotation_max_deg, step.angularDistance(true_step) * kDegPerRad);
    }
    found.push_back(r.cam_from_world[f]);
    truth.push_back(s.cam_from_world[f]);
  }
  e.placed = found.size();
  e.rotation_max_deg = ComparePoses(found, truth).rotation_max_deg;
  const Similarity3 align = AlignPoses(found, truth);
  for (std::size_t i = 0; i < found.size(); ++i)
    e.centre_max_share = std::max(
        e.centre_max_share, (align * found[i].OriginInSource() - truth[i].OriginInSource()).norm() / s.scene_size);
  return e;
}

}  // namespace lumi::test
