// Which photos stereo compares a photo with: those that share many of its points, seen at an angle that shows depth.
#pragma once

#include <vector>

#include "scene/model/scene.h"

namespace lumi {

struct SourceView {
  ViewId view;
  std::size_t shared = 0;  // points
  double angle_deg = 0;    // between their rays, in the middle
  double score = 0;
};

// For each view its best sources, best first, at most `most`. A shared point counts in full at about 5 degrees, less
// below (depth is uncertain) and slowly less above (photos look different); photos of one place hardly count. A view
// may have none. Throws DataError where no two photos see a point at kSmallestAngleDeg or more: cameras that only turn,
// or copies of one photo, show no depth.
inline constexpr double kSmallestAngleDeg = 0.5;
std::vector<std::vector<SourceView>> PickSources(const Scene& scene, std::size_t most);

}  // namespace lumi
