// Published methods of image-based rendering that this renderer is compared with: other ways to weigh the same photos
// over the same proxy. Each is a file named for its paper, and a RayMethod (radiance/ray_method.h): photos,
// corrections, blending and measuring are the same for all. docs/methods.md says where each departs from its paper.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "render/radiance/frame_plan.h"
#include "render/radiance/ray_method.h"
#include "render/radiance/sources.h"

namespace lumi {

// The method that setup.settings.method names, made for this view; nullptr for kUlr. Throws DataError where the method
// cannot take these cameras (a camera plane that the cameras do not lie along, photos that cannot be rectified).
std::shared_ptr<const RayMethod> MakeComparator(const Sources& sources, const ProxyTracer& proxy,
                                                const ViewSetup& setup);

// What a method reads method_count and method_parameter as; empty: it does not read them.
struct ComparatorOptions {
  std::string_view count, parameter;
};
ComparatorOptions OptionsOf(Algorithm method);
// Empty, or a message naming an option that is given and that the method does not read.
std::string ProblemOf(const RadianceSettings& settings);

// The settings to be compared on the choosing fold, the paper's own first; docs/methods.md lists them.
std::vector<RadianceSettings> SettingsToChooseFrom(Algorithm method, const RadianceSettings& base);

}  // namespace lumi
