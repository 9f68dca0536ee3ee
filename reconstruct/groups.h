// Whether groups of photos that are tied closely to each other, but weakly to the rest of a model, lie where they
// should. Their own photos hold each other's points, so no camera of theirs contradicts its evidence (standing.h)
// however far off the whole group stands.
//
// The model is cut at its thinnest ties (the weakest edges of the view graph's maximum spanning tree, weighted by
// common points). Both sides are then models of their own, and the verified matches between them say how they lie to
// each other, as they would of two models that were never joined (merge_models.h).
#pragma once

#include <string>
#include <vector>

#include "reconstruct/standing.h"
#include "scene/model/scene.h"

namespace lumi {

struct HangingGroup {
  std::vector<std::string> photos;
  int points = 0;      // of the model, that photos of both sides saw
  bool moved = false;  // as a whole, to where the matches have it; else nothing, or too little, says where it belongs
};

struct VerifiedGroups {
  Scene scene;
  bool changed = false;  // it wants another adjustment
  std::vector<HangingGroup> groups;
};

// scene: metric, distorted cameras, observations at keypoints, views in the order of their names. Views keep their
// numbers, points are triangulated anew where a group was moved. O(points * track^2), and a tie of two models for each
// of the 20 thinnest places at most.
VerifiedGroups VerifyGroups(Scene scene, const std::vector<ViewMatches>& matches);

}  // namespace lumi
