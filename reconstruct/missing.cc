#include "reconstruct/missing.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "scene/geometry/median.h"

namespace lumi {
namespace {

// A sharp photo of a textured scene gives thousands of features; below this hardly any pair can be matched.
constexpr int kFewFeatures = 150;
// A photo this much poorer than the median photo stands out: motion blur, defocus, a plain wall.
constexpr double kFewFeaturesShare = 0.1;
// COLMAP needs 30 verified points (Mapper.abs_pose_min_num_inliers) to place a photo.
constexpr int kFewMatches = 30;

}  // namespace

std::vector<MissingPhoto> ExplainMissing(const Capture& capture, const ColmapDatabase& database,
                                         const std::set<std::string>& registered,
                                         const std::vector<std::set<std::string>>& other_components) {
  std::map<std::string, DatabaseImage> image_of;
  std::map<std::int64_t, std::string> name_of;
  std::vector<int> counts;
  for (const auto& image : database.Images()) {
    image_of[image.name] = image;
    name_of[image.id] = image.name;
    counts.push_back(image.keypoints);
  }
  const int median = Median(std::move(counts));
  // The registered photo that each photo matches best.
  std::map<std::string, std::pair<int, std::string>> best;
  for (const auto& pair : database.VerifiedPairs()) {
    const auto a = name_of.find(pair.image1), b = name_of.find(pair.image2);
    if (a == name_of.end() || b == name_of.end()) continue;
    for (const auto& [from, to] : {std::pair(a->second, b->second), std::pair(b->second, a->second)})
      if (registered.count(to)) best[from] = std::max(best[from], std::pair(pair.matches, to));
  }

  std::vector<MissingPhoto> missing = capture.unreadable;
  for (const InputPhoto& photo : capture.photos) {
    if (registered.count(photo.name)) continue;
    const auto image = image_of.find(photo.name);
    if (image == image_of.end()) {
      missing.push_back({photo.name, "unreadable: COLMAP could not read it", "save it as JPEG or PNG"});
      continue;
    }
    const int features = image->second.keypoints;
    const auto part =
        std::ranges::find_if(other_components, [&](const auto& names) { return names.count(photo.name) > 0; });
    if (part != other_components.end()) {
      const auto other = std::ranges::find_if(*part, [&](const std::string& name) { return name != photo.name; });
      missing.push_back({photo.name,
                         fmt::format("other component: joined with {} other photo{}{} only", part->size() - 1,
                                     part->size() == 2 ? "" : "s",
                                     other == part->end() ? "" : " (" + *other + (part->size() > 2 ? ", ...)" : ")")),
                         "shoot photos between that part and the rest, or take that part with --component"});
    } else if (features < kFewFeatures || features < kFewFeaturesShare * median) {
      missing.push_back({photo.name,
                         fmt::format("blurred or textureless ({} features; the median photo has {})", features, median),
                         "shoot it again, sharp and with textured things in view"});
    } else if (const auto b = best.find(photo.name); b == best.end() || b->second.first < kFewMatches) {
      missing.push_back({photo.name,
                         b == best.end() ? std::string("too few matches (none with a photo that has a camera)")
                                         : fmt::format("too few matches (best: {} inliers with {})", b->second.first,
                                                       b->second.second),
                         "shoot photos between it and its neighbours: each should show two thirds of the last"});
    } else {
      missing.push_back({photo.name,
                         fmt::format("its position did not fit ({} inliers with {}: repeated or moving things, or "
                                     "hardly a step between the two?)",
                                     b->second.first, b->second.second),
                         "shoot photos between it and its neighbours, or mask what moves (--masks)"});
    }
  }
  std::ranges::sort(missing, [](const auto& a, const auto& b) { return a.name < b.name; });
  return missing;
}

}  // namespace lumi
