#include "render/viewer/seen.h"

#include <algorithm>

namespace lumi {

const std::vector<SeenName>& SeenNames() {
  static const std::vector<SeenName> names = {
      {"color", "As the photos are", {}},
      {"false-color", "One colour a photo, blended with the same weights", {.show = Show::kFalseColor}},
      {"tessellation", "The sparse samples' triangles or cells over the picture", {.show = Show::kTessellation}},
      {"proxy", "The proxy's faces, flat-shaded; those seen from behind are red", {.flat = true}},
      {"weights", "The weight of the photo that weighs most", {.measure = Measure::kWeight}},
      {"angle", "The angle to that photo's ray", {.measure = Measure::kAngle}},
      {"fov", "How far inside that photo's field of view", {.measure = Measure::kFieldOfView}},
      {"resolution", "That photo's resolution against the picture's", {.measure = Measure::kResolution}},
      {"visibility", "How much that photo sees of the point", {.measure = Measure::kVisibility}},
      {"time", "How far that photo is in time", {.measure = Measure::kTime}},
      {"dissimilarity", "All measures together, as they are weighed", {.measure = Measure::kDissimilarity}}};
  return names;
}

std::optional<Seen> SeenFromName(std::string_view name) {
  const auto& names = SeenNames();
  const auto found = std::find_if(names.begin(), names.end(), [&](const SeenName& n) { return n.name == name; });
  return found == names.end() ? std::nullopt : std::optional(found->seen);
}

std::string_view NameOf(const Seen& seen) {
  const auto& names = SeenNames();
  const auto found = std::find_if(names.begin(), names.end(), [&](const SeenName& n) { return n.seen == seen; });
  return found == names.end() ? "color" : found->name;
}

}  // namespace lumi
