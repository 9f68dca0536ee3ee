// Two models of one capture made one. A mapper that finds no next photo begins anew, and what it then builds may
// overlap the first model, or be tied to it by matches too thin to place a photo by: together they can still say how
// the two lie to each other (a similarity of seven numbers, where a photo's own few points must give its pose).
//
// The evidence is points that both have: seen at the same pixel of a photo that stands in both, or tied by verified
// matches of two photos. Three of them give a similarity; the one that most agree on counts (RANSAC), if enough do.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/standing.h"
#include "scene/geometry/similarity3.h"
#include "scene/model/scene.h"

namespace lumi {

// So many points must agree on how two models lie, and of all that the matches tie together this share: two places that
// look alike (two gates of one wall) agree on a few only.
constexpr int kMinCommonPoints = 30;
constexpr double kMinCommonShare = 0.5;

// How two models lie to each other.
struct ModelTie {
  Similarity3 a_from_b;
  int common_photos = 0;
  int common_points = 0;                           // those that agree
  int agree_unmoved = 0;                           // those that would with both models as they are, in one frame
  std::map<std::int32_t, std::int32_t> same_of_b;  // b's points that agree -> a's
};

struct MergedModel {
  Scene scene;  // a's frame; b's photos that a lacks, under the similarity; error_px is not set
  ModelTie tie;
};

using MatchesOf = std::function<std::vector<ViewMatches>(const Scene&)>;
using SameCamera = std::function<bool(const std::string&, const std::string&)>;

// a, b: metric, distorted cameras, observations at keypoints. matches_of: the verified matches among a scene's views,
// as VerifiedMatchesOf gives them. same_camera: whether two photos were taken by one camera whose lens is to be shared.
// nullopt: too few common points, or on a line.
std::optional<MergedModel> MergeModels(const Scene& a, const Scene& b, const MatchesOf& matches_of,
                                       const SameCamera& same_camera);

// The two steps of it. matches: among the views of a, then those of b that a lacks.
std::optional<ModelTie> TieModels(const Scene& a, const Scene& b, const std::vector<ViewMatches>& matches);
Scene JoinModels(const Scene& a, const Scene& b, const ModelTie& tie, const SameCamera& same_camera);

}  // namespace lumi
