// Which photo is which colour in a picture of false colours.
#pragma once

#include <string>
#include <vector>

#include "render/lumigraph/view_weights.h"
#include "scene/files/json_keys.h"
#include "scene/model/scene.h"

namespace lumi {

struct LegendEntry {
  std::string photo, color;  // "#rrggbb"
  double share = 0;          // of the picture's pixels, by weights
};
void ListKeys(JsonKeys& j, LegendEntry& entry);

// The colour of a photo in false colours, "#rrggbb".
std::string FalseColorOf(int view);
// The photos whose share of the picture (one a view of the scene) is at least a thousandth, the largest first.
std::vector<LegendEntry> LegendOf(const Scene& scene, const std::vector<double>& shares);
// The photos that give at least a thousandth of the picture's pixels, the largest share first.
std::vector<LegendEntry> LegendOf(const Scene& scene, const ViewWeights& weights);
// As SVG: a patch of colour, the photo's name and its share, a line each.
std::string LegendSvg(const std::vector<LegendEntry>& legend);

}  // namespace lumi
