// What the window shows: the lumigraph's picture, the proxy itself, or one measure of the reconstruction.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/show/measure_map.h"
#include "render/world/renderer.h"

namespace lumi {

struct Seen {
  Show show = Show::kColor;             // of the lumigraph, which is drawn in any case: picking reads its depth
  bool flat = false;                    // the proxy's faces, flat-shaded, instead (Fig. 5-14)
  std::optional<Measure> measure = {};  // a heat map instead
  friend bool operator==(const Seen&, const Seen&) = default;
};

struct SeenName {
  std::string_view name, help;
  Seen seen;
};
// color, false-color, tessellation, proxy, weights, angle ...: as scripts and the panel call them.
const std::vector<SeenName>& SeenNames();
std::optional<Seen> SeenFromName(std::string_view name);
std::string_view NameOf(const Seen& seen);

}  // namespace lumi
