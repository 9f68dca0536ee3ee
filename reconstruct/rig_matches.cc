#include "reconstruct/rig_matches.h"

#include <algorithm>
#include <map>

#include "reconstruct/colmap_database.h"
#include "scene/program/error.h"

namespace lumi {

std::vector<RigMatch> MatchesOfRig(const Capture& capture, const std::filesystem::path& path, std::size_t per_pair,
                                   double min_motion_px, const std::function<bool(int a, int b)>& near) {
  const ColmapDatabase database(path);
  std::map<std::string, int> index_of;
  for (std::size_t i = 0; i < capture.photos.size(); ++i) index_of[capture.photos[i].name] = static_cast<int>(i);
  std::map<std::int64_t, int> photo_of;
  std::map<std::int64_t, std::vector<Eigen::Vector2d>> keypoints;
  for (const auto& image : database.Images()) {
    const auto it = index_of.find(image.name);
    if (it == index_of.end()) continue;
    photo_of[image.id] = it->second;
    keypoints[image.id] = database.Keypoints(image.id);
  }
  std::vector<RigMatch> matches;
  for (const auto& pair : database.MatchedPairs()) {
    const auto a = photo_of.find(pair.image1), b = photo_of.find(pair.image2);
    if (a == photo_of.end() || b == photo_of.end() || pair.matches == 0 || !near(a->second, b->second)) continue;
    std::vector<RigMatch> of_pair;
    for (const auto& [i, j] : database.Matches(pair.image1, pair.image2)) {
      const auto &ka = keypoints[pair.image1], &kb = keypoints[pair.image2];
      if (static_cast<std::size_t>(i) >= ka.size() || static_cast<std::size_t>(j) >= kb.size())
        throw InputError(path, "a match names a feature that is not there");
      const RigMatch match{a->second, b->second, ka[static_cast<std::size_t>(i)], kb[static_cast<std::size_t>(j)]};
      if ((match.x_a_px - match.x_b_px).norm() >= min_motion_px) of_pair.push_back(match);
    }
    const std::size_t stride = std::max<std::size_t>(1, of_pair.size() / per_pair);
    for (std::size_t k = 0; k < of_pair.size(); k += stride) matches.push_back(of_pair[k]);
  }
  return matches;
}

}  // namespace lumi
