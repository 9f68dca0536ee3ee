#include "render/viewer/seen.h"

#include <algorithm>

namespace lumi {

const std::vector<SeenName>& SeenNames() {
  static const std::vector<SeenName> names = [] {
    std::vector<SeenName> list = {
        {"color", "As the photos are", {}},
        {"false-color", "One colour a photo, blended with the same weights", {.show = Show::kFalseColor}},
        {"tessellation", "The sparse samples' triangles or cells over the picture", {.show = Show::kTessellation}},
        {"proxy", "The proxy's faces, flat-shaded; those seen from behind are red", {.flat = true}}};
    for (std::size_t row = 0; row < HeatMaps().size(); ++row)
      list.push_back({HeatMaps()[row].name, HeatMaps()[row].help, {.measure = Measure{row}}});
    return list;
  }();
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
