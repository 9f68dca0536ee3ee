// Published methods of image-based rendering, as other ways to weigh the same photos over the same proxy: what this
// renderer is compared with. Each is a file named for its paper, and a RayMethod (radiance/ray_method.h): photos,
// corrections, blending and measuring are the same for all. docs/methods.md says where each departs from its paper.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/ray_method.h"
#include "render/radiance/sources.h"

namespace lumi {

// What setup.settings.method names, for this view; nullptr for kUlr. Throws DataError where the method cannot take
// these cameras (a camera plane that the cameras do not lie along, photos that cannot be rectified).
std::shared_ptr<const RayMethod> MakeComparator(const Sources& sources, const ProxyTracer& proxy,
                                                const ViewSetup& setup);

// What method_count and method_parameter are of it; empty: it does not read them.
struct ComparatorOptions {
  std::string_view count, parameter;
};
ComparatorOptions OptionsOf(Algorithm method);
// Empty, or which option is given that the method does not read, or cannot take.
std::string ProblemOf(const RadianceSettings& settings);

// The settings that the choosing fold picks from, the paper's own first: as many as docs/methods.md says for each.
std::vector<RadianceSettings> SettingsToChooseFrom(Algorithm method, const RadianceSettings& base);

}  // namespace lumi
